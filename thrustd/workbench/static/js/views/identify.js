// Identify: a first model from the bench record, and what was found: errors, fit, static curve, time constants, loop.

import { chart, line, nearest, rule, span } from "../axes.js";
import { css, described, fill, h, key, panel } from "../dom.js";
import { residualPicture } from "../evidence_charts.js";
import { duration, newtons, number, percent, typeset, withUnit } from "../format.js";
import { identifyNow } from "../steps.js";
import { attempt, session, store } from "../store.js";
import { answerView } from "./answer.js";

export function identify(root) {
  return answerView(root, {
    kind: "fit",
    title: "Identify",
    words:
      "A first model of the mount from a bench record. A fifth of it is held back to judge the fit; the final model then uses all of it.",
    label: "Identify a model",
    ask: identifyNow,
    find: () => found()?.result,
    about: () => session().bench[0],
    can: ({ bench }) => bench.length,
    wants: "a bench recording",
    never: ({ bench, model }) =>
      `${model ? `${model} was not identified here.` : "No model yet."} Bench record: ${bench[0]}.`,
    show: (a, head) =>
      fill(
        root,
        head,
        numbers(a),
        a.warnings.length
          ? described(
              "What to know",
              "",
              a.warnings.map((w) => h("p.advice", typeset(w))),
            )
          : null,
        h("div.columns", staticCurve(a), relaxation(a)),
        h("div.columns", ...a.loops.slice(0, 1).map((l) => loop(l)), residuals(a)),
        a.effects.length ? frictions(a) : null,
      ),
  });
}

// the identification of the chosen model or, of a child, of the one it grew from
function found() {
  const done = store.server.jobs.filter((one) => one.kind === "fit" && one.state === "done" && one.result.report);
  const { model, bench } = session();
  return (
    done.find((one) => one.result.model === model) ??
    done.find((one) => String(one.arguments.recordings) === String(bench))
  );
}

const numbers = (a) =>
  panel(
    `${a.model} from ${a.recordings.join(", ")}`,
    [h("span.push.buttons", h("button", { onclick: attempt(identifyNow) }, "Identify again"))],
    h(
      "div.figures",
      [
        [newtons(a.train_n), "RMSE, four parts in five"],
        [newtons(a.validation_n), "RMSE, a fifth of the record, not fitted to"],
        [`${number(a.fit_pct, 4)} %`, "fit there"],
        [newtons(a.rmse_n), "RMSE, whole record"],
        [`${number(a.force_n[0], 3)} to ${number(a.force_n[1], 4)} N`, "identified over"],
        [String(a.parameters), "numbers estimated"],
      ].map(([value, name]) => h("div.figure", h("b", value), h("span", name))),
    ),
  );

function staticCurve({ static: s }) {
  return described(
    "Static curve",
    "force at rest, long after any movement",
    chart({
      height: 240,
      x: { title: "deformation [mm], loaded by forward thrust +", ...span([s.deformation_mm], 0.02) },
      y: { title: "force [N], forward thrust +", ...span([s.force_n]) },
      at: (x) => {
        const i = nearest(s.deformation_mm, x);
        return `${withUnit(s.deformation_mm[i], "mm", 4)}: ${newtons(s.force_n[i])}, ${number(s.stiffness_n_mm[i], 4)} N/mm`;
      },
      draw: (p) => line(p, s.deformation_mm, s.force_n, "--s1", 2),
    }),
    h(
      "p.quiet",
      `Stiffness ${number(Math.min(...s.stiffness_n_mm), 3)} to ${number(Math.max(...s.stiffness_n_mm), 3)} N/mm.`,
    ),
  );
}

function relaxation({ relaxation: r }) {
  const worth = r.modes.filter((m) => Math.abs(m.share) >= 0.001);
  return described(
    "Relaxation",
    "force after a step that is held, over the force at rest",
    chart({
      height: 240,
      x: { title: "time since the step [s]", low: r.time_s[0], high: r.time_s.at(-1), log: true },
      y: { title: "ratio to the force at rest [-]", ...span([[...r.share, 1]], 0.1) },
      at: (x) => {
        const i = nearest(r.time_s, x);
        return `${duration(r.time_s[i])}: ${number(r.share[i], 4)}`;
      },
      draw(p) {
        rule(p.ctx, p.left, p.y(1), p.left + p.width, p.y(1), "--ink-3");
        line(p, r.time_s, r.share, "--s1", 2);
      },
    }),
    h(
      "p.quiet",
      worth.length
        ? `Relaxes by ${worth.map((m) => `${percent(Math.abs(m.share))} (${duration(m.tau_s)})`).join(", ")}: shares, and their time constants.`
        : "No time constant carries a tenth of a percent of the force.",
    ),
  );
}

function loop(l) {
  return described(
    "Loop",
    ["force beyond the static curve ", key("--measured", "measured"), " ", key("--s1", "model")],
    chart({
      height: 300,
      x: { title: "deformation [mm]", ...span([l.deformation_mm]) },
      y: { title: "force − static curve [N]", ...span([[...l.measured_n, ...l.model_n].filter((v) => v !== null)]) },
      draw(p) {
        for (const [values, color, size] of [
          [l.measured_n, "--measured", 2.4],
          [l.model_n, "--s1", 1.4],
        ]) {
          p.ctx.fillStyle = css(color);
          for (const [i, v] of values.entries())
            if (v !== null) p.ctx.fillRect(p.x(l.deformation_mm[i]) - size / 2, p.y(v) - size / 2, size, size);
        }
      },
    }),
  );
}

const residuals = (a) =>
  described(
    "Residual on the bench record",
    "",
    a.histories.map((one) => residualPicture(one)),
  );

const frictions = (a) =>
  described(
    "Already in the model",
    "",
    a.effects.map((e) =>
      h(
        "p",
        h("b", e.name),
        ` ${e.title}: `,
        Object.entries(e.parameters)
          .map(([name, value]) => `${name} ${typeof value === "string" ? typeset(value) : number(value, 3)}`)
          .join(", "),
      ),
    ),
  );
