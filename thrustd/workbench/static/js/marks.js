// Marked stretches: the small dialog that names one, and their table.
import { h, wideTable } from "./dom.js";
import { number } from "./format.js";

export function askMark(recording, from, to, done) {
  const label = h("input", { type: "text", maxlength: "200", placeholder: "what is it?", "aria-label": "label" });
  const exclude = h("input", { type: "checkbox" });
  const dialog = h(
    "dialog",
    { onclose: () => dialog.remove() },
    h(
      "form",
      {
        method: "dialog",
        onsubmit: (event) => {
          if (event.submitter?.value === "keep")
            done({ start_s: from, stop_s: to, label: label.value, exclude: exclude.checked });
        },
      },
      h("h2", `Mark ${number(from, 6)} to ${number(to, 6)} s of ${recording}`),
      label,
      h("label", exclude, " exclude: the reference of this stretch is not used in any comparison, diagnosis or fit"),
      h(
        "div.buttons",
        h("button", { class: "primary", value: "keep" }, "Mark"),
        h("button", { value: "cancel", formnovalidate: true }, "Cancel"),
      ),
    ),
  );
  document.body.append(dialog);
  dialog.showModal();
  label.focus();
}

// the marks of a recording; `keep` gets what to make of the list, whatever is in it by then
export function marksTable(marks, show, keep) {
  if (!marks.length) return null;
  return wideTable(
    { class: "marks" },
    ["", "", ["", "num"], ["", "num"]],
    marks.map((m) => [
      m.exclude ? h("b.warn", "excluded") : "marked",
      m.label || h("span.faint", "no label"),
      `${number(m.start_s, 6)} to ${number(m.stop_s, 6)} s`,
      [
        plain("show", () => show(m)),
        plain(m.exclude ? "use again" : "exclude", () =>
          keep((now) => now.map((one) => (same(one, m) ? { ...one, exclude: !m.exclude } : one))),
        ),
        plain("remove", () => keep((now) => now.filter((one) => !same(one, m)))),
      ],
    ]),
  );
}

const same = (one, other) => JSON.stringify(one) === JSON.stringify(other);

const plain = (said, onclick) => h("button", { class: "plain", onclick }, said);
