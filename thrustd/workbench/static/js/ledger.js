// The error ledger of a model, and the bars it is drawn with.
import { h } from "./dom.js";
import { newtons, number } from "./format.js";
import { model } from "./store.js";

export function bar(fraction, kind = "") {
  const fill = h("i");
  fill.style.width = `${100 * Math.min(1, Math.max(0, fraction))}%`;
  return h("div", { class: `bar ${kind}` }, fill);
}

// the chain of a model as bars: the first error, then one step per addition
export function ledgerOf(name) {
  const card = model(name);
  if (!card?.ledger.length) return [];
  const steps = [{ name: "as identified", rmse_n: card.ledger[0].rmse_before_n }];
  for (const entry of card.ledger)
    steps.push({ name: "+ " + entry.added, rmse_n: entry.rmse_after_n, data: entry.data });
  return steps;
}

// falling bars with their numbers, and the names under them
export function ledgerBars(steps) {
  const top = Math.max(...steps.map((s) => s.rmse_n), 1);
  return [
    h(
      "div",
      {
        class: "ledger",
        role: "img",
        "aria-label": "error ledger: " + steps.map((s) => `${s.name} ${newtons(s.rmse_n)}`).join(", "),
      },
      steps.map((s, i) => {
        const fill = h("i");
        fill.style.height = `${(82 * s.rmse_n) / top}%`;
        return h(
          "div",
          { class: "step" + (i ? "" : " first") },
          h("b", {}, newtons(s.rmse_n)),
          i
            ? h(
                "span",
                { class: s.rmse_n < steps[i - 1].rmse_n ? "good" : "bad" },
                `${s.rmse_n < steps[i - 1].rmse_n ? "−" : "+"}${number(100 * Math.abs(1 - s.rmse_n / steps[i - 1].rmse_n), 2)} %`,
              )
            : h("span", {}, " "),
          fill,
        );
      }),
    ),
    h(
      "div",
      { class: "ledger-names" },
      steps.map((s) => h("span", {}, s.name)),
    ),
  ];
}
