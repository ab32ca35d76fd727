// The pictures of a comparison and of a diagnosis.
import { band, chart, FONT, line, nearest, rule, span, text } from "./axes.js";
import { css, h } from "./dom.js";
import { number } from "./format.js";

// residual against one channel: mean with the 10 to 90 % band; `focus`: the same for the chosen samples only
export function dependenceChart(d, focus, y, meaning = "") {
  const label = d.channel.replace(/_/g, " ");
  return chart({
    height: 190,
    x: { title: meaning || `${d.channel}${d.unit && d.unit !== "-" ? ` [${d.unit}]` : ""}`, ...span([d.at], 0.03) },
    y: { title: "residual [N]", ...y },
    at: (x) => {
      const i = nearest(d.at, x);
      return `${label} ${number(d.at[i], 4)} ${d.unit}: mean ${number(d.mean[i], 3)} N, 10 to 90 %: ${number(d.low[i], 3)} to ${number(d.high[i], 3)} N`;
    },
    draw(p) {
      band(p, d, "--s2", focus ? 0.1 : 0.2);
      rule(p.ctx, p.left, p.y(0), p.left + p.width, p.y(0), "--ink-3");
      line(p, d.at, d.mean, "--s2", focus ? 1 : 1.8);
      if (focus) {
        band(p, focus, "--s1", 0.25);
        line(p, focus.at, focus.mean, "--s1", 2);
      }
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

export function loopChart(loop, chosen) {
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
        ctx.fillStyle = diverging(loop.residual_n[i] / loop.limit_n);
        ctx.fillRect(p.x(x) - 1, p.y(loop.reference_n[i]) - 1, out ? 1.5 : 2.2, out ? 1.5 : 2.2);
      });
      ctx.globalAlpha = 1;
      ctx.restore();
      legend(p, loop.limit_n);
      ctx.save();
    },
  });
}

function legend(p, limit) {
  const { ctx } = p,
    x = p.left + p.width + 10,
    height = p.height - 34;
  for (let i = 0; i < height; i++) {
    ctx.fillStyle = diverging(1 - (2 * i) / height);
    ctx.fillRect(x, p.top + 16 + i, 10, 1.2);
  }
  ctx.font = FONT;
  text(ctx, "residual", x - 4, p.top + 8, "left");
  [
    [limit, 0],
    [0, 0.5],
    [-limit, 1],
  ].forEach(([v, at]) => text(ctx, number(v, 2) + (at === 0 ? " N" : ""), x + 14, p.top + 20 + at * height, "left"));
}

export function mapChart(map, chosen) {
  const rates = map.rate_edges_n_s.map((r) => Math.max(r, 2)),
    top = Math.max(...map.rms_n.flat().filter((v) => v !== null)),
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
      shown.rms_n.forEach((row, i) =>
        row.forEach((rms, j) => {
          if (rms === null) return;
          ctx.fillStyle = heat(rms / top);
          const x = p.x(shown.force_edges_n[i]),
            y = p.y(Math.max(shown.rate_edges_n_s[j + 1], 2));
          ctx.fillRect(
            x,
            y,
            p.x(shown.force_edges_n[i + 1]) - x + 0.5,
            p.y(Math.max(shown.rate_edges_n_s[j], 2)) - y + 0.5,
          );
        }),
      );
      ctx.restore();
      const x = p.left + p.width + 10,
        height = p.height - 34;
      for (let i = 0; i < height; i++) {
        ctx.fillStyle = heat(1 - i / height);
        ctx.fillRect(x, p.top + 16 + i, 10, 1.2);
      }
      ctx.font = FONT;
      text(ctx, "RMS", x - 4, p.top + 8, "left");
      [
        [top, 0],
        [top / 2, 0.5],
        [0, 1],
      ].forEach(([v, at]) =>
        text(ctx, number(v, 2) + (at === 0 ? " N" : ""), x + 14, p.top + 20 + at * height, "left"),
      );
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

export function spectrumChart(s) {
  const hz = s.frequency_hz;
  return chart({
    height: 220,
    x: { title: "frequency [Hz]", low: hz[0], high: hz.at(-1), log: true },
    y: {
      title: "residual [N/√Hz]",
      low: Math.min(...s.residual_n_rthz) * 0.8,
      high: Math.max(...s.residual_n_rthz) * 1.25,
      log: true,
    },
    at: (x) => {
      const i = nearest(hz, x);
      return `${number(hz[i], 3)} Hz: ${number(s.residual_n_rthz[i], 3)} N/√Hz`;
    },
    draw(p) {
      line(p, hz, s.residual_n_rthz, "--s2", 1.4);
    },
  });
}

const MANY = ["--s1", "--s2", "--s3", "--s4", "--s5", "--s6"];
// the channels most coherent with the residual
export function coherenceChart(s) {
  const most = Object.entries(s.coherence)
    .map(([name, share]) => [name, share, Math.max(...share)])
    .sort((a, b) => b[2] - a[2])
    .slice(0, 5);
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
      most.forEach(([, share], i) => line(p, hz, share, MANY[i], 1.4));
    },
  });
  return h(
    "div",
    {},
    plot,
    h(
      "div",
      { class: "keys" },
      most.map(([name], i) => {
        const mark = h("i");
        mark.style.borderTopColor = `var(${MANY[i]})`;
        return h("span", { class: "key" }, mark, name);
      }),
    ),
  );
}

// what an effect adds to the force in a standard programme
export function signatureChart(s) {
  const top = Math.max(...s.added_n.map(Math.abs), 1e-9);
  return chart({
    height: 200,
    x: { title: "time [s]", low: 0, high: s.time_s.at(-1) },
    y: { title: "added force [N]", low: -1.15 * top, high: 1.15 * top },
    at: (x) => {
      const i = nearest(s.time_s, x);
      return `${number(s.time_s[i], 3)} s: ${number(s.added_n[i], 3)} N at ${number(s.programme_n[i], 3)} N`;
    },
    draw(p) {
      const high = Math.max(...s.programme_n);
      line(
        p,
        s.time_s,
        s.programme_n.map((v) => ((1.9 * v) / high - 0.95) * top),
        "--line-strong",
        1.2,
      );
      rule(p.ctx, p.left, p.y(0), p.left + p.width, p.y(0), "--ink-3");
      line(p, s.time_s, s.added_n, "--s1", 1.8);
    },
  });
}
