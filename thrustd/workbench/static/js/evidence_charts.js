// Evidence on the user's own data: the residual, and over it what an effect explains of it.
import { chart, line, nearest, rule, span } from "./axes.js";
import { css, h, key } from "./dom.js";
import { newtons, seconds, typeset, withUnit } from "./format.js";

const PART = "--s2"; // what the effect explains
const GROUPS = ["--s1", "--s3"];

// `evidence`: of one set of effects; `y`: the same axis for all that stand side by side
export function evidencePictures(evidence, y) {
  return h(
    "div",
    h("h3", `${evidence.effects.join(" + ")}: leaves ${newtons(evidence.rmse_n)} on held-back blocks`),
    history(evidence.history, y),
    curves(evidence.view),
    h("div.keys", keys(evidence.view)),
  );
}

export const residualAxis = (all) =>
  span(all.flatMap((one) => [...one.history.low, ...one.history.high]).filter((v) => v !== null));

function history(s, y) {
  return chart({
    height: 170,
    x: { title: "time [s]", ...span([s.time_s], 0) },
    y: { title: "measured − model [N]", ...y },
    at: (x) => {
      const i = nearest(s.time_s, x);
      return `${seconds(s.time_s[i])}: residual ${newtons(s.low[i])} to ${newtons(s.high[i])}, explained ${newtons(s.explained[i])}`;
    },
    draw(p) {
      const { ctx } = p;
      rule(ctx, p.left, p.y(0), p.left + p.width, p.y(0), "--ink-3");
      bars(p, s, "--ink-3", 0.55);
      line(p, s.time_s, s.explained, PART, 1.8);
    },
  });
}

// from lowest to highest, bucket by bucket
function bars(p, s, color, alpha) {
  const { ctx } = p;
  ctx.strokeStyle = css(color);
  ctx.globalAlpha = alpha;
  ctx.lineWidth = Math.max(1, p.width / s.time_s.length);
  ctx.beginPath();
  s.time_s.forEach((t, i) => {
    if (s.low[i] === null) return;
    ctx.moveTo(p.x(t), p.y(s.low[i]));
    ctx.lineTo(p.x(t), Math.min(p.y(s.high[i]), p.y(s.low[i]) - 1));
  });
  ctx.stroke();
  ctx.globalAlpha = 1;
}

// the residual of one model on one recording
export const residualPicture = (one) => beforeAfter(one, one);

// the residual of a model and of its child on the same recording, the child in front
export function beforeAfter(before, after) {
  return h(
    "div",
    h("h3", `${before.recording}: ${newtons(before.rmse_n)}`, after === before ? "" : ` → ${newtons(after.rmse_n)}`),
    chart({
      height: 190,
      x: { title: "time [s]", ...span([before.time_s], 0) },
      y: { title: "measured − model [N]", ...residualAxis([{ history: before }, { history: after }]) },
      at: (x) => {
        const i = nearest(before.time_s, x);
        return `${seconds(before.time_s[i])}: before ${newtons(before.low[i])} to ${newtons(before.high[i])}, after ${newtons(after.low[i])} to ${newtons(after.high[i])}`;
      },
      draw(p) {
        rule(p.ctx, p.left, p.y(0), p.left + p.width, p.y(0), "--ink-3");
        bars(p, before, "--ink-3", 0.5);
        bars(p, after, "--s1", 0.9);
      },
    }),
  );
}

function curves(view) {
  const shown = view.curves.filter((c) => c.at.length > 1);
  if (!shown.length) return null;
  const all = shown.flatMap((c) => [...c.residual_n, ...c.explained_n]);
  return chart({
    height: 200,
    x: {
      title: view.title + (view.unit && view.unit !== "-" && !view.title.endsWith(view.unit) ? ` [${view.unit}]` : ""),
      log: view.log,
      ...(view.log ? range(shown.flatMap((c) => c.at)) : span([shown.flatMap((c) => c.at)], 0.03)),
    },
    y: { title: "mean residual [N]", ...span([all], 0.1) },
    at: (x) =>
      shown
        .map((c) => {
          const i = nearest(c.at, x);
          return `${c.name}, ${withUnit(c.at[i], view.unit, 3)}: residual ${newtons(c.residual_n[i])}, explained ${newtons(c.explained_n[i])}`;
        })
        .join("\n"),
    draw(p) {
      rule(p.ctx, p.left, p.y(0), p.left + p.width, p.y(0), "--ink-3");
      shown.forEach((c, i) => {
        p.ctx.fillStyle = css(GROUPS[i % GROUPS.length]);
        for (const [k, x] of c.at.entries()) p.ctx.fillRect(p.x(x) - 2.5, p.y(c.residual_n[k]) - 2.5, 5, 5);
        line(p, c.at, c.explained_n, PART, 2, i ? [6, 3] : []);
      });
    },
  });
}

const range = (values) => ({ low: Math.min(...values), high: Math.max(...values) });

function keys(view) {
  const many = view.curves.length > 1;
  return [
    key("--ink-3", "residual"),
    ...view.curves.map((c, i) => key(GROUPS[i % GROUPS.length], `mean residual${many ? ", " + c.name : ""}`)),
    key(PART, typeset(`explained by the effect${many ? ` (dashed: ${view.curves.at(-1).name})` : ""}`)),
  ];
}
