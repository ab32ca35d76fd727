// The range of values that a panel shows, and of time that a key moves it to.
import { number, seconds } from "./format.js";

export function padded(low, high) {
  if (low === null || high === null || !Number.isFinite(low)) return [0, 1];
  if (low === high) {
    const room = Math.abs(low) * 0.05 || 1;
    return [low - room, high + room];
  }
  const room = 0.06 * (high - low);
  return [low - room, high + room];
}

// lowest and highest of a share of what is in sight, the middle: one spike does not set the scale of an error
export function scaleOf(u, { share = 1 }, [start, stop]) {
  if (share === 1) return null;
  const [time, ...lines] = u.data;
  const seen = lines.flatMap((values) =>
    Array.from(values).filter((v, i) => Number.isFinite(v ?? NaN) && time[i] >= start && time[i] <= stop),
  );
  if (!seen.length) return null;
  const sorted = Float64Array.from(seen).sort(),
    out = Math.floor(((1 - share) / 2) * sorted.length);
  return [sorted[out], sorted[sorted.length - 1 - out]];
}

// where a line goes furthest beyond what is drawn, in words; "" where nowhere
export function beyond([time, ...lines], [low, high], unit) {
  const values = lines.at(-1);
  let at = -1;
  for (let i = 0; i < time.length; i++)
    if (values[i] !== null && (values[i] < low || values[i] > high) && !(Math.abs(values[i]) <= Math.abs(values[at])))
      at = i;
  return at < 0 ? "" : `; beyond the scale: ${number(values[at], 3)} ${unit} at ${seconds(time[at])}`;
}

// the window that a key asks for; nothing for other keys
export function moved(key, [a, b], limits) {
  const step = (b - a) / 4;
  return {
    ArrowLeft: [a - step, b - step],
    ArrowRight: [a + step, b + step],
    "+": [a + step, b - step],
    "=": [a + step, b - step],
    "-": [a - 2 * step, b + 2 * step],
    0: [...limits],
    Home: [limits[0], limits[0] + b - a],
    End: [limits[1] - (b - a), limits[1]],
  }[key];
}
