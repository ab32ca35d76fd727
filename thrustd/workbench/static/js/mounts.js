// What each mount says, in a flight that is played back and in one that is followed.
import { fill, h, panel, table } from "./dom.js";
import { number } from "./format.js";

const HEADS = ["Deformation", "Thrust share", "One sigma"];
const DIGITS = [
  ["mm", 3],
  ["N", 3],
  ["N", 3],
];

export class MountTable {
  constructor() {
    this.box = h("div.flush");
    this.root = panel("Mounts", [], this.box);
    this.root.hidden = true;
  }

  // said: [[mount, [deformation mm, force N, sigma N]]]
  show(said) {
    this.root.hidden = !said.length;
    const cells = (values) =>
      DIGITS.map(([unit, digits], i) => (Number.isFinite(values[i]) ? `${number(values[i], digits)} ${unit}` : "–"));
    fill(
      this.box,
      table(
        {},
        ["Mount", ...HEADS.map((name) => [name, "num"])],
        said.map(([mount, values]) => [mount.replace("_", " "), ...cells(values)]),
      ),
    );
  }
}
