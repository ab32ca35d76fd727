// Add it: the error ledger as falling bars, the numbers found, undo, save, compile, report.

import { latest } from "../answers.js";
import { curveChart } from "../charts.js";
import { fill, h, heading, key, panel, table, wideTable } from "../dom.js";
import { beforeAfter } from "../evidence_charts.js";
import { newtons, toldSize, typeset } from "../format.js";
import { askedOf, ledgerBars, ledgerOf, stepOf } from "../ledger.js";
import { compareNow, diagnoseNow, extendWith } from "../steps.js";
import { attempt, byItself, model, report, running, session } from "../store.js";
import { takeBack } from "../way_back.js";
import { removed, WORTH } from "../worth.js";
import { keepJobs, keepPanel } from "./keep.js";

export function add(root) {
  const draw = () => {
    const name = session().model,
      card = model(name);
    fill(
      root,
      heading(
        "Add it",
        "The effect's parameters are estimated together with the model's own, which may move a little. A model that is worse on held-back blocks is refused.",
      ),
      ...(card
        ? [h("div.columns.wide-left", ledger(card), choice(card)), lastStep(card), keepPanel(card)].filter(Boolean)
        : [h("section.panel", h("p.empty", "Choose a model at the top."))]),
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
    const step = stepOf(card.name),
      floor = (askedOf(step) ?? latest("diagnose"))?.floor_n;
    const body = steps.length
      ? ledgerBars(steps, floor)
      : [h("p.empty", "The ledger starts with the first effect that is added; compare first to see where it starts.")];
    return panel(
      "Error ledger",
      [h("span.faint", card.ledger.length ? `RMSE on held-back blocks of ${card.ledger.at(-1).data}` : "RMSE")],
      h("div.body", body),
    );
  }

  function choice(card) {
    const asked = latest("diagnose"),
      busy = Boolean(running("extend"));
    const known = card.effects.map((e) => e.name),
      offers = (asked?.candidates ?? []).filter((c) => !known.includes(c.name));
    const row = (c) => [
      [h("b", c.effect), c.in_verdict ? h("span.chip.role", "in the verdict") : null],
      `${newtons(c.rmse_before_n)} → ${newtons(c.rmse_after_n)}`,
      h(
        "button",
        { class: c.in_verdict ? "primary" : "", disabled: busy, onclick: attempt(() => extendWith([c.name])) },
        "Add",
      ),
    ];
    const rows = offers.filter((c) => c.in_verdict || removed(c) >= WORTH).map(row);
    return panel(
      "Candidates",
      [],
      rows.length
        ? wideTable({}, ["", ["", "num"], ["", "num"]], rows)
        : h(
            "div.empty",
            asked ? "The diagnosis names nothing to add." : "What this new model is missing was not asked yet.",
            h(
              "div",
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

  // what the last step found, and what it gave for what it promised
  function lastStep(card) {
    const r = stepOf(card.name);
    if (!r) return null;
    return panel(
      `Added: ${r.effects.join(", ")}`,
      [
        h(
          "span.push.buttons",
          h("button", { onclick: attempt(() => takeBack(card.name)) }, "Undo"),
          h(
            "button",
            {
              onclick: attempt(async () => {
                location.hash = "fails";
                await compareNow([r.parent, r.model]);
              }),
            },
            "Before and after, in every picture",
          ),
        ),
      ],
      h("div.columns.body", promise(r), numbers(r)),
      h("div.columns.body", pictures(r)),
    );
  }

  function promise(r) {
    const asked = askedOf(r),
      rows = [
        asked ? ["promised on held-back blocks", asked.rmse_before_n, asked.rmse_after_n] : null,
        ["result on held-back blocks", r.rmse_before_n, r.rmse_after_n],
        ...[...new Set((r.heldout ?? []).map((one) => one.recording))].map((name) => [
          `${name}, which nothing was fitted to`,
          ...[r.parent, r.model].map((m) => checkOf(r, name, m)?.rmse_n),
          checkOf(r, name, r.model)?.contradicted,
        ]),
        asked ? ["floor", null, asked.floor_n] : null,
      ].filter(Boolean);
    return h(
      "div",
      h("h3", "Promise and result"),
      table(
        {},
        ["RMS", ["before", "num"], ["after", "num"]],
        rows.map(([name, before, after, bad]) => [
          name,
          before === null ? "" : newtons(before),
          h(bad ? "b.bad" : "b", newtons(after)),
        ]),
      ),
      (r.heldout ?? []).length ? null : h("p.quiet", "No recording to check on was chosen."),
      (r.remarks ?? []).map((line) => h("p.bad", typeset(line))),
    );
  }

  const numbers = (r) =>
    h(
      "div",
      h("h3", "Parameters, ± 95 %"),
      table(
        {},
        ["", ["", "num"]],
        r.estimates.map((p) => [[p.effect, p.said ? "" : [" ", h("b", p.name)]], toldSize(p)]),
      ),
      (r.curves ?? []).map(curveChart),
    );

  // the residual of both models on every recording; filled when the report is here
  function pictures(r) {
    const places = h("div.whole");
    byItself(async () => {
      const { histories } = await report(r.report),
        names = [...new Set(histories.map((one) => one.recording))];
      fill(
        places,
        h(
          "div.pair",
          names.map((name) =>
            beforeAfter(
              ...[r.parent, r.model].map((m) => histories.find((one) => one.recording === name && one.model === m)),
            ),
          ),
        ),
        h("p", key("--ink-3", r.parent), " ", key("--s1", r.model)),
      );
    })();
    return places;
  }

  draw();
  return { update: draw, jobs: keepJobs, about: () => session().measured[0] };
}

const checkOf = (r, name, by) => r.heldout.find((one) => one.recording === name && one.model === by);
