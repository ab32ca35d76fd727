// What is missing: the verdict, the ranked candidates with their physics cards, look-alikes, what could not be judged.
import { fill, h, panel } from "../dom.js";
import { newtons, number } from "../format.js";
import { attempt, report, running, session, store } from "../store.js";
import { span } from "../axes.js";
import { dependenceChart } from "../charts.js";
import { diagnoseNow, extendWith } from "../steps.js";
import { latest } from "../guide.js";
import { bar } from "../ledger.js";
import { physicsCard } from "./physics_card.js";

export function missing(root) {
  const ui = (store.ui.missing ??= { open: null });
  let shown = null,
    answer = null;

  const update = attempt(async () => {
    const found = latest("diagnose");
    if (!found) {
      empty();
      shown = null;
      return;
    }
    if (found.report === shown) return;
    answer = await report(found.report);
    shown = found.report;
    ui.open = answer.candidates[0]?.effect ?? null;
    draw();
  });

  const title = () =>
    h(
      "div",
      { class: "head" },
      h("h1", {}, "What is missing"),
      h(
        "p",
        {},
        "Every absent effect is judged by the error it would remove on held-back blocks, beyond what the present parameters can absorb.",
      ),
    );

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
            ? `Nobody has asked yet what ${s.model} lacks on ${s.measured.join(", ")}.`
            : "Choose a model and a measured recording at the top.",
          h(
            "div",
            {},
            h(
              "button",
              { class: "primary", disabled: !can || Boolean(running("diagnose")), onclick: attempt(diagnoseNow) },
              "What is missing?",
            ),
          ),
        ),
      ),
    );
  }

  function draw() {
    fill(root, title(), verdict(), ...[candidates(), dependences(), tests(), hypothesis()].filter(Boolean));
  }

  function verdict() {
    const a = answer,
      known = a.verdict.filter((v) => !["none", "unknown"].includes(v));
    const kind = known.length ? "" : a.verdict[0];
    const name = known.length ? known.join(" + ") : kind === "none" ? "none" : "unknown";
    const words = known.length
      ? [
          h("b", {}, `${newtons(a.rmse_before_n)} → ${newtons(a.rmse_after_n)}`),
          ` on held-back blocks. The model leaves ${newtons(a.own_error_n)} where nothing is missing.`,
        ]
      : kind === "none"
        ? `Nothing absent removes enough error to be worth adding. The model leaves ${newtons(a.rmse_before_n)} here and ${newtons(a.own_error_n)} where nothing is missing.`
        : [
            `Structure is left that no effect of the library explains. The residual follows `,
            h("b", {}, a.depends_on.map((d) => d.channel).join(", ") || "no channel of this file"),
            "; see its picture below.",
          ];
    return h(
      "section",
      { class: `panel verdict ${kind}` },
      h("div", {}, h("span", { class: "quiet" }, "Verdict"), h("br"), h("b", { class: "name" }, name)),
      h("p", {}, words),
      h(
        "div",
        { class: "buttons" },
        known[0] ? addButton(a.candidates.find((c) => c.effect === known[0])) : null,
        h("button", { onclick: attempt(diagnoseNow) }, "Ask again"),
      ),
    );
  }

  const addButton = (c) =>
    h(
      "button",
      {
        class: "primary",
        onclick: attempt(async () => {
          location.hash = "add";
          await extendWith(c.name);
        }),
      },
      `Add ${c.effect}`,
    );

  function candidates() {
    const rows = answer.candidates.flatMap((c) => {
      const open = c.effect === ui.open,
        row = h(
          "tr",
          {
            class: "pick candidate",
            tabindex: "0",
            "aria-selected": String(open),
            "aria-expanded": String(open),
            onclick: () => toggle(c),
            onkeydown: (event) => {
              if (event.key === "Enter" || event.key === " ") {
                event.preventDefault();
                toggle(c);
              }
            },
          },
          h("td", {}, c.effect, c.in_verdict ? h("span", { class: "chip role" }, "in the verdict") : null),
          h("td", { class: "num" }, newtons(c.rmse_before_n)),
          h("td", { class: "num" }, newtons(c.rmse_after_n)),
          h("td", { class: "removed" }, bar(Math.max(0, 1 - (c.rmse_after_n / c.rmse_before_n) ** 2))),
          h(
            "td",
            {},
            c.estimates.map((p) => h("div", {}, estimate(p))),
          ),
          h("td", {}, c.separable_from.length ? c.separable_from.join(", ") : h("span", { class: "faint" }, "–")),
        );
      return open ? [row, h("tr", {}, h("td", { colspan: "6" }, physicsCard(c)))] : [row];
    });
    return panel(
      "Candidates, ranked",
      [h("span", { class: "faint" }, "click one for its physics")],
      h(
        "div",
        { class: "flush" },
        h(
          "table",
          {},
          h(
            "thead",
            {},
            h(
              "tr",
              {},
              h("th", {}, "Effect"),
              h("th", { class: "num" }, "Error before"),
              h("th", { class: "num" }, "after"),
              h("th", {}, "Squared error removed"),
              h("th", {}, "Parameters"),
              h("th", {}, "Looks like"),
            ),
          ),
          h("tbody", {}, rows),
        ),
      ),
    );
  }

  function toggle(c) {
    ui.open = ui.open === c.effect ? null : c.effect;
    draw();
  }

  const estimate = (p) =>
    `${p.name} = ${number(p.value, 4)} ± ${number(p.std, 2)}${p.unit && p.unit !== "-" ? " " + p.unit : ""}`;

  function dependences() {
    if (!answer.depends_on.length) return null;
    const y = span(
      answer.depends_on.map((d) => [...d.low, ...d.high]),
      0.05,
    );
    return panel(
      "What the residual still follows",
      [
        h(
          "span",
          { class: "faint" },
          "mean and 10 to 90 % band; a free curve of the channel would bring the error from the first to the second number",
        ),
      ],
      h(
        "div",
        { class: "columns three body" },
        answer.depends_on.map((d) =>
          h(
            "div",
            {},
            h("h3", {}, `${d.channel}: ${newtons(d.rmse_before_n)} → ${newtons(d.rmse_after_n)}`),
            dependenceChart(d, null, y),
          ),
        ),
      ),
    );
  }

  function tests() {
    const a = answer;
    if (!a.advice.length && !a.not_judged.length) return null;
    return panel(
      "What would tell more",
      [],
      h(
        "div",
        { class: "body" },
        a.advice.map((line) => h("p", { class: "advice" }, line)),
        a.not_judged.length
          ? h(
              "p",
              { class: "quiet" },
              "Could not be judged: " + a.not_judged.map((n) => `${n.effect} (${n.reason})`).join("; "),
            )
          : null,
      ),
    );
  }

  function hypothesis() {
    const field = h("input", {
      type: "text",
      size: "42",
      placeholder: "k * dynamic_pressure_Pa",
      "aria-label": "expression over channels",
    });
    return panel(
      "A hypothesis of your own",
      [h("span", { class: "faint" }, "an expression over channels; names that are not channels are estimated")],
      h(
        "form",
        {
          class: "body toolbar",
          onsubmit: attempt(async (event) => {
            event.preventDefault();
            const said = field.value.trim();
            if (said) {
              location.hash = "add";
              await extendWith(said);
            }
          }),
        },
        field,
        h("button", {}, "Try it"),
      ),
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
