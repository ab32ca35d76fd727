// What the page has to say, in lines of their own above the running work: nothing lies over a plot.
import { h } from "./dom.js";
import { typeset } from "./format.js";

const WORDS = { problem: "Problem", note: "Note", ok: "Done" };
const STAYS_MS = { note: 20_000, ok: 8_000 }; // a problem stays until it is closed or something else is tried
const MOST = 4;

export function showNotices(area) {
  document.addEventListener("attempt", () => {
    for (const old of area.querySelectorAll(".problem")) old.remove();
  });
  document.addEventListener("say", ({ detail: { line, kind } }) => {
    const said = typeset(line);
    for (const old of area.children) if (old.dataset.line === said) old.remove();
    const notice = h(
      "div",
      { class: `notice ${kind}`, role: kind === "problem" ? "alert" : "status", "data-line": said },
      h("b", WORDS[kind]),
      h("span", said),
      h("button", { class: "plain", onclick: () => notice.remove(), "aria-label": "close" }, "✕"),
    );
    area.append(notice);
    while (area.children.length > MOST) area.firstChild.remove();
    if (STAYS_MS[kind]) setTimeout(() => notice.remove(), STAYS_MS[kind]);
  });
}
