// The axes of lines over time, alike in histories, playback and live strips.
import { css } from "./dom.js";
import { plainTick } from "./format.js";
import { FAMILY, px, SCALE } from "./scale.js";

const FONT = `${11.5 * SCALE}px ${FAMILY}`;
export const TIME_AXIS_PX = px(46); // ticks, their numbers and the word under them

const ticks = (_u, at, _i, _space, step) => at.map((v) => plainTick(v, step));

function base() {
  const grid = { stroke: () => css("--line"), width: 1 };
  return { stroke: () => css("--ink-2"), font: FONT, grid, ticks: { ...grid, size: 5 } };
}

// `last`: the lowest panel of a sheet carries the numbers, the others only the grid
export function timeAxis(last = true) {
  const axis = base();
  if (!last) return { ...axis, size: 0, space: px(90), ticks: { show: false }, values: (_u, at) => at.map(() => "") };
  return {
    ...axis,
    size: px(26),
    space: px(90),
    values: ticks,
    label: "time [s]",
    labelSize: px(20),
    labelFont: FONT,
    labelGap: 2,
  };
}

// as wide as a value axis, with nothing on it
export const emptyAxis = () => ({ size: px(68), grid: { show: false }, ticks: { show: false }, values: () => [] });

export const valueAxis = () => ({
  ...base(),
  size: px(68),
  space: (_u, _i, _low, _high, height) => Math.min(px(26), height / 4),
  values: ticks,
});
