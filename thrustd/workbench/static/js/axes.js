// Small exact charts on canvas: axes with ticks, titles with units, a readout under the pointer.
import { css, h } from "./dom.js";
import { plainTick } from "./format.js";
import { FAMILY, SCALE } from "./scale.js";

export const FONT = `11.5px ${FAMILY}`;
const LEFT = 62,
  RIGHT = 12,
  TOP = 10,
  BOTTOM = 40;

// spec: {x: {title, low, high, log}, y: {...}, height, draw(p), at(x, y) -> text}
export function chart(spec) {
  const canvas = h("canvas", { class: "chart", role: "img", "aria-label": `${spec.y.title} against ${spec.x.title}` });
  const paint = () => {
    const width = canvas.clientWidth / SCALE,
      height = spec.height ?? 220,
      scale = devicePixelRatio * SCALE;
    if (!width) return;
    canvas.style.height = height * SCALE + "px";
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
    const ctx = canvas.getContext("2d");
    ctx.scale(scale, scale);
    const p = pane(ctx, spec, width, height);
    axes(p, spec);
    ctx.save();
    ctx.beginPath();
    ctx.rect(p.left, p.top, p.width, p.height);
    ctx.clip();
    spec.draw(p);
    ctx.restore();
    canvas.pane = p;
  };
  new ResizeObserver(paint).observe(canvas);
  if (spec.at) {
    canvas.addEventListener("pointermove", (event) => {
      const p = canvas.pane;
      canvas.title = p ? (spec.at(p.unX(event.offsetX / SCALE), p.unY(event.offsetY / SCALE)) ?? "") : "";
    });
  }
  canvas.repaint = paint;
  return canvas;
}

function pane(ctx, spec, width, height) {
  const right = RIGHT + (spec.right ?? 0);
  const p = { ctx, left: LEFT, top: TOP, width: width - LEFT - right, height: height - TOP - BOTTOM, total: width };
  const map = (axis, from, span) => {
    const f = axis.log ? Math.log10 : (v) => v,
      a = f(axis.low),
      b = f(axis.high);
    return [
      (v) => from + (span * (f(v) - a)) / (b - a),
      (px) => {
        const v = a + ((px - from) / span) * (b - a);
        return axis.log ? 10 ** v : v;
      },
    ];
  };
  [p.x, p.unX] = map(spec.x, p.left, p.width);
  [p.y, p.unY] = map(spec.y, p.top + p.height, -p.height);
  return p;
}

function axes(p, spec) {
  const { ctx } = p;
  ctx.font = FONT;
  ctx.lineWidth = 1;
  const xs = ticks(spec.x, Math.max(2, p.width / 80)),
    ys = ticks(spec.y, Math.max(2, p.height / 36));
  for (const tick of xs) {
    const x = Math.round(p.x(tick)) + 0.5;
    rule(ctx, x, p.top, x, p.top + p.height);
    const label = tickLabel(tick, xs, spec.x),
      half = ctx.measureText(label).width / 2 + 1;
    text(ctx, label, Math.min(Math.max(x, half), p.total - half), p.top + p.height + 14, "center");
  }
  for (const tick of ys) {
    const y = Math.round(p.y(tick)) + 0.5;
    rule(ctx, p.left, y, p.left + p.width, y);
    text(ctx, tickLabel(tick, ys, spec.y), p.left - 6, y + 4, "right");
  }
  text(ctx, spec.x.title, p.left + p.width / 2, p.top + p.height + 31, "center", "--ink-2");
  ctx.save();
  ctx.translate(11, p.top + p.height / 2);
  ctx.rotate(-Math.PI / 2);
  text(ctx, spec.y.title, 0, 0, "center", "--ink-2");
  ctx.restore();
}

export function rule(ctx, x1, y1, x2, y2, color = "--line") {
  ctx.strokeStyle = css(color);
  ctx.beginPath();
  ctx.moveTo(x1, y1);
  ctx.lineTo(x2, y2);
  ctx.stroke();
}

export function text(ctx, said, x, y, align, color = "--ink-2") {
  ctx.fillStyle = css(color);
  ctx.textAlign = align;
  ctx.fillText(said, x, y);
}

export function ticks({ low, high, log }, most) {
  if (log) {
    const found = [],
      every = Math.ceil((Math.log10(high) - Math.log10(low)) / most);
    for (let e = Math.ceil(Math.log10(low) - 1e-9); e <= Math.log10(high) + 1e-9; e += every) found.push(10 ** e);
    return found;
  }
  const rough = (high - low) / most,
    size = 10 ** Math.floor(Math.log10(rough));
  const sizes = [0.5, 1, 2, 2.5, 5, 10],
    wide = sizes.findIndex((s) => s * size >= rough),
    few = Math.floor(high / (sizes[wide] * size)) - Math.ceil(low / (sizes[wide] * size)) < 2, // one or two say no scale
    step = size * sizes[wide - (few ? 1 : 0)],
    found = [];
  for (let v = Math.ceil(low / step) * step; v <= high + 1e-9 * step; v += step)
    found.push(Math.abs(v) < step / 1e6 ? 0 : v);
  return found;
}

const tickLabel = (tick, all, { log }) =>
  log ? plainTick(tick, Math.abs(tick) || 1) : plainTick(tick, all.length > 1 ? all[1] - all[0] : 1);

export const span = (values, room = 0.05) => {
  const good = values.flat().filter((v) => Number.isFinite(v));
  const low = Math.min(...good),
    high = Math.max(...good),
    extra = (high - low || Math.abs(high) || 1) * room;
  return { low: low - extra, high: high + extra };
};

export const line = (p, xs, ys, color, width = 1.4, dash = []) => {
  const { ctx } = p;
  ctx.strokeStyle = css(color);
  ctx.lineWidth = width;
  ctx.setLineDash(dash);
  ctx.beginPath();
  let pen = false;
  xs.forEach((x, i) => {
    if (ys[i] === null) {
      pen = false;
      return;
    }
    if (pen) ctx.lineTo(p.x(x), p.y(ys[i]));
    else ctx.moveTo(p.x(x), p.y(ys[i]));
    pen = true;
  });
  ctx.stroke();
  ctx.setLineDash([]);
};

export function band(p, d, color, alpha) {
  const { ctx } = p;
  ctx.globalAlpha = alpha;
  ctx.fillStyle = css(color);
  ctx.beginPath();
  for (const [i, x] of d.at.entries()) ctx.lineTo(p.x(x), p.y(d.high[i]));
  for (let i = d.at.length - 1; i >= 0; i--) ctx.lineTo(p.x(d.at[i]), p.y(d.low[i]));
  ctx.fill();
  ctx.globalAlpha = 1;
}

export const nearest = (values, x) =>
  values.reduce((best, v, i) => (Math.abs(v - x) < Math.abs(values[best] - x) ? i : best), 0);
