// The pictures of a comparison and of a diagnosis.
import { band, chart, FONT, line, nearest, rule, span, text } from "./axes.js";
import { css, h, key } from "./dom.js";
import { newtons, number, withUnit } from "./format.js";

// residual against one channel: mean with the 10 to 90 % band. `layers`: [{d, color}], the last in front
export function dependenceChart(layers, y) {
  const { d } = layers[0],
    front = layers.at(-1).d;
  return chart({
    height: 190,
    x: { title: `${d.channel}${d.unit && d.unit !== "-" ? ` [${d.unit}]` : ""}`, ...span([d.at], 0.03) },
    y: { title: "residual [N]", ...y },
    at: (x) => {
      const i = nearest(front.at, x);
      return `${d.channel} ${withUnit(front.at[i], front.unit, 4)}: mean ${newtons(front.mean[i])}, 10 to 90 %: ${newtons(front.low[i])} to ${newtons(front.high[i])}`;
    },
    draw(p) {
      rule(p.ctx, p.left, p.y(0), p.left + p.width, p.y(0), "--ink-3");
      layers.forEach(({ d: one, color }, i) => {
        const behind = i < layers.length - 1;
        band(p, one, color, behind ? 0.1 : 0.22);
        line(p, one.at, one.mean, color, behind ? 1.2 : 2, behind ? [5, 3] : []);
      });
    },
  });
}

// a free curve of a model: its heights over the channel, with their 95 % band
export function curveChart(curve) {
  return chart({
    height: 200,
    x: { title: curve.channel, ...span([curve.at], 0.03) },
    y: { title: curve.title, ...span([curve.low, curve.high, [0]]) },
    at: (x) => {
      const i = nearest(curve.at, x);
      return `${curve.channel} ${number(curve.at[i], 4)}: ${number(curve.mean[i], 3)}, 95 %: ${number(curve.low[i], 3)} to ${number(curve.high[i], 3)}`;
    },
    draw(p) {
      rule(p.ctx, p.left, p.y(0), p.left + p.width, p.y(0), "--ink-3");
      band(p, curve, "--s1", 0.22);
      line(p, curve.at, curve.mean, "--s1", 2);
      p.ctx.fillStyle = css("--s1");
      for (const [i, x] of curve.at.entries()) p.ctx.fillRect(p.x(x) - 2.5, p.y(curve.mean[i]) - 2.5, 5, 5);
    },
  });
}

// blue below, orange above, grey in between: readable without red and green
export function diverging(share) {
  const from = document.documentElement.dataset.theme === "dark" ? [150, 160, 170] : [176, 184, 192];
  const to = share < 0 ? [0, 114, 220] : [222, 92, 0],
    t = Math.min(1, Math.abs(share));
  return `rgb(${from.map((v, i) => Math.round(v + (to[i] - v) * t)).join(",")})`;
}

export function loopChart(loop, chosen, limit = loop.limit_n) {
  return chart({
    height: 330,
    right: 66,
    x: { title: "deformation [mm], loaded by forward thrust +", ...span(loop.deformation_mm) },
    y: { title: "measured force [N], forward thrust +", ...span(loop.reference_n) },
    draw(p) {
      const { ctx } = p;
      loop.deformation_mm.forEach((x, i) => {
        if (loop.reference_n[i] === null) return;
        const out = chosen !== null && loop.failure[i] !== chosen;
        ctx.globalAlpha = out ? 0.12 : 0.85;
        ctx.fillStyle = diverging(loop.residual_n[i] / limit);
        ctx.fillRect(p.x(x) - 1, p.y(loop.reference_n[i]) - 1, out ? 1.5 : 2.2, out ? 1.5 : 2.2);
      });
      ctx.globalAlpha = 1;
      ctx.restore();
      legend(p, "residual", diverging, [
        [limit, 1],
        [0, 0],
        [-limit, -1],
      ]);
      ctx.save();
    },
  });
}

// a strip of colours beside a picture; `marks`: [value in N, share], the highest first
function legend(p, title, color, marks) {
  const { ctx } = p,
    x = p.left + p.width + 10,
    height = p.height - 34,
    high = marks[0][1],
    low = marks.at(-1)[1];
  for (let i = 0; i < height; i++) {
    ctx.fillStyle = color(high - ((high - low) * i) / height);
    ctx.fillRect(x, p.top + 16 + i, 10, 1.2);
  }
  ctx.font = FONT;
  text(ctx, title, x - 4, p.top + 8, "left");
  marks.forEach(([value, share], i) => {
    const y = p.top + 20 + (height * (high - share)) / (high - low);
    text(ctx, number(value, 2) + (i ? "" : " N"), x + 14, y, "left");
  });
}

// largest error of maps that are to be compared
export const topOf = (maps) => Math.max(...maps.flatMap((map) => map.rms_n.flat()).filter((v) => v !== null));

export function mapChart(map, chosen, top = topOf([map])) {
  const rates = map.rate_edges_n_s.map((r) => Math.max(r, 2)),
    shown = chosen ?? map;
  return chart({
    height: 330,
    right: 66,
    x: { title: "model force [N]", ...span(map.force_edges_n, 0) },
    y: { title: "force rate, absolute [N/s]", low: rates[0], high: rates.at(-1), log: true },
    at: (x, y) => {
      const i = cell(map.force_edges_n, x),
        j = cell(rates, y),
        rms = shown.rms_n[i]?.[j];
      return rms === null || rms === undefined ? "no data here" : `${number(rms, 3)} N RMS`;
    },
    draw(p) {
      const { ctx } = p;
      for (const [i, row] of shown.rms_n.entries())
        for (const [j, rms] of row.entries()) {
          if (rms === null) continue;
          ctx.fillStyle = heat(rms / top);
          const x = p.x(shown.force_edges_n[i]),
            y = p.y(Math.max(shown.rate_edges_n_s[j + 1], 2));
          ctx.fillRect(
            x,
            y,
            p.x(shown.force_edges_n[i + 1]) - x + 0.5,
            p.y(Math.max(shown.rate_edges_n_s[j], 2)) - y + 0.5,
          );
        }
      ctx.restore();
      legend(p, "RMS", heat, [
        [top, 1],
        [top / 2, 0.5],
        [0, 0],
      ]);
      ctx.save();
    },
  });
}

const cell = (edges, v) => edges.findLastIndex((edge) => edge <= v);

function heat(share) {
  const rgb = (name) =>
      css(name)
        .match(/\w\w/g)
        .map((two) => parseInt(two, 16)),
    a = rgb("--heat-0"),
    b = rgb("--heat-1"),
    t = Math.min(1, Math.max(0, share)) ** 0.8;
  return `rgb(${a.map((v, i) => Math.round(v + (b[i] - v) * t)).join(",")})`;
}

// `layers`: [{s, color}], the last in front
export function spectrumChart(layers) {
  const front = layers.at(-1).s,
    hz = front.frequency_hz,
    all = layers.flatMap(({ s }) => s.residual_n_rthz);
  return chart({
    height: 220,
    x: { title: "frequency [Hz]", low: hz[0], high: hz.at(-1), log: true },
    y: { title: "residual [N/√Hz]", low: Math.min(...all) * 0.8, high: Math.max(...all) * 1.25, log: true },
    at: (x) => {
      const i = nearest(hz, x);
      return `${number(hz[i], 3)} Hz: ${number(front.residual_n_rthz[i], 3)} N/√Hz`;
    },
    draw(p) {
      for (const { s, color } of layers) line(p, s.frequency_hz, s.residual_n_rthz, color, 1.4);
    },
  });
}

// five lines told apart by colour and by dash
const MANY = [
  ["--s1", []],
  ["--s2", []],
  ["--s3", [7, 3]],
  ["--s4", [2, 2]],
  ["--s5", [7, 2, 2, 2]],
];
// the channels that go with most of the residual's power, which come first
export function coherenceChart(s) {
  const most = Object.entries(s.coherence).slice(0, 5);
  const hz = s.coherence_hz;
  const plot = chart({
    height: 220,
    x: { title: "frequency [Hz]", low: hz[0], high: hz.at(-1), log: true },
    y: { title: "coherence with the residual [-]", low: 0, high: 1 },
    at: (x) => {
      const i = nearest(hz, x);
      return `${number(hz[i], 3)} Hz: ` + most.map(([name, share]) => `${name} ${number(share[i], 2)}`).join(", ");
    },
    draw(p) {
      for (const [i, [, share]] of most.entries()) line(p, hz, share, MANY[i][0], 1.5, MANY[i][1]);
    },
  });
  return h(
    "div",
    plot,
    h(
      "div.keys",
      most.map(([name], i) =>
        key(MANY[i][0], name, MANY[i][1].length ? (MANY[i][1][0] > 2 ? "dashed" : "dotted") : ""),
      ),
    ),
  );
}
