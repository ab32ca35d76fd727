// The next sensible step, in words, from what is there: a newcomer needs nothing else.
import { latest, outdated } from "./answers.js";
import { newtons, typeset } from "./format.js";
import { askedOf, stepOf } from "./ledger.js";
import { afterwards, revealed } from "./sealed.js";
import {
  compareNow,
  compiled,
  compileNow,
  diagnoseNow,
  exerciseNow,
  goAndAdd,
  identifyNow,
  revealNow,
  writeReport,
} from "./steps.js";
import { choose, session, store } from "./store.js";
import { nameColumns } from "./views/columns_panel.js";
import { takenBack, wayBack } from "./way_back.js";

const go = (view) => {
  location.hash = view;
};
const there = (view, work) => async () => {
  go(view);
  await work();
};

export function nextStep() {
  const { recordings, models, session: chosen } = store.server;
  if (!recordings.length)
    return {
      view: "overview",
      say: "There is no recording here yet. Drop your files on the page, or make an exercise: simulated recordings in which one effect is hidden.",
      label: "Make an exercise",
      go: exerciseNow,
      kinds: ["exercise"],
    };
  const strange = unnamed();
  if (strange) return sayColumns(strange.name);
  if (recordings.every((one) => one.meta && !one.meta.channels.some((c) => c.name === "force_N"))) return noReference();
  if (!models.length && chosen.bench.length)
    return {
      view: "identify",
      say: `Identify a first model from the bench record ${chosen.bench[0]}.`,
      label: "Identify a model",
      go: there("identify", identifyNow),
      kinds: ["fit"],
    };
  if (!models.length)
    return {
      view: "overview",
      say: "Which recording was made on the bench, with nothing but the mount? A first model is identified from it. Choose it at the top or in the table, or drop a model file here.",
      wants: "bench",
    };
  if (!chosen.model)
    return {
      view: "overview",
      say:
        models.length === 1
          ? `Test the model ${models[0].name} against the measurements?`
          : "Choose the model to test, at the top.",
      wants: "model",
      label: models.length === 1 ? "Take this model" : null,
      go: () => choose({ model: models[0].name }),
    };
  const old = outdated(chosen.model);
  if (old && chosen.bench.length)
    return {
      view: "identify",
      say: `${old.arguments.recordings[0]} is read otherwise since ${old.result.model} was made of it: its numbers are those of the columns as they were. Identify anew.`,
      label: "Identify anew",
      go: there("identify", identifyNow),
      kinds: ["fit"],
    };
  const left = recordings
    .filter((one) => hasReference(one) && ![chosen.bench, chosen.measured, chosen.heldout].flat().includes(one.name))
    .map((one) => one.name);
  if (!chosen.measured.length)
    return {
      view: "overview",
      say:
        left.length === 1
          ? `Should the model explain ${left[0]}?`
          : "Choose the measured recording that the model should explain, at the top.",
      wants: "measured",
      label: left.length === 1 ? "Take this recording" : null,
      go: () => choose({ measured: left }),
    };
  if (!chosen.heldout.length && !chosen.unchecked && left.length)
    return {
      view: "overview",
      say: `Keep one of the others for the check, so that nothing is fitted to it? ${left.slice(0, 3).join(", ")}`,
      wants: "check on",
      label: left.length === 1 ? `Check on ${left[0]}` : null,
      go: () => choose({ heldout: left }),
      other: { label: "Go on without a check", go: () => choose({ unchecked: true }) },
    };
  const back = wayBack(chosen.model);
  if (back) return back;
  const compared = latest("compare"),
    asked = latest("diagnose");
  if (!compared)
    return {
      view: "fails",
      say: `${added(chosen.model)}See how well ${chosen.model} explains ${chosen.measured[0]}, and where it fails.`,
      label: "Compare",
      go: there("fails", compareNow),
      other: asItIs(chosen.model),
      kinds: ["compare"],
    };
  if (!asked)
    return {
      view: "missing",
      say: `${added(chosen.model)}The model is ${newtons(compared.cells.at(-1).rmse_n)} RMS wrong.${compared.worst.at(-1) ? ` It fails most here: ${typeset(compared.worst.at(-1))}.` : ""} ${stepOf(chosen.model) ? "Ask whether anything else is missing, or save it." : "Ask which absent physical effect would explain what is left."}`,
      label: "What is missing?",
      go: there("missing", diagnoseNow),
      other: asItIs(chosen.model),
      kinds: ["diagnose"],
    };
  return afterDiagnosis(asked, chosen);
}

function noReference() {
  const { recordings, models } = store.server,
    has = (start) => recordings.some((one) => one.meta.channels.some((c) => c.name.startsWith(start)));
  const [view, label, words] = has("estimate_thrust_n")
    ? ["flight", "Live and flight", "Play the flight back."]
    : has("n1_pct") || recordings.some((one) => one.name.endsWith(".mcap"))
      ? ["flighttest", "Flight test", "Find test points, drag polar and health of these flights."]
      : models.length
        ? ["histories", "Time histories", "Look at what the chosen model estimates."]
        : ["histories", "Time histories", "Look at the channels; a model file dropped here shows its estimate."];
  return {
    view,
    say: `No recording here has a reference (force_N), so there is nothing to compare a model with. ${words}`,
    label: store.view === view ? null : label,
    go: () => go(view),
  };
}

// whose columns should be said: no time in the file, no force and deformation anywhere in the folder, or a column that
// may be a channel and that nobody was asked about when others were named; a flight has what screen "Flight test" reads
const flies = (one) => ["n1_pct", "mach"].every((name) => one.meta?.channels.some((c) => c.name.startsWith(name)));
function unnamed() {
  const tables = store.server.recordings.filter((one) => one.table && !flies(one)),
    files = tables.filter((one) => !one.mapped.columns?.length && !one.mapped.rate_hz);
  const usable = store.server.recordings.some((one) =>
    ["force_N", "deformation_mm"].every((name) => one.meta?.channels.some((c) => c.name === name)),
  );
  return (
    files.find((one) => !one.table.timed) ??
    (usable ? undefined : files.find((one) => one.table.wanting.length)) ??
    tables.find((one) => one.table.unseen.length)
  );
}

const hasReference = (one) =>
  ["force_N", "deformation_mm"].every((name) => one.meta?.channels.some((c) => c.name === name));

// effects that were not tried because their channel has no column, where the rest follows a column that is no channel
function unread({ depends_on: followed, not_judged: left }) {
  const absent = left.filter((one) => one.reason.startsWith("channel"));
  return absent.length && followed.some((name) => /[[("]/.test(name))
    ? `Not tried: ${absent.map((one) => `${one.effect} (${one.reason})`).join(", ")}. Is a column one of these channels? `
    : "";
}

const sayColumns = (name) => ({
  view: "overview",
  say: `Name the columns of ${name}: time, force, deformation and what else was recorded, with their units. One answer serves every file of the folder.`,
  label: store.view === "overview" && store.ui.columns === name ? null : "Name the columns",
  go: () => nameColumns(name),
});

// how sure a verdict is, in words
export const GRADES = {
  strong: "held-back blocks tell it from every other set of effects",
  weak: "something is left that follows a channel",
  "cannot be told": "another effect does as well on these data",
};

function afterDiagnosis(asked, chosen) {
  const effects = asked.verdict.filter((name) => !["none", "unknown"].includes(name)),
    laws = asked.candidates.filter((c) => c.in_verdict).map((c) => c.name);
  const curve = asked.verdict.includes("unknown") && !unread(asked) ? asked.curves?.[0] : null;
  const named = effects.length ? effects.join(" and ") : curve,
    offered = effects.length ? laws : [curve],
    refuted = takenBack(offered);
  if (refuted)
    return {
      view: "missing",
      say: `${refuted} It was taken back. Try another candidate, a hypothesis of your own, or another recording under Check on.`,
      label: store.view === "missing" ? null : "See the candidates",
      go: () => go("missing"),
      other: { label: `Add ${named} again`, go: () => goAndAdd(offered) },
    };
  if (effects.length)
    return {
      view: "add",
      say:
        `The data ask for ${named} (${asked.grade}: ${GRADES[asked.grade]}). ` +
        `Promised: ${newtons(asked.rmse_before_n)} → ${newtons(asked.rmse_after_n)} on held-back blocks` +
        `; the floor is ${newtons(asked.floor_n)}${asked.more_left ? ", and something else is missing too" : ""}.`,
      label: `Add ${named}`,
      go: () => goAndAdd(laws),
      kinds: ["extend"],
    };
  const truth = revealed();
  if (chosen.exercise && truth)
    return {
      view: "add",
      say: afterwards(truth),
      ...(["add", "overview"].includes(store.view)
        ? kept(chosen.model)
        : { view: "overview", label: "See found and true", go: () => go("overview") }),
    };
  if (curve)
    return {
      view: store.view === "missing" ? "add" : "missing",
      say:
        `Something is left that no effect that was tried explains; it follows ${asked.depends_on.join(", ")}. ` +
        "Its free curve can be added as it is: it says what the force follows, and not why. If you know the law, try it as a hypothesis of your own.",
      label: store.view === "missing" ? `Add ${curve}` : "Show me",
      go: () => (store.view === "missing" ? goAndAdd([curve]) : go("missing")),
      kinds: ["extend"],
      other: store.view === "missing" ? { label: "Save and compile", go: keep } : null,
    };
  if (asked.verdict.includes("unknown"))
    return {
      view: "missing",
      say:
        "Something is left that no effect that was tried explains" +
        (asked.depends_on.length ? `; it follows ${asked.depends_on.join(", ")}` : "") +
        `. ${unread(asked)}Try a hypothesis of your own, or keep the model as it is.`,
      other: unread(asked) ? { label: "Name the columns", go: () => nameColumns(chosen.measured[0]) } : null,
      label: store.view === "missing" ? "Save and compile" : "Show me",
      go: store.view === "missing" ? keep : () => go("missing"),
    };
  if (chosen.exercise)
    return {
      view: "overview",
      say: "Nothing is left that a further effect would explain. Open the sealed answer and see whether you found it. (The twin chooses an effect by its size in newtons: parameters need not be those of a real mount.)",
      label: "Open the sealed answer",
      go: revealNow,
      kinds: ["reveal"],
    };
  return {
    view: "add",
    say:
      "Nothing is left that a further effect would explain" +
      ` (${newtons(asked.rmse_before_n)} left, floor ${newtons(asked.floor_n)})` +
      (asked.more_left ? "; what is left is much, or follows a channel" : "") +
      `. ${checked(chosen)}`,
    ...kept(chosen.model),
  };
}

// the end of the loop: save and compile, then the file and the report
function kept(name) {
  const at = store.view === "add",
    kinds = ["compile", "report"];
  if (!compiled(name)) return { label: "Save and compile", go: keep, kinds };
  return { done: true, label: at ? "Write the report" : "Show the file", go: at ? writeReport : keep, kinds };
}

async function keep() {
  go("add");
  if (!compiled(session().model)) await compileNow();
  setTimeout(() => document.querySelector(".body.file")?.scrollIntoView({ block: "center" }), 200); // once it is drawn
}

// what the step that made the chosen model gave, and that one may stop here
const added = (name) => {
  const step = stepOf(name),
    floor = askedOf(step)?.floor_n;
  return step
    ? `${step.effects.join(" and ")} left ${newtons(step.rmse_after_n)} of ${newtons(step.rmse_before_n)}${floor ? `, the floor is ${newtons(floor)}` : ""}. `
    : "";
};
const asItIs = (name) => (stepOf(name) ? { label: "Save and compile", go: keep } : null);

// what the recordings that nothing was fitted to say of the chosen model
function checked({ model: name }) {
  const found = (stepOf(name)?.heldout ?? []).filter((one) => one.model === name);
  return found.length
    ? `Checked on ${found.map((one) => `${one.recording}: ${newtons(one.rmse_n)}`).join(", ")}.`
    : "It was not checked on another recording.";
}
