// Numbers as an engineer writes them: enough digits, a thin space between thousands, the unit behind a space.
const THIN = "\u2009";
const MINUS = "\u2212";

const thousands = (digits) => digits.replace(/\B(?=(\d{3})+$)/g, THIN);

// with a fixed number of decimals
function fixed(value, places) {
  const [whole, part] = Math.abs(value).toFixed(places).split("."),
    zero = !/[1-9]/.test(whole + (part ?? ""));
  return (value < 0 && !zero ? MINUS : "") + (whole.length > 4 ? thousands(whole) : whole) + (part ? "." + part : "");
}

export function number(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size >= 1e5 && Number.isInteger(value)) return (value < 0 ? MINUS : "") + count(size);
  if (size !== 0 && (size < 1e-4 || size >= 1e9))
    return value.toExponential(Math.max(1, digits - 2)).replaceAll("-", MINUS);
  const rounded = size === 0 ? 0 : Number(size.toPrecision(digits)); // 9.9996 has as many decimals as 10
  const places = size === 0 ? 0 : Math.max(0, Math.min(8, digits - 1 - Math.floor(Math.log10(rounded))));
  return fixed(value, places);
}

export const count = (n) => thousands(String(Math.round(n)));
// a force: to a tenth of a newton, from a kilonewton on to a newton
export const newtons = (value) =>
  Number.isFinite(value ?? NaN) ? `${fixed(value, Math.abs(value) >= 1000 ? 0 : 1)} N` : "–";
export const signedNewtons = (value) => (value >= 0.05 ? "+" : "") + newtons(value);
export const signed = (value, digits = 3) => (value > 0 ? "+" : "") + number(value, digits);
export const percent = (share) => (share === null || share === undefined ? "–" : number(100 * share, 2) + " %");
export const withUnit = (value, unit, digits) => number(value, digits) + (unit && unit !== "-" ? " " + unit : "");

export const SIGMAS = 1.96; // 95 %: what ± stands for everywhere

// an estimate with its 95 % interval, both to the second digit of the half width
export function plusMinus(value, std, unit = "") {
  const half = SIGMAS * (std ?? 0),
    size = Math.max(Math.abs(value), half),
    tail = unit && unit !== "-" ? " " + unit : "";
  if (!half) return number(value, 4) + tail;
  const power = size !== 0 && (size < 1e-3 || size >= 1e6) ? Math.floor(Math.log10(size)) : 0;
  const [v, s] = [value / 10 ** power, half / 10 ** power];
  const places = Math.max(0, Math.min(6, 1 - Math.floor(Math.log10(Number(s.toPrecision(2))))));
  const said = `${fixed(v, places)} ± ${fixed(s, places)}`;
  return (power ? `(${said}) · 10${superscript(power)}` : said) + tail;
}
const superscript = (n) => String(n).replace(/./g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]);

// no zeros that say nothing: 5 min, 20 Hz
const trimmed = (value, digits) => fixed(value, (String(Number(value.toPrecision(digits))).split(".")[1] ?? "").length);
export const hertz = (hz) => trimmed(hz, 4) + " Hz";
export function duration(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  if (seconds < 120) return trimmed(seconds, 3) + " s";
  if (seconds < 7200.5) return trimmed(seconds / 60, 3) + " min";
  return trimmed(seconds / 3600, 3) + " h";
}

// seconds on a clock that starts with the record, to the digits that matter
export function seconds(t) {
  const places = Math.abs(t) < 1000 ? 3 : 2;
  return fixed(t, (String(Number(t.toFixed(places))).split(".")[1] ?? "").length) + " s";
}

export function clock(seconds) {
  const s = Math.max(0, seconds),
    two = (x) => String(Math.floor(x)).padStart(2, "0");
  return `${two(s / 3600)}:${two((s / 60) % 60)}:${two(s % 60)}`;
}

export const bytes = (n) =>
  n < 1000
    ? `${n} B`
    : n < 1e6
      ? number(n / 1e3, 3) + " kB"
      : n < 1e9
        ? number(n / 1e6, 3) + " MB"
        : number(n / 1e9, 3) + " GB";

// a tick of an axis with just the digits its step needs
export function plainTick(value, step) {
  if (value === 0) return "0";
  if (Math.abs(value) < 1e-4 || Math.abs(value) >= 1e9) return number(value, 3);
  const quarter = String(+step.toPrecision(3)).replace(/[.0]/g, "").startsWith("25") ? 1 : 0;
  return fixed(value, Math.max(0, Math.min(8, Math.ceil(-Math.log10(Math.abs(step)) - 1e-9) + quarter)));
}

// a sentence of the command line with the signs of print: 12.1 -> 9 N, +- 2, -5 N, 31.4 degC
export const typeset = (line) =>
  line
    .replaceAll("->", "→")
    .replaceAll("+-", "±")
    .replace(/(^|[\s(=,])-(?=[\d.])/g, `$1${MINUS}`)
    .replace(/(\d) degC\b/g, "$1 °C");

// an estimate as tables show it; a spectrum or a curve is said in words
export const toldSize = (p) => (p.said ? typeset(p.said) : plusMinus(p.value, p.std, p.unit));
