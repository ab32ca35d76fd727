// The axes of lines over time, alike in histories, playback and live strips.
import { css } from "./dom.js";
import { plainTick } from "./format.js";

const FONT = "11.5px Inter, 'Segoe UI', system-ui, 'DejaVu Sans', sans-serif";
export const TIME_AXIS_PX = 46; // ticks, their numbers and the word under them

const ticks = (u, at, i, space, step) => at.map((v) => plainTick(v, step));

function base() {
  const grid = { stroke: () => css("--line"), width: 1 };
  return { stroke: () => css("--ink-2"), font: FONT, grid, ticks: { ...grid, size: 5 } };
}

// `last`: the lowest panel of a sheet carries the numbers, the others only the grid
export function timeAxis(last = true) {
  const axis = base();
  if (!last) return { ...axis, size: 0, space: 90, ticks: { show: false }, values: (u, at) => at.map(() => "") };
  return { ...axis, size: 26, space: 90, values: ticks, label: "time [s]", labelSize: 20, labelFont: FONT, labelGap: 2 };
}

export const valueAxis = () => ({ ...base(), size: 68, space: 26, values: ticks });
