// The error ledger of a model, and the bars it is drawn with.
import { h } from "./dom.js";
import { newtons, number } from "./format.js";
import { model, store } from "./store.js";

export function bar(fraction, kind = "") {
  const fill = h("i");
  fill.style.width = `${100 * Math.min(1, Math.max(0, fraction))}%`;
  return h("div", { class: `bar ${kind}` }, fill);
}

// the finished job that made a model
export const madeBy = (name) =>
  store.server.jobs.find(
    (one) => ["fit", "extend"].includes(one.kind) && one.state === "done" && one.result.model === name,
  );

// what was added to its parent to make it
export const stepOf = (name) => {
  const made = madeBy(name);
  return made?.kind === "extend" ? made.result : undefined;
};

// the diagnosis that asked for a step, and what it promised: of a curve, which it names where it knows no law, apart
export function askedOf(step) {
  const named = ({ verdict, curves = [] }) =>
    step.effects.every((effect) => verdict.includes(effect)) || curves.includes(String(step.effects));
  const found =
    step &&
    store.server.jobs.find(
      (one) =>
        one.kind === "diagnose" && one.state === "done" && one.arguments.model === step.parent && named(one.result),
    )?.result;
  const curve = found?.curves?.indexOf(String(step.effects)) ?? -1;
  return curve < 0 ? found : { ...found, rmse_after_n: found.curves_leave_n?.[curve] };
}

export const parentOf = (name) => {
  const parent = stepOf(name)?.parent;
  return parent && model(parent) ? parent : null;
};

// the chain of a model as bars: the first error, then one step per addition; on check recordings where they were run
export function ledgerOf(name) {
  const card = model(name);
  if (!card?.ledger.length) return [];
  const steps = [{ name: "as identified", rmse_n: card.ledger[0].rmse_before_n }];
  for (const entry of card.ledger)
    steps.push({ name: "+ " + entry.added, rmse_n: entry.rmse_after_n, data: entry.data });
  let made = stepOf(name);
  for (let i = steps.length - 1; i > 0 && made; i--) {
    steps[i].check ??= checkOf(made, made.model);
    steps[i - 1].check = checkOf(made, made.parent);
    made = stepOf(made.parent);
  }
  return steps;
}

const checkOf = (made, name) => made.heldout?.find((one) => one.model === name);

// falling bars with their numbers, the names under them, and the floor as a line
export function ledgerBars(steps, floor_n) {
  const top = Math.max(...steps.map((s) => s.rmse_n), 1);
  const line = floor_n && h("u.floor", `floor ${newtons(floor_n)}`);
  if (line) line.style.bottom = `${(82 * floor_n) / top}%`;
  return [
    h(
      "div",
      {
        class: "ledger",
        role: "img",
        "aria-label": "error ledger: " + steps.map((s) => `${s.name} ${newtons(s.rmse_n)}`).join(", "),
      },
      line || null,
      steps.map((s, i) => {
        const fill = h("i");
        fill.style.height = `${(82 * s.rmse_n) / top}%`;
        return h(
          "div",
          { class: "step" + (i ? "" : " first") },
          h("b", newtons(s.rmse_n)),
          i
            ? h(
                "span",
                { class: s.rmse_n < steps[i - 1].rmse_n ? "good" : "bad" },
                `${s.rmse_n < steps[i - 1].rmse_n ? "−" : "+"}${number(100 * Math.abs(1 - s.rmse_n / steps[i - 1].rmse_n), 2)} %`,
              )
            : h("span", " "),
          s.check
            ? h("span", { class: s.check.contradicted ? "bad" : "faint" }, `check ${newtons(s.check.rmse_n)}`)
            : null,
          fill,
        );
      }),
    ),
    h(
      "div.ledger-names",
      steps.map((s) => h("span", s.name)),
    ),
  ];
}
