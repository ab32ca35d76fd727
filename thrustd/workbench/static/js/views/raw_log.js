// A flight log without estimates: what gives them to it.

import { h } from "../dom.js";
import { chooseFlight } from "../flights.js";
import { percent } from "../format.js";
import { attempt, changed, order, running, store } from "../store.js";

// a raw log holds what the sensors said: a button, and the command for a terminal in the folder, whatever its name
export function replayFirst(name) {
  const quoted = (said) => (/[^\w./+-]/.test(said) ? `'${said.replaceAll("'", "'\\''")}'` : said),
    made = replayed(name),
    busy = running("replay");
  const go = attempt(async () => {
    const job = await order("replay", { recording: name, out: made });
    if (job.state === "done") chooseFlight(job.result.recording);
    changed("state");
  });
  return h(
    "div",
    h("p", "This log holds what the sensors said, and no estimates yet."),
    h(
      "button",
      { class: "primary", disabled: Boolean(busy), onclick: go },
      busy ? `${busy.title}: ${percent(busy.fraction)}` : "Replay it",
    ),
    h("p", "In a terminal: ", h("code", `thrustd replay ${quoted(name)} -o ${quoted(made)}`)),
  );
}

// the name of the log that a replay writes
function replayed(name) {
  const taken = new Set(store.server.recordings.map((one) => one.name)),
    base = name.replace(/\.mcap$/i, "-replayed");
  let free = `${base}.mcap`;
  for (let number = 2; taken.has(free); number++) free = `${base}-${number}.mcap`;
  return free;
}
