// A table of the command line as a page shows it.
import { h, table } from "./dom.js";
import { typeset } from "./format.js";

// the unit stands below the name on a terminal, and behind it here
const titled = (name) => name.replace(/\n(?!per )(.*)$/, " [$1]").replace("\n", " ");

// words begin at the left, numbers end at the right
export function grid({ heads, rows }) {
  const words = (i) => rows.some((row) => /[A-Za-z]{2}/.test(row[i]));
  return h(
    "div.flush",
    table(
      { class: "dense" },
      heads.map((name, i) => [titled(name), i && !words(i) ? "num" : ""]),
      rows.map((row) => row.map(typeset)),
    ),
  );
}
