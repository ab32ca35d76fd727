// The small dialog that names a marked stretch.
import { h } from "./dom.js";
import { number } from "./format.js";

export function askMark(recording, from, to, done) {
  const label = h("input", { type: "text", maxlength: "200", placeholder: "what is it?", "aria-label": "label" });
  const exclude = h("input", { type: "checkbox" });
  const dialog = h("dialog", { onclose: () => dialog.remove() },
    h("form", { method: "dialog", onsubmit: (event) => {
      if (event.submitter?.value === "keep") done({ start_s: from, stop_s: to, label: label.value, exclude: exclude.checked });
    } },
    h("h2", {}, `Mark ${number(from, 6)} to ${number(to, 6)} s of ${recording}`),
    label,
    h("label", {}, exclude, " exclude: the reference of this stretch is not used in any comparison, diagnosis or fit"),
    h("div", { class: "buttons" }, h("button", { class: "primary", value: "keep" }, "Mark"), h("button", { value: "cancel", formnovalidate: true }, "Cancel"))));
  document.body.append(dialog);
  dialog.showModal();
  label.focus();
}
