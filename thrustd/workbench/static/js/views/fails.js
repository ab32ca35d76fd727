// Where it fails: the numbers, the ranked list in words, and the pictures; a click takes all of them to those samples.
import { fill, h, panel, wideTable } from "../dom.js";
import { newtons, number, percent, seconds, signedNewtons, typeset } from "../format.js";
import { bar } from "../ledger.js";
import { compareNow, stem } from "../steps.js";
import { attempt, session, store } from "../store.js";
import { answerView } from "./answer.js";
import { pictures, regions } from "./failure_pictures.js";

// what is said of one model on one recording: [name, value(cell)]
const NUMBERS = [
  ["RMSE", (c) => newtons(c.rmse_n)],
  ["mean |error|", (c) => newtons(c.mae_n)],
  ["mean |error| above 2 kN", (c) => (c.mae_pct_above_2kn === null ? "–" : number(c.mae_pct_above_2kn, 3) + " %")],
  ["bias, measured − model", (c) => signedNewtons(c.bias_n)],
  ["fit", (c) => number(c.fit_pct, 4) + " %"],
  ["autocorrelation at 1 s", (c) => number(c.autocorrelation["1 s"] ?? NaN, 2)],
];

export function fails(root) {
  const ui = { cell: 0, chosen: null };
  let answer = null,
    head = null;

  function draw() {
    const { cells } = answer,
      c = cells[ui.cell],
      failure = ui.chosen === null ? null : c.where_it_fails[ui.chosen];
    const rest = cells.filter((one) => one !== c && one.recording === c.recording);
    fill(
      root,
      head,
      cells.length > 1 ? sideBySide(cells) : figures(c),
      list(c, failure),
      pictures(c, rest, failure, ui.chosen),
      panel(`By region: ${c.model}`, [], h("div.flush", regions(c))),
    );
  }

  const buttons = () =>
    h(
      "span.push.buttons",
      others(),
      h("button", { onclick: attempt(() => compareNow([session().model])) }, "Compare again"),
    );

  const figures = (c) =>
    panel(
      `${c.model} on ${c.recording}`,
      [buttons()],
      h(
        "div.figures",
        NUMBERS.map(([name, value]) => h("div.figure", h("b", value(c)), h("span", name))),
        h(
          "button",
          { class: "figure plain", title: "show in the time history", onclick: () => goWorst(c) },
          h("b", signedNewtons(c.worst.error_n)),
          h("span", `worst, at ${seconds(c.worst.time_s)} ↗`),
        ),
      ),
    );

  // models on the same samples as rows of one table; the words and pictures below are those of the row that is pressed
  function sideBySide(cells) {
    const choose = (i) => () => {
      ui.cell = i;
      ui.chosen = null;
      draw();
    };
    const several = new Set(cells.map((c) => c.recording)).size > 1;
    const row = (c, i) => ({
      props: { class: "pick", "aria-selected": String(i === ui.cell), onclick: choose(i) },
      cells: [
        h("button", { class: "plain", "aria-pressed": String(i === ui.cell) }, stem(c.model)),
        several ? c.recording : null,
        ...NUMBERS.map(([, value]) => value(c)),
        h(
          "button",
          { class: "plain", title: "show in the time history", onclick: () => goWorst(c) },
          `${signedNewtons(c.worst.error_n)} at ${seconds(c.worst.time_s)} ↗`,
        ),
      ],
    });
    return panel(
      several ? "Side by side" : `Side by side on ${cells[0].recording}`,
      [h("span.faint", "words and regions below are of the chosen row"), buttons()],
      wideTable(
        { class: "cells" },
        [
          ["Model", "name"],
          several ? ["Recording", "name"] : null,
          ...[...NUMBERS.map(([name]) => name), "worst"].map((name) => [name, "num"]),
        ],
        cells.map(row),
      ),
    );
  }

  function others() {
    const rest = store.server.models.filter((m) => m.name !== session().model && !m.problem);
    if (!rest.length) return null;
    return h(
      "select",
      {
        "aria-label": "compare with another model",
        onchange: attempt(async (event) => {
          if (event.target.value) await compareNow([event.target.value, session().model]);
        }),
      },
      h("option", { value: "" }, "side by side with …"),
      rest.map((m) => h("option", { value: m.name }, m.name)),
    );
  }

  function list(c, failure) {
    if (!c.where_it_fails.length)
      return panel(`In words: ${c.model}`, [], h("p.empty", `${c.nowhere[0].toUpperCase()}${c.nowhere.slice(1)}.`));
    const press = (i) => () => {
      ui.chosen = ui.chosen === i ? null : i;
      draw();
    };
    return panel(
      `In words, worst first: ${c.model}`,
      [
        h("span.faint", "click one: the pictures show its samples"),
        failure &&
          h(
            "button",
            {
              class: "primary push",
              onclick: () => go(c.recording, failure.worst, failure.sentence, failure.intervals),
            },
            "Show in the time history",
          ),
      ],
      h(
        "ol.reasons",
        c.where_it_fails.map((f, i) =>
          h(
            "li",
            h(
              "button",
              { "aria-pressed": String(ui.chosen === i), onclick: press(i) },
              h("span", typeset(f.sentence)),
              share(f),
            ),
          ),
        ),
      ),
    );
  }

  return answerView(root, {
    kind: "compare",
    title: "Where it fails",
    words: "A free run: the model sees deformation and channels, never the reference. residual = measured − model.",
    label: "Compare",
    ask: () => compareNow(),
    never: (s) => `${s.model} has not been compared with ${s.measured.join(", ")} yet.`,
    show(found, title) {
      [answer, head] = [found, title];
      ui.cell = found.cells.length - 1; // the chosen model comes last
      ui.chosen = null;
      draw();
    },
  });
}

const share = (f) =>
  h(
    "span.share",
    h("span", `error ${percent(f.share_of_squared_error)}`),
    bar(f.share_of_squared_error, "error"),
    h("span", `time ${percent(f.share_of_time)}`),
    bar(f.share_of_time, "time"),
  );

function go(recording, [from, to], why, intervals) {
  store.focus = { recording, from, to, why: typeset(why), intervals };
  location.hash = "histories";
}

const goWorst = (c) => go(c.recording, [c.worst.time_s - 2, c.worst.time_s + 2], "worst sample", []);
