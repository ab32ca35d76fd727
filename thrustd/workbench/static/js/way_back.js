// When the recording that nothing was fitted to speaks against what was added: the way back, and what is left to try.
import { post } from "./api.js";
import { newtons, typeset } from "./format.js";
import { parentOf, stepOf } from "./ledger.js";
import { changed, model, refresh, say, session, store } from "./store.js";

// what the check recordings say against a step: the promise is broken, or nothing was gained; "" when they bear it out
export function against(step) {
  const { heldout = [], remarks = [], parent, model: name } = step ?? {},
    of = (one, by) => heldout.find((other) => other.recording === one.recording && other.model === by);
  const bad = heldout.find(
    (one) => one.model === name && (one.contradicted || one.rmse_n >= (of(one, parent)?.rmse_n ?? Infinity)),
  );
  if (!bad) return "";
  const [from, to, promised] = [of(bad, parent)?.rmse_n, bad.rmse_n, step.rmse_after_n].map(newtons);
  const lacks = remarks.filter((line) => line.startsWith(`${bad.recording}:`)).map((line) => ` ${typeset(line)}.`);
  return `${bad.recording} speaks against ${step.effects.join(" and ")}: its error went from ${from} to ${to}, where ${promised} was promised.${lacks.join("")}`;
}

// the newest model of a chain is put aside, and its parent chosen again
export async function takeBack(name) {
  const kept = await post("api/undo", name);
  await refresh();
  say(`${kept.model} is chosen again; ${name} was put aside`, "ok");
}

const kept = new Set(); // models that the person keeps although their check speaks against them

export function wayBack(name) {
  const doubt = kept.has(name) || !parentOf(name) ? "" : against(stepOf(name));
  if (!doubt) return null;
  const keep = () => {
    kept.add(name);
    location.hash = "fails";
    changed("state");
  };
  return {
    view: "add",
    say: `${doubt} Take it back.`,
    doubt,
    label: "Undo",
    go: () => takeBack(name),
    other: { label: "Keep it", go: keep },
  };
}

// the same effects, added before and taken back for what the same check said of them
export function takenBack(laws) {
  const { model: parent, heldout } = session();
  const job = store.server.jobs.find(
    ({ kind, state, arguments: asked, result }) =>
      kind === "extend" &&
      state === "done" &&
      result.parent === parent &&
      !model(result.model) &&
      String(asked.effects) === String(laws) &&
      String(asked.heldout) === String(heldout),
  );
  return against(job?.result);
}
