// Filter by condition: "unloading, below 2 kN". The worker says which stretches those are and how large the error is there.
import { h, select } from "./dom.js";
import { newtons, percent } from "./format.js";
import { attempt, order, recording, report } from "./store.js";

// asked: what was typed and what was answered, kept while the page is drawn anew
export function conditionBar(asked, recordings, models, show) {
  const known = [...new Set(recordings().flatMap((name) => recording(name)?.meta?.channels.map((c) => c.name) ?? []))];
  if (!known.includes("force_N") || !models().length) return h("span");
  if (!known.includes(asked.channel)) asked.channel = "force_N";
  const said = (asked.said ??= h("span", { class: "quiet", role: "status" }));
  const number = (field, label) =>
    h("input", {
      type: "number",
      step: "any",
      value: asked[field],
      placeholder: label,
      "aria-label": `${label} limit`,
      oninput: (event) => {
        asked[field] = event.target.value;
      },
    });
  const go = attempt(async () => {
    const limit = (text) => (text === "" ? null : Number(text)),
      turn = (asked.turn = (asked.turn ?? 0) + 1);
    const words = [asked.phase, asked.low !== "" || asked.high !== "" ? `${asked.channel} ${between(asked)}` : ""];
    const job = await order("compare", {
      models: models(),
      recordings: recordings(),
      condition: { channel: asked.channel, low: limit(asked.low), high: limit(asked.high), phase: asked.phase },
    });
    if (job.state !== "done") return;
    const found = await report(job.result.report);
    if (turn !== asked.turn) return; // cleared, or another one is asked for
    show(new Map(Object.entries(found.condition.intervals)), "condition: " + words.filter(Boolean).join(", "));
    const errors = found.cells.map((c) => newtons(c.rmse_n)).join(", ");
    said.textContent = `${percent(found.condition.time_share)} of the time; RMSE there ${errors}`;
  });
  return h(
    "form",
    {
      class: "toolbar",
      onsubmit: (event) => {
        event.preventDefault();
        go();
      },
    },
    h(
      "label",
      "Condition",
      select(
        [
          ["", "any force"],
          ["loading", "loading"],
          ["unloading", "unloading"],
        ],
        asked.phase,
        (v) => {
          asked.phase = v;
        },
        "phase",
      ),
    ),
    select(
      known.map((c) => [c, c]),
      asked.channel,
      (v) => {
        asked.channel = v;
      },
      "condition channel",
    ),
    number("low", "from"),
    number("high", "to"),
    h("button", "Show"),
    h(
      "button",
      {
        type: "button",
        class: "plain",
        onclick: () => {
          asked.turn = (asked.turn ?? 0) + 1;
          show(new Map(), "");
          said.textContent = "";
        },
      },
      "clear",
    ),
    said,
  );
}

function between({ low, high }) {
  if (low === "") return `up to ${high}`;
  return high === "" ? `from ${low}` : `from ${low} to ${high}`;
}
