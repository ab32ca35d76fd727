// What was found so far about the chosen model and recordings, and whether it still holds.
import { madeBy } from "./ledger.js";
import { model, recording, session, store } from "./store.js";

// whether a job was asked of these files as they are read now: their content, columns, excluded stretches
export const upToDate = ({ result: { files = {} } }) =>
  Object.entries(files).every(([name, key]) => (recording(name) ?? model(name))?.key === key);

// why a recording could not be read, in one line; "" while it was not tried, or when it was
export function unreadable(name) {
  const job = store.server.jobs.find(
    (one) => one.kind === "prepare" && one.arguments.recording === name && ["done", "failed"].includes(one.state),
  );
  return job?.state === "failed" && !recording(name)?.meta ? job.error : "";
}

// the latest finished answer about exactly this model and these recordings, as they are read now
export function latest(kind) {
  const chosen = session();
  const same = ({ arguments: asked }) => {
    const models = asked.models ?? [asked.model];
    return models.at(-1) === chosen.model && String(asked.recordings) === String(chosen.measured) && !asked.condition;
  };
  const job = store.server.jobs.find((one) => one.kind === kind && one.state === "done" && same(one) && upToDate(one));
  return job ? { ...job.result, id: job.id, title: job.title } : null;
}

// the step that made a model, or one it grew from, of a file or of columns that are read otherwise since ("": the file)
export function outdated(name) {
  for (let job = madeBy(name); job; job = madeBy(job.result.parent)) {
    const { reading = {}, reads = [] } = job.result,
      there = job.arguments.recordings.map(recording).filter((one) => one?.reading && reading[one.name]);
    if (there.some((one) => ["", ...reads].some((column) => one.reading[column] !== reading[one.name][column])))
      return job;
  }
  return null;
}
