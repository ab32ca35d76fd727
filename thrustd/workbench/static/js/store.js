// The one state of the page: what the server says, where we are, and who wants to hear of changes.
import { get, Problem, post, remove } from "./api.js";

// the screen that an address names; behind ? stands what it shows
export const viewOf = (hash) => hash.slice(1).split("?")[0] || "overview";

export const store = {
  server: null, // answer of api/state
  reports: new Map(), // number -> report
  view: viewOf(location.hash),
  asking: 0, // orders on their way to the server, ends whose outcome is on its way back: work that no job stands for
  refused: 0, // choices that the server did not take
  focus: null, // {recording, from, to, why}: where the time histories should look
  ui: {}, // what views remember between renderings; about: the recording that was worked with last
};
const listeners = new Set();
let newest = null; // question for the state
let choosing = Promise.resolve(); // a choice on its way to the server: a state asked for before it is made does not know it

export const listen = (listener) => {
  listeners.add(listener);
  return () => listeners.delete(listener);
};
export function changed(what = "all") {
  for (const listener of [...listeners]) listener(what);
}

export function refresh() {
  const asked = choosing
    .then(() => get("api/state"))
    .then((server) => {
      if (asked !== newest) return newest; // what was asked later knows more
      store.server = server;
      for (const job of server.jobs) if (waiting.has(job.id) && over(job)) tell(job); // ended before the stream was open
      changed("state");
    });
  newest = asked;
  return asked;
}

const AGAIN_MS = 3000; // after which a server that is gone is asked again

export function follow() {
  const events = new EventSource("api/events"),
    { dataset } = document.documentElement;
  events.addEventListener("job", (event) => {
    const job = JSON.parse(event.data),
      jobs = store.server.jobs,
      at = jobs.findIndex((one) => one.id === job.id);
    if (at >= 0) jobs[at] = job;
    else jobs.unshift(job);
    if (over(job)) finished(job).catch((problem) => say(problem.message));
    changed("jobs");
  });
  // every second; what is shown is of another folder until an answer has come, however often one was lost on its way
  let looking = false;
  events.addEventListener("folder", async ({ data }) => {
    if (looking || JSON.parse(data).stamp === store.server.stamp) return;
    looking = true;
    await refresh().catch(() => {}); // a server that is gone is said by onerror
    looking = false;
  });
  // what happened before the stream was open, or while it was broken, is in no event
  events.onopen = () => {
    delete dataset.gone;
    refresh().catch((problem) => say(problem.message));
  };
  events.onerror = () => {
    dataset.gone = "yes";
    if (events.readyState === EventSource.CLOSED) setTimeout(follow, AGAIN_MS);
  };
}

const over = (job) => ["done", "failed", "cancelled"].includes(job.state);
const waiting = new Map();
const told = new Set(); // jobs whose end was told
async function finished(job) {
  await busy(refresh);
  tell(job);
  changed("state");
}
function tell(job) {
  if (told.has(job.id)) return;
  told.add(job.id);
  const later = waiting.get(job.id) ?? [];
  waiting.delete(job.id);
  if (job.state === "failed") say(job.error);
  if (job.state === "done" && job.kind === "adopt") say(`${job.result.name} is in the folder`, "ok");
  for (const resolve of later) resolve(job);
}

// queue a job; resolves with the finished job
export async function order(kind, fields = {}) {
  return ended(await busy(() => post("api/jobs", { kind, ...fields })));
}

// resolves with a job when it is over; its end is told, although it may have come before the stream of events is open
export function ended(job) {
  const { jobs } = store.server,
    known = jobs.find((one) => one.id === job.id);
  if (known && over(known)) {
    tell(known); // its end was heard before the answer to the order
    return known;
  }
  if (!known) jobs.unshift(job);
  changed("jobs");
  refresh().catch((problem) => say(problem.message)); // an answer already on its way does not know this job
  return new Promise((resolve) => waiting.set(job.id, [...(waiting.get(job.id) ?? []), resolve])); // asked twice: one job
}
async function busy(work) {
  store.asking++;
  changed("jobs");
  try {
    return await work();
  } finally {
    store.asking--;
    changed("jobs");
  }
}
export const cancel = (job) => remove("api/jobs/" + job.id);

export async function choose(fields) {
  const made = post("api/session", fields);
  choosing = made.catch(() => {});
  refresh().catch((problem) => say(problem.message)); // from here on no older answer counts
  try {
    store.server.session = await made;
    store.ui.about = fields.measured?.[0] ?? store.ui.about;
  } catch (problem) {
    store.refused++; // lists that show the choice are drawn anew
    throw problem;
  } finally {
    changed("state");
  }
}

export async function report(number) {
  if (!number) return null;
  if (!store.reports.has(number)) store.reports.set(number, await get("api/reports/" + number));
  return store.reports.get(number);
}

// kind: "problem", "note" or "ok"
export function say(line, kind = "problem") {
  document.dispatchEvent(new CustomEvent("say", { detail: { line, kind } }));
}

// run what the person asked for and what may fail; the one line of the problem is shown, and those of before are over
export const attempt = (work) => {
  const tried = byItself(work);
  return (...given) => {
    document.dispatchEvent(new CustomEvent("attempt"));
    return tried(...given);
  };
};

// the same of what the page does by itself: nobody has tried anything else, so what was said stays
export const byItself =
  (work) =>
  async (...given) => {
    try {
      return await work(...given);
    } catch (problem) {
      if (!(problem instanceof Problem)) console.error(problem);
      say(problem.message || String(problem));
      return undefined;
    }
  };

export const running = (kind) =>
  store.server.jobs.find((job) => job.kind === kind && ["waiting", "running"].includes(job.state));
export const recording = (name) => store.server.recordings.find((one) => one.name === name);
export const model = (name) => store.server.models.find((one) => one.name === name);
export const session = () => store.server.session;
