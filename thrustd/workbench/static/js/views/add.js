// Add it: the error ledger as falling bars, the numbers found, undo, save, compile, report.

import { fileUrl, post } from "../api.js";
import { fill, h, panel, select } from "../dom.js";
import { newtons, plusMinus } from "../format.js";
import { latest } from "../guide.js";
import { ledgerBars, ledgerOf } from "../ledger.js";
import { save } from "../save.js";
import { compareNow, diagnoseNow, extendWith } from "../steps.js";
import { attempt, model, order, refresh, running, say, session, store } from "../store.js";
import { removed, WORTH } from "../worth.js";

export function add(root) {
  const draw = () => {
    const name = session().model,
      card = model(name);
    fill(
      root,
      h(
        "div",
        { class: "head" },
        h("h1", {}, "Add it"),
        h(
          "p",
          {},
          "An effect starts at its neutral value, its parameters are estimated, the rest moves gently. A model that is worse on held-back blocks is refused.",
        ),
      ),
      ...(card
        ? [h("div", { class: "columns wide-left" }, ledger(card), choice(card)), lastStep(card), keep(card)].filter(
            Boolean,
          )
        : [h("section", { class: "panel" }, h("p", { class: "empty" }, "Choose a model at the top."))]),
    );
  };

  function ledger(card) {
    const found = ledgerOf(card.name),
      compared = latest("compare");
    const steps = found.length
      ? found
      : compared
        ? [{ name: "as identified", rmse_n: compared.cells.at(-1).rmse_n }]
        : [];
    const body = steps.length
      ? ledgerBars(steps)
      : [
          h(
            "p",
            { class: "empty" },
            "The ledger starts with the first effect that is added; compare first to see where it starts.",
          ),
        ];
    return panel(
      "Error ledger",
      [
        h(
          "span",
          { class: "faint" },
          card.ledger.length ? `RMSE on held-back blocks of ${card.ledger.at(-1).data}` : "RMSE",
        ),
      ],
      h("div", { class: "body" }, body),
    );
  }

  function choice(card) {
    const asked = latest("diagnose"),
      busy = Boolean(running("extend"));
    const known = card.effects.map((e) => e.name),
      offers = (asked?.candidates ?? []).filter((c) => !known.includes(c.name));
    const row = (c) =>
      h(
        "tr",
        {},
        h("td", {}, h("b", {}, c.effect), c.in_verdict ? h("span", { class: "chip role" }, "in the verdict") : null),
        h(
          "td",
          { class: "num" },
          removed(c) < WORTH ? "removes nothing" : `${newtons(c.rmse_before_n)} → ${newtons(c.rmse_after_n)}`,
        ),
        h(
          "td",
          { class: "num" },
          h(
            "button",
            {
              class: c.in_verdict ? "primary" : removed(c) < WORTH ? "plain" : "",
              disabled: busy,
              onclick: attempt(() => extendWith([c.name])),
            },
            "Add",
          ),
        ),
      );
    const rows = offers.map(row);
    return panel(
      "Candidates",
      [],
      rows.length
        ? h("div", { class: "flush" }, h("table", {}, h("tbody", {}, rows)))
        : h(
            "div",
            { class: "empty" },
            asked ? "The diagnosis names nothing to add." : "Ask first what is missing.",
            h(
              "div",
              {},
              h(
                "button",
                {
                  onclick: attempt(async () => {
                    location.hash = "missing";
                    await diagnoseNow();
                  }),
                },
                asked ? "Ask again" : "What is missing?",
              ),
            ),
          ),
    );
  }

  function lastStep(card) {
    const job = store.server.jobs.find(
      (one) => one.kind === "extend" && one.state === "done" && one.result.model === card.name,
    );
    if (!job) return null;
    const r = job.result,
      held = r.heldout ?? [],
      checks = [...new Set(held.map((one) => one.recording))];
    const judged = held.length
      ? held
      : [
          { model: r.parent, rmse_n: r.rmse_before_n },
          { model: r.model, rmse_n: r.rmse_after_n },
        ];
    return panel(
      `What was found: ${r.effects.join(", ")}`,
      [
        h(
          "span",
          { class: "push buttons" },
          h(
            "button",
            {
              onclick: attempt(async () => {
                const kept = await post("api/undo", card.name);
                await refresh();
                say(`${kept.model} is chosen again; ${card.name} was put aside`, "ok");
              }),
            },
            "Undo",
          ),
          h(
            "button",
            {
              onclick: attempt(async () => {
                location.hash = "fails";
                await compareNow([r.parent, r.model]);
              }),
            },
            "Before and after, side by side",
          ),
        ),
      ],
      h(
        "div",
        { class: "columns body" },
        h(
          "div",
          {},
          h("h3", {}, "Parameters"),
          h(
            "table",
            {},
            h(
              "tbody",
              {},
              r.estimates.map((p) =>
                h(
                  "tr",
                  {},
                  h("td", {}, p.effect, " ", h("b", {}, p.name)),
                  h("td", { class: "num" }, plusMinus(p.value, p.std, p.unit)),
                  h("td", { class: "quiet" }, p.expected ? `expected ${p.expected}` : ""),
                ),
              ),
            ),
          ),
        ),
        h(
          "div",
          {},
          h("h3", {}, held.length ? `On ${checks.join(", ")}, which nothing was fitted to` : "On held-back blocks"),
          h(
            "table",
            {},
            h(
              "tbody",
              {},
              judged.map((one) =>
                h(
                  "tr",
                  {},
                  h("td", {}, one.model),
                  checks.length > 1 ? h("td", {}, one.recording) : null,
                  h("td", { class: "num" }, h("b", {}, newtons(one.rmse_n))),
                ),
              ),
            ),
          ),
        ),
      ),
    );
  }

  function keep(card) {
    const ready = store.server.jobs.find(
      (one) => one.kind === "compile" && one.state === "done" && one.result.model === card.name,
    );
    const report = store.server.jobs.find((one) => one.kind === "report" && one.state === "done");
    let rate = "1000";
    return panel(
      "Keep it",
      [],
      h(
        "div",
        { class: "body buttons" },
        h(
          "button",
          { onclick: () => save(fileUrl(card.name), card.name.split("/").pop()) },
          `Save a copy of ${card.name}`,
        ),
        h(
          "button",
          {
            disabled: Boolean(running("compile")),
            onclick: attempt(async () => {
              const job = await order("compile", { model: card.name, rate_hz: Number(rate) });
              if (job.state === "done")
                say(
                  `${card.name} flies: witness rows reproduced, ${job.result.stages} stages at ${job.result.rate_hz} Hz, reads ${job.result.channels.join(", ")}`,
                  "ok",
                );
            }),
          },
          "Compile for flight",
        ),
        h(
          "label",
          {},
          "at ",
          select(
            [
              ["100", "100 Hz"],
              ["500", "500 Hz"],
              ["1000", "1000 Hz"],
            ],
            rate,
            (v) => {
              rate = v;
            },
            "sample rate",
          ),
        ),
        h(
          "button",
          {
            disabled: Boolean(running("report")),
            onclick: attempt(async () => {
              const job = await order("report", { title: card.name });
              if (job.state === "done") save("api/reports/" + job.result.report, "report.html");
            }),
          },
          "Write the report (HTML)",
        ),
        report
          ? h("a", { href: "api/reports/" + report.result.report, download: "report.html" }, "latest report")
          : null,
        ready ? h("span", { class: "good" }, `compiles at ${ready.result.rate_hz} Hz`) : null,
      ),
    );
  }

  draw();
  return { update: draw, jobs: () => {} };
}
