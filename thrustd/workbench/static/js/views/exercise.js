// The hidden-effect exercise: what it is, and once its answer is open, what was found beside what is true.
import { h, table } from "../dom.js";
import { newtons, number, plusMinus, signed } from "../format.js";
import { stepOf } from "../ledger.js";
import { effectOf, revealed } from "../sealed.js";
import { exerciseNow, revealNow } from "../steps.js";
import { attempt, model, running, session } from "../store.js";

export function exercisePanel() {
  const { exercise } = session(),
    truth = exercise ? revealed() : null;
  const text = exercise
    ? [
        h("b", exercise),
        `: the twin hid an effect in measured.csv and heldout.csv; bench.csv is without it. The answer is ${truth ? "open" : "sealed"}.`,
      ]
    : [
        "A simulated mount, the twin, makes a bench record, and a measured and a check record in which one effect is hidden. Find it with this page.",
      ];
  return h(
    "section.panel",
    h(
      "header",
      h("h2", "Hidden-effect exercise"),
      h(
        "span.push.buttons",
        exercise && !truth ? h("button", { onclick: attempt(revealNow) }, "Open the sealed answer") : null,
        h(
          "button",
          { disabled: Boolean(running("exercise")), onclick: attempt(() => exerciseNow(3)) },
          exercise ? "Make another" : "Make an exercise",
        ),
      ),
    ),
    h("div.body", h("p.quiet", text)),
    truth ? h("div.flush", foundAndTrue(truth, model(session().model))) : null,
  );
}

// one row per true parameter, then what the model holds that nobody hid
function foundAndTrue(truth, card) {
  const hidden = truth.effects.map((one) => one.effect),
    held = new Map((card?.effects ?? []).map((one) => [effectOf(one.name, hidden), one]));
  const rows = truth.effects.flatMap((one) =>
    one.parameters.map((p, i) => [
      i ? "" : h("b", one.effect),
      i ? "" : found(held.has(one.effect)),
      p.name,
      number(p.value, 4),
      ...estimate(held.get(one.effect), p, card && sigmaOf(card.name, one.effect, p.name)),
      i ? "" : newtons(one.force_rms_n),
    ]),
  );
  for (const one of held.values())
    if (!hidden.includes(effectOf(one.name, hidden)))
      rows.push([h("b", one.name), h("td", { class: "warn", colspan: "6" }, "in the model, but not hidden")]);
  const heads = [
    "Hidden effect",
    "In the model",
    "Parameter",
    ["True", "num"],
    [`Found in ${card?.name ?? "no model"}`, "num"],
    ["Found − true", "num"],
    ["Its force, RMS", "num"],
  ];
  return table({ class: "truth" }, heads, rows);
}

// of a parameter, as the step that added its effect has told it: with what other fits and the transducer leave open
function sigmaOf(model, effect, name) {
  for (let step = stepOf(model); step; step = stepOf(step.parent)) {
    const told = step.estimates.find((p) => p.effect === effect && p.name === name);
    if (told) return told.std;
  }
  return undefined;
}

const found = (yes) => (yes ? h("span.good", "✓ found") : h("span.warn", "not found"));

// [found, difference] as cells; a parameter that the library does not estimate has none
function estimate(effect, { name, value }, sigma) {
  const mine = effect?.parameters[name],
    std = sigma ?? effect?.std[name];
  if (mine === undefined) return [h("span.faint", effect ? "not estimated" : "–"), ""];
  const off = value ? `${signed((100 * (mine - value)) / Math.abs(value), 2)} %` : signed(mine - value, 3);
  const sigmas = std ? `, ${number(Math.abs(mine - value) / std, 2)} sigma` : "";
  return [plusMinus(mine, std), off + sigmas];
}
