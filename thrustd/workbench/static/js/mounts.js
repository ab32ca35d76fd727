// What each mount says, in a flight that is played back and in one that is followed.
import { fill, h, panel } from "./dom.js";
import { number } from "./format.js";

const HEADS = ["Deformation", "Thrust share", "One sigma"];
const DIGITS = [
  ["mm", 5],
  ["N", 4],
  ["N", 3],
];

export class MountTable {
  constructor() {
    this.rows = h("tbody", {});
    const heads = HEADS.map((name) => h("th", { class: "num" }, name));
    const table = h("table", {}, h("thead", {}, h("tr", {}, h("th", {}, "Mount"), heads)), this.rows);
    this.root = panel("Mounts", [], h("div", { class: "flush" }, table));
    this.root.hidden = true;
  }

  // said: [[mount, [deformation mm, force N, sigma N]]]
  show(said) {
    this.root.hidden = !said.length;
    const cells = (values) =>
      DIGITS.map(([unit, digits], i) =>
        h("td", { class: "num" }, Number.isFinite(values[i]) ? `${number(values[i], digits)} ${unit}` : "–"),
      );
    fill(
      this.rows,
      said.map(([mount, values]) => h("tr", {}, h("td", {}, mount.replace("_", " ")), cells(values))),
    );
  }
}
