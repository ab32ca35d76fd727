// Where it fails: the numbers, the ranked list in words, and the pictures; a click takes all of them to those samples.
import { fill, h, panel } from "../dom.js";
import { newtons, number, percent, signed } from "../format.js";
import { attempt, report, running, session, store } from "../store.js";
import { span } from "../axes.js";
import { coherenceChart, dependenceChart, loopChart, mapChart, spectrumChart } from "../charts.js";
import { compareNow } from "../steps.js";
import { latest } from "../guide.js";
import { bar } from "../ledger.js";

const SHOWN = 9; // channels drawn, those that carry most of the residual first

export function fails(root) {
  const ui = (store.ui.fails ??= { cell: 0, chosen: null });
  let shown = null,
    answer = null;

  const update = attempt(async () => {
    const found = latest("compare");
    if (!found) {
      empty();
      shown = null;
      return;
    }
    if (found.report === shown) return;
    answer = await report(found.report);
    shown = found.report;
    ui.cell = 0;
    ui.chosen = null;
    draw();
  });

  function empty() {
    const s = session(),
      can = s.model && s.measured.length;
    fill(
      root,
      title(),
      h(
        "section",
        { class: "panel" },
        h(
          "div",
          { class: "empty" },
          can
            ? `${s.model} has not been compared with ${s.measured.join(", ")} yet.`
            : "Choose a model and a measured recording at the top.",
          h(
            "div",
            {},
            h(
              "button",
              { class: "primary", disabled: !can || Boolean(running("compare")), onclick: attempt(() => compareNow()) },
              "Compare",
            ),
          ),
        ),
      ),
    );
  }

  const title = () =>
    h(
      "div",
      { class: "head" },
      h("h1", {}, "Where it fails"),
      h(
        "p",
        {},
        "A free run: the model sees deformation and channels, never the reference. residual = measured − model.",
      ),
    );

  function draw() {
    const c = answer.cells[ui.cell],
      failure = ui.chosen === null ? null : c.where_it_fails[ui.chosen];
    fill(
      root,
      title(),
      answer.cells.length > 1
        ? h(
            "div",
            { class: "buttons" },
            answer.cells.map((one, i) =>
              h(
                "button",
                {
                  "aria-pressed": String(i === ui.cell),
                  onclick: () => {
                    ui.cell = i;
                    ui.chosen = null;
                    draw();
                  },
                },
                `${one.model} on ${one.recording}`,
              ),
            ),
          )
        : null,
      figures(c),
      list(c),
      pictures(c, failure),
    );
  }

  function figures(c) {
    const cell = (value, name) => h("div", { class: "figure" }, h("b", {}, value), h("span", {}, name));
    return panel(
      `${c.model} on ${c.recording}`,
      [
        h(
          "span",
          { class: "push buttons" },
          others(),
          h("button", { onclick: attempt(() => compareNow()) }, "Compare again"),
        ),
      ],
      h(
        "div",
        { class: "figures" },
        cell(newtons(c.rmse_n), "RMSE"),
        cell(newtons(c.mae_n), "mean |error|"),
        cell(c.mae_pct_above_2kn === null ? "–" : number(c.mae_pct_above_2kn, 3) + " %", "mean |error| above 2 kN"),
        cell(signed(c.bias_n, 3) + " N", "bias, measured − model"),
        cell(number(c.fit_pct, 4) + " %", "fit"),
        h(
          "button",
          {
            class: "figure plain",
            title: "show in the time history",
            onclick: () => go(c.recording, c.worst.time_s - 2, c.worst.time_s + 2, "worst sample", []),
          },
          h("b", {}, signed(c.worst.error_n, 3) + " N"),
          h("span", {}, `worst, at ${number(c.worst.time_s, 6)} s ↗`),
        ),
        cell(number(c.autocorrelation["1 s"] ?? NaN, 2), "autocorrelation at 1 s"),
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

  function list(c) {
    if (!c.where_it_fails.length)
      return panel(
        "In words",
        [],
        h("p", { class: "empty" }, "Nowhere in particular: the error is spread as evenly as the time."),
      );
    const rows = c.where_it_fails.map((f, i) =>
      h(
        "li",
        {},
        h(
          "button",
          {
            "aria-pressed": String(ui.chosen === i),
            onclick: () => {
              ui.chosen = ui.chosen === i ? null : i;
              draw();
            },
          },
          h("span", {}, f.sentence),
          share(f),
        ),
      ),
    );
    const failure = ui.chosen === null ? null : c.where_it_fails[ui.chosen];
    return panel(
      "In words, worst first",
      [
        h("span", { class: "faint" }, "click one: the pictures show its samples"),
        h(
          "span",
          { class: "push" },
          failure
            ? h(
                "button",
                {
                  class: "primary",
                  onclick: () => go(c.recording, ...failure.worst, failure.sentence, failure.intervals),
                },
                "Show in the time history",
              )
            : null,
        ),
      ],
      h("ol", { class: "reasons" }, rows),
    );
  }

  const share = (f) =>
    h(
      "span",
      { class: "share" },
      h("span", {}, `error ${percent(f.share_of_squared_error)}`),
      bar(f.share_of_squared_error, "error"),
      h("span", {}, `time ${percent(f.share_of_time)}`),
      bar(f.share_of_time, "time"),
    );

  function go(recording, from, to, why, intervals) {
    store.focus = { recording, from, to, why, intervals };
    location.hash = "histories";
  }

  function pictures(c, failure) {
    const spread = (d) => Math.max(...d.mean) - Math.min(...d.mean),
      y = span(
        c.dependences.map((d) => [...d.low, ...d.high]),
        0.04,
      );
    const most = [...c.dependences].sort((a, b) => spread(b) - spread(a)).slice(0, SHOWN);
    const focus = (d) => failure?.dependences.find((one) => one.channel === d.channel) ?? null;
    return h(
      "div",
      {},
      panel(
        "Residual against each channel",
        [h("span", { class: "faint" }, `mean and 10 to 90 % band${failure ? "; blue: the chosen samples" : ""}`)],
        h(
          "div",
          { class: "columns three body" },
          most.map((d) => dependenceChart(d, focus(d), y)),
        ),
      ),
      h(
        "div",
        { class: "columns" },
        panel(
          "Force over deformation, coloured by error",
          [],
          h("div", { class: "body" }, loopChart(c.loop, ui.chosen)),
        ),
        panel("Error over force and rate", [], h("div", { class: "body" }, mapChart(c.map, failure?.map))),
      ),
      h(
        "div",
        { class: "columns" },
        panel("Spectrum of the residual", [], h("div", { class: "body" }, spectrumChart(c.spectrum))),
        panel(
          "Correlation by frequency",
          [h("span", { class: "faint" }, "the five most coherent channels")],
          h("div", { class: "body" }, coherenceChart(c.spectrum)),
        ),
      ),
      panel("By region", [], h("div", { class: "flush" }, regions(c))),
    );
  }

  update();
  return {
    update,
    jobs: () => {
      if (!shown) update();
    },
  };
}

function regions(c) {
  return h(
    "table",
    {},
    h(
      "thead",
      {},
      h(
        "tr",
        {},
        h("th", {}, "Region"),
        h("th", { class: "num" }, "RMSE"),
        h("th", { class: "num" }, "Bias"),
        h("th", { class: "num" }, "Share of squared error"),
        h("th", { class: "num" }, "Share of time"),
      ),
    ),
    h(
      "tbody",
      {},
      c.regions.map((r, i) =>
        h(
          "tr",
          {},
          h("td", {}, i && c.regions[i - 1].dimension === r.dimension ? "" : h("b", {}, r.dimension + ": "), r.region),
          h("td", { class: "num" }, newtons(r.rmse_n)),
          h("td", { class: "num" }, signed(r.bias_n) + " N"),
          h("td", { class: "num" }, percent(r.share_of_squared_error)),
          h("td", { class: "num" }, percent(r.share_of_time)),
        ),
      ),
    ),
  );
}
