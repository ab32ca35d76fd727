// The next sensible step, in words, from what is there: a newcomer needs nothing else.
import { newtons } from "./format.js";
import { choose, session, store } from "./store.js";

import { compareNow, diagnoseNow, exerciseNow, extendWith, identifyNow, revealNow } from "./steps.js";

const go = (view) => {
  location.hash = view;
};

export function nextStep() {
  const { recordings, models, session: chosen } = store.server;
  if (!recordings.length)
    return {
      view: "overview",
      say: "There is no recording here yet. Drop one on the page, or let the twin make an exercise: a recording with an effect in it that nobody tells you.",
      label: "Make an exercise",
      go: exerciseNow,
      kinds: ["exercise"],
    };
  if (!models.length && chosen.bench.length)
    return {
      view: "overview",
      say: `Identify a first model from the quiet bench record ${chosen.bench[0]}.`,
      label: "Identify a model",
      go: identifyNow,
      kinds: ["fit"],
    };
  if (!models.length)
    return {
      view: "overview",
      say: "Choose a bench recording above (quiet, with force_N), then identify a first model from it; or drop a model file here.",
    };
  if (!chosen.model)
    return {
      view: "overview",
      say: "Choose the model to be questioned, at the top.",
      label: models.length === 1 ? `Take ${models[0].name}` : null,
      go: () => choose({ model: models[0].name }),
    };
  if (!chosen.measured.length)
    return { view: "overview", say: "Choose the measured recording the model should explain, at the top." };
  const compared = latest("compare"),
    asked = latest("diagnose");
  if (!compared)
    return {
      view: "fails",
      say: `See how well ${chosen.model} explains ${chosen.measured[0]}, and where it fails.`,
      label: "Compare",
      go: async () => {
        go("fails");
        await compareNow();
      },
      kinds: ["compare"],
    };
  if (!asked)
    return {
      view: "missing",
      say: `The model is ${newtons(compared.cells.at(-1).rmse_n)} RMS wrong${compared.worst[0] ? ", most of all " + compared.worst[0] : ""}. Ask which absent physical effect would explain what is left.`,
      label: "What is missing?",
      go: async () => {
        go("missing");
        await diagnoseNow();
      },
      kinds: ["diagnose"],
    };
  return afterDiagnosis(asked, chosen);
}

function afterDiagnosis(asked, chosen) {
  const effects = asked.verdict.filter((name) => !["none", "unknown"].includes(name));
  if (effects.length)
    return {
      view: "add",
      say: `The data ask for ${effects.join(" and ")}. Add it to the model and watch the error on held-back data.`,
      label: `Add ${effects[0]}`,
      go: async () => {
        go("add");
        await extendWith(effects[0]);
      },
      kinds: ["extend"],
    };
  if (asked.verdict.includes("unknown"))
    return {
      view: "missing",
      say: "Something is left that no known effect explains; the channels it depends on are named below.",
      label: store.view === "missing" ? null : "Show me",
      go: () => go("missing"),
    };
  if (chosen.exercise)
    return {
      view: "overview",
      say: "Nothing is left that a further effect would explain. Open the sealed answer and see whether you found it.",
      label: "Open the sealed answer",
      go: revealNow,
      kinds: ["reveal"],
    };
  return {
    view: "overview",
    say: "Nothing is left that a further effect would explain. Save the model, compile it for flight, or write the report.",
    label: store.view === "add" ? null : "Save and compile",
    go: () => go("add"),
  };
}

// the latest finished answer about exactly this model and these recordings
export function latest(kind) {
  const chosen = session();
  const same = (job) => {
    const asked = job.arguments;
    const models = asked.models ?? [asked.model];
    return models.at(-1) === chosen.model && String(asked.recordings) === String(chosen.measured) && !asked.condition;
  };
  const job = store.server.jobs.find((one) => one.kind === kind && one.state === "done" && same(one));
  return job ? { ...job.result, id: job.id, title: job.title } : null;
}
