// The error ledger of a model, and the bars it is drawn with.
import { h } from "./dom.js";
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
  for (const entry of card.ledger) steps.push({ name: "+ " + entry.added, rmse_n: entry.rmse_after_n, data: entry.data });
  return steps;
}
