// What is missing: the verdict, the ranked candidates with their physics cards, look-alikes, what could not be judged.

import { span } from "../axes.js";
import { dependenceChart } from "../charts.js";
import { described, fill, h, panel, table } from "../dom.js";
import { evidencePictures, residualAxis } from "../evidence_charts.js";
import { newtons, percent, toldSize, typeset } from "../format.js";
import { GRADES } from "../guide.js";
import { bar } from "../ledger.js";
import { diagnoseNow, goAndAdd } from "../steps.js";
import { attempt, store } from "../store.js";
import { removed, WORTH } from "../worth.js";
import { answerView } from "./answer.js";
import { physicsCard } from "./physics_card.js";

export function missing(root) {
  let answer = null,
    head = null,
    open = null,
    all = false;

  function draw() {
    fill(root, head, verdict(answer), evidence(answer), candidates(), dependences(answer), tests(answer), hypothesis());
  }

  function candidates() {
    const worth = answer.candidates.filter((c) => c.in_verdict || removed(c) >= WORTH),
      rest = answer.candidates.filter((c) => !worth.includes(c));

    const heads = [
      "Effect",
      ["Error before", "num"],
      ["after", "num"],
      ["Squared error removed", "removed"],
      ["Parameters, ± 95 %", "estimates"],
      "Looks like",
    ];
    return panel(
      "Candidates, ranked",
      [h("span.faint", "each alone; click one for its physics")],
      h(
        "div.flush",
        worth.length || all ? table({}, heads, [...worth, ...(all ? rest : [])].flatMap(row)) : null,
        rest.length ? idle(rest) : null,
      ),
    );
  }

  const idle = (rest) =>
    h(
      "p.idle",
      h("b", `${rest.length} remove nothing: `),
      rest.map((c) => c.effect).join(", "),
      " ",
      h(
        "button",
        {
          class: "plain",
          "aria-expanded": String(all),
          onclick: () => {
            all = !all;
            draw();
          },
        },
        all ? "fold" : "show their numbers",
      ),
    );

  function row(c) {
    const opened = c.effect === open,
      share = removed(c),
      toggle = () => {
        open = opened ? null : c.effect;
        draw();
      };
    const line = {
      props: {
        class: "pick candidate",
        title: c.card.title,
        tabindex: "0",
        "aria-selected": String(opened),
        "aria-expanded": String(opened),
        onclick: toggle,
        onkeydown: (event) => {
          if (event.key === "Enter" || event.key === " ") {
            event.preventDefault();
            toggle();
          }
        },
      },
      cells: [
        [c.effect, c.in_verdict ? h("span.chip.role", "in the verdict") : null],
        newtons(c.rmse_before_n),
        newtons(c.rmse_after_n),
        share < WORTH ? h("span.faint", "nothing") : [bar(share), h("span.num", percent(share))],
        c.estimates.length
          ? c.estimates.map((p) => h("div", p.said ? toldSize(p) : `${p.name} = ${toldSize(p)}`))
          : h("span.faint", "by a linear look, not fitted"),
        h("td", { title: c.separable_from.join(", ") }, alike(c.separable_from)),
      ],
    };
    return opened ? [line, h("tr", h("td", { colspan: "6" }, physicsCard(c)))] : [line];
  }

  return answerView(root, {
    kind: "diagnose",
    title: "What is missing",
    words:
      "Every absent effect is judged by the error it removes on held-back blocks: parts of the measured recording it is not fitted to, start-up aside.",
    label: "What is missing?",
    ask: diagnoseNow,
    never: (s) => `Nobody has asked yet what ${s.model} lacks on ${s.measured.join(", ")}.`,
    show(found, title) {
      [answer, head, all] = [found, title, false];
      open = found.candidates.find((c) => c.in_verdict)?.effect ?? null;
      draw();
    },
  });
}

// what error is the model's own, and who says so
const own = (a) =>
  `The floor, what instruments and identification leave, is ${newtons(a.floor_n)}.` +
  (a.more_left ? " Something else is missing too." : "");

const capital = (words) => words[0].toUpperCase() + words.slice(1);

const alike = (names) =>
  names.length ? names[0] + (names.length > 1 ? ` and ${names.length - 1} more` : "") : h("span.faint", "–");

// the best set of effects beside the best other one, on the residual of the measured recording itself
function evidence(a) {
  if (!a.evidence?.length) return null;
  const y = residualAxis(a.evidence),
    named = a.candidates.some((c) => c.in_verdict);
  return panel(
    "Evidence on your data",
    [
      h(
        "span.faint",
        a.evidence.length > 1
          ? named
            ? "the verdict, and the best other explanation"
            : "the two best explanations; neither is in the verdict"
          : "",
      ),
    ],
    h(
      "div",
      { class: a.evidence.length > 1 ? "columns body" : "body" },
      a.evidence.map((one) => evidencePictures(one, y)),
    ),
  );
}

function verdict(a) {
  const known = a.verdict.filter((v) => !["none", "unknown"].includes(v)),
    kind = known.length ? "" : a.verdict[0];
  const words = known.length
    ? [h("b", `${newtons(a.rmse_before_n)} → ${newtons(a.rmse_after_n)}`), ` on held-back blocks. ${own(a)}`]
    : kind === "none"
      ? `No absent effect removes enough error to be worth adding. The model leaves ${newtons(a.rmse_before_n)}. ${own(a)}`
      : [
          "Structure is left that no effect of the library explains. The residual follows ",
          h("b", a.depends_on.map((d) => d.channel).join(", ") || "no channel of this file"),
          a.depends_on.length ? "; see its picture below." : ".",
        ];
  const named = a.candidates.filter((c) => c.in_verdict),
    [laws, meant] = [named.map((c) => c.name), named.map((c) => c.card.title)],
    curve = kind === "unknown" ? a.depends_on[0]?.name : null;
  return h(
    "section",
    { class: `panel verdict ${kind}` },
    h(
      "div",
      h("span.quiet", "Verdict"),
      h("br"),
      h("b.name", known.join(" + ") || kind),
      h("div.quiet", meant.join(" + ")),
      kind === "unknown" ? null : h("span", { class: "chip", title: GRADES[a.grade] }, a.grade),
    ),
    h("p", words, known.length ? ` ${capital(GRADES[a.grade])}.` : ""),
    h(
      "div.buttons",
      known.length && laws.length
        ? h("button", { class: "primary", onclick: attempt(() => goAndAdd(laws)) }, `Add ${known.join(" and ")}`)
        : null,
      curve ? h("button", { class: "primary", onclick: attempt(() => goAndAdd([curve])) }, `Add ${curve}`) : null,
      h("button", { onclick: attempt(diagnoseNow) }, "Ask again"),
    ),
  );
}

function dependences(a) {
  if (!a.depends_on.length) return null;
  const y = span(
    a.depends_on.map((d) => [...d.low, ...d.high]),
    0.05,
  );
  return panel(
    "What the residual still follows",
    [
      h(
        "span.faint",
        "mean and 10 to 90 % band; a free curve of the channel would bring the error from the first to the second number",
      ),
    ],
    h(
      "div.columns.three.body",
      a.depends_on.map((d) =>
        h(
          "div",
          h("h3", `${d.channel}: ${newtons(d.rmse_before_n)} → ${newtons(d.rmse_after_n)}`),
          dependenceChart([{ d, color: "--s2" }], y),
        ),
      ),
    ),
  );
}

function tests(a) {
  if (!a.advice.length && !a.not_judged.length) return null;
  return described(
    "What would tell more",
    "",
    a.advice.map((line) => h("p.advice", typeset(line))),
  );
}

function hypothesis() {
  const field = h("input", {
    type: "text",
    size: "42",
    placeholder: "k * dynamic_pressure_Pa",
    "aria-label": "expression over channels",
    value: store.ui.hypothesis ?? "",
    oninput: () => {
      store.ui.hypothesis = field.value; // of what is typed nothing is lost, whatever is drawn anew
    },
  });
  return panel(
    "A hypothesis of your own",
    [
      h(
        "span.faint",
        'an expression over channels, others in quotes: k * "Temp [degC]"; any other name is a number to be estimated',
      ),
    ],
    h(
      "form",
      {
        class: "body toolbar",
        onsubmit: attempt(async (event) => {
          event.preventDefault();
          const said = field.value.trim();
          if (said) await goAndAdd([said]);
        }),
      },
      field,
      h("button", "Try it"),
    ),
  );
}
