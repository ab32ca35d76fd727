// Numbers as an engineer writes them: enough digits, a thin space between thousands, the unit behind a space.
const THIN = "\u2009";
const MINUS = "\u2212";

export function number(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size >= 1e5 && Number.isInteger(value)) return (value < 0 ? MINUS : "") + count(size);
  if (size !== 0 && (size < 1e-4 || size >= 1e9))
    return value.toExponential(Math.max(1, digits - 2)).replaceAll("-", MINUS);
  const places = size === 0 ? 0 : Math.max(0, Math.min(8, digits - 1 - Math.floor(Math.log10(size))));
  const [whole, part] = size.toFixed(places).split(".");
  const grouped = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, THIN) : whole;
  return (value < 0 ? MINUS : "") + grouped + (part ? "." + part : "");
}

export const count = (n) => String(Math.round(n)).replace(/\B(?=(\d{3})+$)/g, THIN);
export const newtons = (value) =>
  value === null || value === undefined ? "–" : number(value, Math.abs(value) >= 1000 ? 5 : 3) + " N";
export const signed = (value, digits = 3) => (value > 0 ? "+" : "") + number(value, digits);
export const percent = (share) => (share === null || share === undefined ? "–" : number(100 * share, 2) + " %");
export const withUnit = (value, unit, digits) => number(value, digits) + (unit && unit !== "-" ? " " + unit : "");

export function duration(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  if (seconds < 120) return number(seconds, 3) + " s";
  if (seconds < 7200) return number(seconds / 60, 3) + " min";
  return number(seconds / 3600, 3) + " h";
}

// seconds on a clock that starts with the record, to the digits that matter
export const seconds = (t) => `${Number(t.toFixed(t < 1000 ? 3 : 2))} s`;

export function clock(seconds) {
  const s = Math.max(0, seconds),
    two = (x) => String(Math.floor(x)).padStart(2, "0");
  return `${two(s / 3600)}:${two((s / 60) % 60)}:${two(s % 60)}`;
}

export const bytes = (n) =>
  n < 1e6 ? number(n / 1e3, 3) + " kB" : n < 1e9 ? number(n / 1e6, 3) + " MB" : number(n / 1e9, 3) + " GB";
// a tick of an axis with just the digits its step needs
export function plainTick(value, step) {
  if (value === 0) return "0";
  if (Math.abs(value) < 1e-4 || Math.abs(value) >= 1e9) return number(value, 3);
  const places = Math.max(
    0,
    Math.min(
      8,
      Math.ceil(-Math.log10(Math.abs(step)) - 1e-9) +
        (String(+step.toPrecision(3)).replace(/[.0]/g, "").startsWith("25") ? 1 : 0),
    ),
  );
  const [whole, part] = Math.abs(value).toFixed(places).split(".");
  return (
    (value < 0 ? MINUS : "") +
    (whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, THIN) : whole) +
    (part ? "." + part : "")
  );
}
