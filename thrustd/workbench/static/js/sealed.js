// The opened answer of an exercise beside what the chosen model holds.
import { model, session, store } from "./store.js";

// the opened answer of the running exercise
export function revealed() {
  const job = store.server.jobs.find(
    (one) => one.kind === "reveal" && one.state === "done" && one.result.exercise === session().exercise,
  );
  return job?.result ?? null;
}

// a variant is named after its effect: hysteresis_preisach is hysteresis
export const effectOf = (name, known) => known.find((word) => name === word || name.startsWith(word + "_")) ?? name;

// what the model holds of what was hidden
export function afterwards(truth) {
  const hidden = truth.effects.map((one) => one.effect),
    held = (model(session().model)?.effects ?? []).map((one) => effectOf(one.name, hidden));
  const missed = hidden.filter((name) => !held.includes(name)),
    extra = held.filter((name) => !hidden.includes(name));
  if (!missed.length && !extra.length)
    return `Found: ${hidden.join(" and ")} was hidden, and that is what the model holds.`;
  return (
    `${hidden.join(" and ")} was hidden; the model holds ${held.join(" and ") || "no effect"}. ` +
    "Their forces may look alike on these data: see what separates them under What is missing."
  );
}
