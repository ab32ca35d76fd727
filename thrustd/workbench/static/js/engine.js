// One engine: fused thrust with its band, both sources, what the estimator says of its sensors.
import { h } from "./dom.js";
import { newtons, SIGMAS, signed, signedNewtons } from "./format.js";
import { store } from "./store.js";

const GRAVE = [
  "MOUNT_LOST",
  "BROCHURE_LOST",
  "MOUNT_FAILED",
  "BROCHURE_FAILED",
  "STUCK",
  "OUT_OF_RANGE",
  "MOUNTS_DISAGREE",
];
const UNSETTLED_N = 2000; // one sigma before the first measurement: a band that wide says nothing
export const SOURCES = [
  ["mount_n", "mount source", "--s2", 1],
  ["brochure_n", "brochure source", "--s3", 1],
];
export const FUSED = ["thrust_n", "fused", "--s1", 1.8];
export const settledAt = (std_n) => std_n !== null && std_n < UNSETTLED_N;
const words = (name) => name.toLowerCase().replaceAll("_", " ");

export class EngineTile {
  constructor(name) {
    this.thrust = h("b", "–");
    this.band = h("span.quiet");
    this.sources = ["fused", "mount source", "brochure source"].map((title) => ({
      title,
      value: h("b", "–"),
      more: h("span"),
    }));
    this.lamps = h("div", { class: "lamps", role: "status" });
    this.root = h(
      "section.panel.engine",
      h("header", h("h2", `${name} engine`), this.band),
      h("div.body.big", this.thrust, h("span.quiet", "N net thrust, forward +")),
      h(
        "div.sources",
        this.sources.map((r) => h("div", h("span", r.title), r.value, r.more)),
      ),
      this.lamps,
    );
  }

  // e: fields of types.Estimate; since: status bits that have been on since the log began, no alarm as yet; in a log that is
  // followed, whose beginning nobody has seen, every bit is one
  show(e, since = 0) {
    const settled = settledAt(e.thrust_std_n),
      half = (std) => `± ${newtons(SIGMAS * std)} (95 %)`;
    this.thrust.textContent = settled ? newtons(e.thrust_n).replace(" N", "") : "–";
    this.band.textContent = settled
      ? `95 %: ${newtons(edge(-1, e.thrust_n, e.thrust_std_n)).replace(" N", "")} to ${newtons(edge(1, e.thrust_n, e.thrust_std_n))}`
      : "no measurement yet";
    const source = (value, std, bias) =>
      Number.isFinite(value ?? NaN)
        ? [newtons(value), `${half(std)}\nlearnt bias ${bias}`]
        : ["no measurement", `learnt bias ${bias}`];
    const said = [
      [settled ? half(e.thrust_std_n) : "–", `rate ${signedNewtons(e.thrust_rate_n_s)}/s`],
      source(e.mount_n, e.mount_std_n, signedNewtons(e.mount_bias_n)),
      source(e.brochure_n, e.brochure_std_n, `${signed(100 * e.brochure_bias, 2)} %`),
    ];
    this.sources.forEach((r, i) => {
      [r.value.textContent, r.more.textContent] = said[i];
    });
    const shown = settled ? `${e.status} ${since}` : "";
    if (shown === this.shown) return;
    this.shown = shown;
    this.lamps.replaceChildren(...(settled ? lamps(e.status, since) : [h("span.lamp", "no estimate yet")]));
  }
}

function lamps(status, since) {
  const on = Object.entries(store.server.status_words).filter(([bit]) => (status & bit) !== 0);
  if (!on.length) return [h("span.lamp.ok", "both sources healthy, inside the valid range")];
  return on.map(([bit, name]) =>
    since & bit
      ? h("span.lamp", `${words(name)} since the log began`)
      : h("span", { class: `lamp ${GRAVE.includes(name) ? "fail" : "on"}` }, words(name)),
  );
}

export const FIELDS = [
  "thrust_n",
  "thrust_std_n",
  "thrust_rate_n_s",
  "mount_n",
  "mount_std_n",
  "brochure_n",
  "brochure_std_n",
  "mount_bias_n",
  "brochure_bias",
  "status",
];

// an edge of the band; null where there is none
export const edge = (sign, thrust_n, std_n) =>
  thrust_n === null || std_n === null || std_n > UNSETTLED_N ? null : thrust_n + sign * SIGMAS * std_n;

// the strip under it, where the truth is known: fused - truth, over the band
export function errorPanel(engine, channels, height) {
  const error = `fused_minus_truth_${engine}_N`;
  if (!channels.has(error)) return null;
  const line = { channel: error, label: "fused − truth", color: "--s1", width: 1.2 };
  return {
    title: `${engine} engine: fused − truth [N]`,
    unit: "N",
    height,
    series: [line, { channel: `estimate_thrust_std_n_${engine}`, unseen: true, silent: true }],
    drawn: [{ label: "high" }, { label: "low" }, line],
    transform: ([x, off, std]) => [x, ...[1, -1].map((sign) => std.map((v) => edge(sign, 0, v))), off],
    bands: [[1, 2]],
    band: "95 %",
    share: 0.98,
  };
}

// fused thrust of two flights over the time of the first; the second is `second.shift()` seconds later
export function twoFlightsPanel(engine, second, height) {
  const of = (label, color) => ({ channel: `estimate_thrust_n_${engine}`, label, color, width: 1.4 }),
    ours = of("this flight", FUSED[2]),
    theirs = of(second.recording, "--s2");
  return {
    title: `${engine} engine: fused net thrust [N], forward +`,
    unit: "N",
    height,
    series: [ours],
    drawn: [ours, theirs],
    second: { ...second, channels: [theirs.channel] },
    band: "",
  };
}

// the panel of a sheet: fused thrust with its 95 % band, both sources, and the truth where a simulated flight has one
export function thrustPanel(engine, channels, height) {
  const one = ([field, label, color, width]) => ({ channel: `estimate_${field}_${engine}`, label, color, width });
  const fused = one(FUSED),
    lines = SOURCES.map(one);
  const truth = [`thrust_N_${engine}`, `truth_thrust_n_${engine}`].find((c) => channels.has(c));
  if (truth) lines.push({ channel: truth, label: "truth", color: "--measured", width: 1 });
  const side = (sign, thrust, std) => thrust.map((v, i) => edge(sign, v, std[i]));
  const transform = ([x, thrust, std, ...rest]) => [x, side(1, thrust, std), side(-1, thrust, std), ...rest, thrust];
  return {
    title: `${engine} engine: net thrust [N], forward +; band 95 %`,
    unit: "N",
    height,
    series: [fused, { ...one(["thrust_std_n", "one sigma", "--line-strong"]), unseen: true }, ...lines],
    drawn: [{ label: "high" }, { label: "low" }, ...lines, fused], // the fused line in front
    transform,
    bands: [[1, 2]],
  };
}
