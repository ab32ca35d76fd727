// Windows of channels, as the server packs them (see thrustd/workbench/lines.py).
import { getBytes, query } from "./api.js";

export async function fetchWindow(recording, channels, from, to, buckets, signal) {
  const buffer = await getBytes(
    "api/lines?" + query({ recording, channel: channels, from, to, buckets: Math.round(buckets) }),
    signal,
  );
  return decode(buffer);
}

function decode(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  const time = new Float64Array(buffer, at, head.count);
  at += 8 * head.count;
  const series = head.channels.map(() => {
    const low = new Float32Array(buffer, at, head.count);
    at += 4 * head.count;
    if (head.raw) return { low, high: low };
    const high = new Float32Array(buffer, at, head.count);
    at += 4 * head.count;
    return { low, high };
  });
  return { ...head, time, series };
}

// uPlot's columns: each bucket is drawn from its lowest to its highest, a null breaks the line at a gap
export function toColumns(window) {
  const { time, series, raw, breaks } = window,
    gaps = new Set(breaks),
    per = raw ? 1 : 2;
  const size = time.length * per + gaps.size,
    x = new Float64Array(size),
    ys = series.map(() => new Array(size));
  let at = 0;
  for (let i = 0; i < time.length; i++) {
    for (let j = 0; j < per; j++, at++) {
      x[at] = time[i];
      series.forEach((s, k) => {
        const v = j ? s.high[i] : s.low[i];
        ys[k][at] = Number.isNaN(v) ? null : v;
      });
    }
    if (gaps.has(i)) {
      x[at] = time[i];
      ys.forEach((y) => {
        y[at] = null;
      });
      at++;
    }
  }
  return [x, ...ys];
}

// a series of another window on these times, shifted: x as `toColumns` gives it, lowest and highest in turn
export function onTimes(window, index, x, shift_s, per) {
  return Array.from(x, (t, i) => {
    const hit = valueAt(window, index, t - shift_s);
    if (hit === null) return null;
    const v = per === 2 && i % 2 ? hit[1] : hit[0];
    return Number.isNaN(v) ? null : v;
  });
}

// value (or lowest and highest) at a time
export function valueAt(window, index, t) {
  const { time, series } = window;
  if (!time.length || t < time[0] || t > window.end_s) return null;
  let low = 0,
    high = time.length - 1;
  while (low < high) {
    const mid = (low + high + 1) >> 1;
    if (time[mid] <= t) low = mid;
    else high = mid - 1;
  }
  if (window.raw && low + 1 < time.length && t - time[low] > time[low + 1] - t) low += 1;
  return [series[index].low[low], series[index].high[low], time[low]];
}
