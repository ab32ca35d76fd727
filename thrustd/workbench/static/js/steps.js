// The steps of the loop as orders to the worker.

import { latest } from "./answers.js";
import { newtons } from "./format.js";
import { parentOf } from "./ledger.js";
import { save } from "./save.js";
import { byItself, order, running, say, session, store } from "./store.js";
import { against } from "./way_back.js";

export async function exerciseNow(strength = 3) {
  return order("exercise", { strength: typeof strength === "number" ? strength : 3 });
}

export async function identifyNow() {
  const chosen = session(),
    folder = chosen.bench[0].includes("/") ? chosen.bench[0].split("/")[0] + "/" : "";
  const job = await order("fit", { recordings: chosen.bench, out: free(folder + "bench-model") });
  for (const line of job.result?.warnings ?? []) say(`${job.result.model}: ${line}`, "note");
}

// the chosen model, behind its parent where that is in the folder: before and after on the same samples
export async function compareNow(models) {
  const chosen = session(),
    parent = parentOf(chosen.model);
  return order("compare", {
    models: models ?? [parent, chosen.model].filter(Boolean),
    recordings: chosen.measured,
    condition: null,
  });
}

export async function diagnoseNow() {
  const chosen = session();
  return order("diagnose", { model: chosen.model, recordings: chosen.measured });
}

// read recordings that were never read, one after the other, whatever is on the screen
const read = new Set();
export function readNext() {
  const next = store.server.recordings.find((one) => !one.meta && !one.table && !one.growing && !read.has(one.name));
  if (!next || running("prepare")) return;
  read.add(next.name);
  byItself(order)("prepare", { recording: next.name });
}

// effects: the laws that fit best, by the names that extend takes
export async function extendWith(effects) {
  const chosen = session();
  const asked = latest("diagnose")?.candidates ?? [], // a file is called by the words that the page has shown
    words = effects.map((effect) => asked.find((c) => c.name === effect)?.effect ?? effect),
    word = words.map((one) => one.replace(/[^A-Za-z0-9_]+/g, "-").replace(/^-+|-+$/g, "")).join("+");
  const job = await order("extend", {
    model: chosen.model,
    effects,
    recordings: chosen.measured,
    heldout: chosen.heldout,
    out: free(`${stem(chosen.model)}+${word.slice(0, 40)}`),
  });
  if (job.state !== "done") return;
  const fall = `${newtons(job.result.rmse_before_n)} → ${newtons(job.result.rmse_after_n)} on held-back blocks`,
    bad = against(job.result);
  say(`${job.result.effects.join(" and ")} added: ${fall}. ${bad}`, bad ? "problem" : "ok");
}

// from another screen: go there, then add
export async function goAndAdd(effects) {
  location.hash = "add";
  await extendWith(effects);
}

// the finished compilation of a model
export const compiled = (name) =>
  store.server.jobs.find((one) => one.kind === "compile" && one.state === "done" && one.result.model === name)?.result;

export const compileNow = (rate_hz = 1000) => order("compile", { model: session().model, rate_hz });

export async function writeReport() {
  const job = await order("report", { title: session().model });
  if (job.state === "done") save("api/reports/" + job.result.report, "report.html");
}

export async function revealNow() {
  const job = await order("reveal", { exercise: session().exercise });
  if (job.state === "done") location.hash = "overview";
}

export const stem = (name) => name.replace(/\.json$/, "");

export function free(base) {
  const taken = new Set(store.server.models.map((one) => one.name));
  let name = base + ".json";
  for (let number = 2; taken.has(name); number++) name = `${base}-${number}.json`;
  return name;
}
