// Which panels a time history shows: force with band, residual, then the channels.

import { thrustPanel } from "./engine.js";

const THRUST = "estimate_thrust_n_";
const COLORS = ["--s1", "--s2", "--s3", "--s4", "--s5", "--s6"];
const EDGE = { color: "--ink-3", width: 1 }; // of a band, in front of a residual that fills it
export const FIRST = ["deformation_mm", "accel_x_g", "temperature_degC"]; // shown when nothing else was chosen

// the model whose band is drawn
export const bandedOf = (card, has) => has.find((m) => card.models[m].includes("band_low"));

// a model without its folder and ending, unless another one is called alike
function shortest(name, among) {
  const file = (one) => one.split("/").pop();
  const alone = among.filter((one) => file(one) === file(name)).length === 1;
  return (alone ? file(name) : name).replace(/\.json$/, "");
}

// `has`: models run on this recording; `wanted`: channels chosen, null for the usual ones
export function panelsOf(card, has, wanted) {
  const channels = new Map(card.meta.channels.map((c) => [c.name, c])),
    panels = [];
  const force = channels.has("force_N")
    ? [{ channel: "force_N", label: "measured", color: "--measured", width: 1.1 }]
    : [];
  const label = (m) => shortest(m, has);
  const runs = has.map((m, i) => ({
    channel: `model@${m}`,
    label: label(m),
    color: COLORS[i % COLORS.length],
    width: 1.3,
  }));
  const banded = bandedOf(card, has);
  const edges = banded
    ? ["band_high", "band_low"].map((edge) => ({ channel: `${edge}@${banded}`, unseen: true, silent: true }))
    : [];
  if (force.length || runs.length)
    panels.push({
      title: "force [N], forward thrust +",
      unit: "N",
      series: [...edges, ...force, ...runs],
      bands: banded ? [[1, 2]] : [],
      band: banded ? `95 % band of ${label(banded)}` : "",
      height: 220,
    });
  if (force.length && runs.length) panels.push(residualPanel(has, label, banded));
  if (!panels.length) panels.push(...thrusts(new Set(channels.keys())));
  const chosen = (wanted ?? FIRST).filter((c) => channels.has(c));
  chosen.forEach((c, i) => {
    const meta = channels.get(c);
    panels.push({
      title: withUnitOf(`${c}${meta.meaning ? ": " + meta.meaning : ""}`, meta.unit),
      unit: meta.unit === "-" ? "" : meta.unit,
      series: [{ channel: c, label: c, color: COLORS[(i + 2) % COLORS.length] }],
      height: 112,
    });
  });
  if (!panels.length) {
    const c = card.meta.channels[0];
    panels.push({
      title: withUnitOf(c.name, c.unit),
      unit: c.unit === "-" ? "" : c.unit,
      series: [{ channel: c.name, label: c.name, color: "--s1" }],
      height: 220,
    });
  }
  return panels;
}

// what stands first where there is no force: the thrust of every engine in its band, as the flight screens draw it
const thrusts = (channels) =>
  [...channels].filter((c) => c.startsWith(THRUST)).map((c) => thrustPanel(c.slice(THRUST.length), channels, 170));

const withUnitOf = (title, unit) => (unit && unit !== "-" ? `${title} [${unit}]` : title);

// measured - model of every model, over the band of one: model - model +- half its width
function residualPanel(has, label, banded) {
  const series = has.map((m, i) => ({ channel: `residual@${m}`, label: label(m), color: COLORS[i % COLORS.length] })),
    edges = banded ? ["band_high", "band_low", "model"] : [];
  const less = (ones, others) => ones.map((v, i) => (v === null || others[i] === null ? null : v - others[i]));
  return {
    title: "measured − model [N]",
    unit: "N",
    series: [...series, ...edges.map((edge) => ({ channel: `${edge}@${banded}`, unseen: true, silent: true }))],
    drawn: banded ? [...series, { label: "high", ...EDGE }, { label: "low", ...EDGE }] : series,
    transform: banded
      ? ([x, ...columns]) => {
          const [high, low, middle] = columns.slice(series.length);
          return [x, ...columns.slice(0, series.length), less(high, middle), less(low, middle)];
        }
      : null,
    bands: banded ? [[series.length + 1, series.length + 2]] : [],
    band: banded ? `95 % band of ${label(banded)}` : "",
    height: 150,
  };
}
