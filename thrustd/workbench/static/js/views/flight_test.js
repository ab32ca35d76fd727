// Flight test: test points, drag polar, transients of flights, and the health of engines over many.

import { upToDate } from "../answers.js";
import { fill, h, heading, panel, select } from "../dom.js";
import { channelsOf, chooseFlight, chosenFlight, flights, hasEstimates } from "../flights.js";
import { percent, typeset } from "../format.js";
import { bar } from "../ledger.js";
import { grid } from "../printed_table.js";
import { attempt, order, report, running, say, store } from "../store.js";

const QUESTIONS = {
  points: ["Test points", "Steady windows with thrust, fuel flow and their 95 % uncertainty."],
  performance: ["Drag polar", "C_D0, Oswald's e and L/D from thrust, accelerations and mass; throttle steps."],
  transients: ["Transients", "Spool-ups and -downs; flame-out and surge candidates."],
  health: ["Health over flights", "Engines and mounts over hours of flight: trends, steps, left against right."],
};
const MASS = { empty_kg: "Empty", payload_kg: "Payload", fuel_kg: "Fuel at the log's begin", std_kg: "One sigma" };
const SEVERAL = ["performance", "health"];

export function flightTest(root) {
  const ui = (store.ui.flighttest ??= { question: "points", several: null, mass: {}, marks: "" });
  const shown = h("div");
  const evaluate = h("button", { class: "primary", onclick: attempt(() => ask()) });
  let asked = false, // a question is on its way
    number, // of the job whose end is shown
    listed; // the flights that are offered: recordings are still being read when the page opens

  const names = (found) => found.map((r) => r.name).join("\n");
  const chosen = (found) => {
    if (!SEVERAL.includes(ui.question)) return [chosenFlight(found)?.name].filter(Boolean);
    const ready = found.filter(hasEstimates), // a raw log beside its replay is the same flight
      all = ready.length ? ready : found;
    return (ui.several ? found.filter((r) => ui.several.includes(r.name)) : all).map((r) => r.name);
  };

  // one question at a time
  function press() {
    const busy = asked || Boolean(running("flighttest"));
    evaluate.disabled = busy;
    evaluate.textContent = busy ? "Working …" : "Evaluate";
  }

  function draw() {
    const found = flights();
    press();
    listed = names(found);
    const [, words] = QUESTIONS[ui.question];
    const tools = h(
      "section.panel",
      h(
        "div.body.questions",
        h(
          "div.toolbar",
          Object.entries(QUESTIONS).map(([key, [name]]) =>
            h("button", { "aria-pressed": String(key === ui.question), onclick: () => turn(key) }, name),
          ),
        ),
        h("p.quiet", words),
        found.length
          ? fields(found)
          : h("p.empty", "No recording with N1 and air data in this folder, or none that is read yet."),
      ),
    );
    fill(
      root,
      heading(
        "Flight test",
        "What thrust is for. The numbers are those of the command line; a raw log is replayed on the way.",
      ),
      tools,
      shown,
    );
    look();
  }

  // no new attempt: what the last one said stays
  const look = () => show().catch((problem) => say(problem.message));

  function turn(question) {
    ui.question = question;
    number = undefined;
    fill(shown); // the answer to another question
    draw();
  }

  const fields = (found) => [
    SEVERAL.includes(ui.question) ? checks(found) : one(found),
    ui.question === "performance" ? masses() : null,
    ["points", "performance"].includes(ui.question) ? marks() : null,
    h("div.buttons", evaluate),
  ];
  const one = (found) =>
    h(
      "div.toolbar",
      h(
        "label",
        "Flight",
        select(
          found.map((r) => [r.name, r.name]),
          chosen(found)[0],
          (name) => {
            chooseFlight(name);
            look();
          },
          "flight",
        ),
      ),
    );
  const checks = (found) =>
    h(
      "div",
      { class: "checks", role: "group", "aria-label": "flights" },
      found.map((r) =>
        h(
          "label",
          h("input", {
            type: "checkbox",
            checked: chosen(found).includes(r.name),
            onchange: (event) => tick(found, r.name, event.target.checked),
          }),
          r.name,
        ),
      ),
    );
  function tick(found, name, on) {
    ui.several = chosen(found).filter((other) => other !== name);
    if (on) ui.several.push(name);
    look();
  }
  const masses = () =>
    h(
      "div.toolbar",
      Object.entries(MASS).map(([key, name]) =>
        h(
          "label",
          name,
          h("input", {
            type: "number",
            min: 0,
            step: "any",
            value: ui.mass[key] ?? "",
            "aria-label": `${name}, kg`,
            oninput: (event) => (ui.mass[key] = event.target.value),
          }),
          "kg",
        ),
      ),
      h("span.faint", "all empty: the recordings' own column mass_kg"),
    );
  const marks = () =>
    h(
      "div.toolbar",
      h(
        "label",
        "Points only while this channel is above 0",
        h("input", {
          type: "text",
          value: ui.marks,
          placeholder: "empty: steady windows are found",
          size: 30,
          oninput: (event) => (ui.marks = event.target.value.trim()),
        }),
      ),
    );

  async function ask() {
    const recordings = chosen(flights()),
      said = Object.keys(MASS).filter((key) => ui.mass[key]),
      several = SEVERAL.includes(ui.question);
    if (!recordings.length) return say("Choose a flight.");
    if (ui.question === "performance" && said.length !== 4 && (said.length || !weighed(recordings)))
      return say("Give the four masses: the drag polar needs them where a recording has no column mass_kg.");
    const mass =
      ui.question === "performance" && said.length
        ? Object.fromEntries(said.map((key) => [key, Number(ui.mass[key])]))
        : null;
    asked = true;
    try {
      await order("flighttest", {
        question: ui.question,
        recordings: several ? recordings : recordings.slice(0, 1),
        mass,
        marks: ui.marks,
      });
    } finally {
      asked = false;
      draw();
    }
  }

  // the newest end of this question about the flights that are chosen, as they are read now
  function latest() {
    const names = String(chosen(flights()));
    return store.server.jobs.find(
      ({ kind, state, arguments: asked, result }) =>
        kind === "flighttest" &&
        asked.question === ui.question &&
        String(asked.recordings) === names &&
        (state === "failed" || (state === "done" && upToDate({ result }))),
    );
  }

  // the answer about these flights, or why there is none
  async function show() {
    const job = latest();
    if (job?.state !== "done") {
      number = job?.id;
      return fill(shown, chosen(flights()).length ? unanswered(job) : null);
    }
    const answer = await report(job.result.report),
      scheme = document.documentElement.dataset.theme;
    if (latest()?.id !== job.id) return; // another question, other flights, or a newer answer, since
    number = job.id;
    const first = answer.tables.at(-1), // what the answer is about; the others tell more
      others = answer.tables.slice(0, -1);
    fill(
      shown,
      panel(
        answer.title,
        [h("span.push", h("a", { href: `api/reports/${answer.files}.csv`, download: `${ui.question}.csv` }, "CSV"))],
        h("p.body.faint", given(job.arguments)),
        grid(first),
        h(
          "div.body",
          h(
            "ul.lines",
            answer.lines.map((line) => h("li", typeset(line))),
          ),
          h("p.faint", answer.words),
        ),
      ),
      picture("Picture", answer.files, scheme),
      ...(answer.more ?? []).map((title, i) => picture(title, `${answer.files}-${i}`, scheme)),
      ...others.map((one) => panel(one.title, [], grid(one))),
    );
  }

  function unanswered(job) {
    const busy = running("flighttest"),
      names = chosen(flights()).join(", ");
    return h(
      "section.panel",
      h(
        "div.empty",
        busy
          ? [h("p", `${busy.title}: ${busy.note || busy.state} (${percent(busy.fraction)})`), bar(busy.fraction)]
          : job
            ? h("p.bad", typeset(job.error))
            : h("p", `${QUESTIONS[ui.question][0]} of ${names}: not evaluated yet.`),
      ),
    );
  }

  const picture = (title, files, scheme) =>
    panel(
      title,
      [h("span.push", h("a", { href: `api/reports/${files}-light.svg`, download: `${ui.question}.svg` }, "SVG"))],
      h("div.flush", h("img.drawing", { alt: title, src: `api/reports/${files}-${scheme}.svg` })),
    );

  draw();
  return {
    update: () => {
      if (latest()?.id !== number || names(flights()) !== listed) draw();
    },
    jobs: () => {
      press();
      if (latest()?.state !== "done") look();
    },
    about: () => chosen(flights())[0],
  };
}

const weighed = (names) =>
  store.server.recordings.every((one) => !names.includes(one.name) || channelsOf(one).includes("mass_kg"));

// what an answer was asked of
function given({ recordings, mass, marks }) {
  const said = [recordings.join(", ")];
  if (marks) said.push(`points while ${marks} is above 0`);
  if (mass)
    said.push(
      Object.entries(MASS)
        .map(([key, name]) => `${name.toLowerCase()} ${mass[key]} kg`)
        .join(", "),
    );
  return said.join("; ");
}
