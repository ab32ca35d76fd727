// Keep it: save and compile, the file as it lies in the folder, the report.

import { fileUrl } from "../api.js";
import { h, panel, select } from "../dom.js";
import { bytes, newtons } from "../format.js";
import { save } from "../save.js";
import { compiled, compileNow, writeReport } from "../steps.js";
import { attempt, running, store } from "../store.js";

let rate = "1000"; // Hz, as chosen last; PH-LAB's

function reportLabel() {
  const writing = running("report");
  return writing ? `Writing the report: ${Math.round(100 * writing.fraction)} %` : "Write the report (HTML)";
}

// while it is written
export function keepJobs() {
  const button = document.getElementById("report");
  if (button) button.textContent = reportLabel();
}

export function keepPanel(card) {
  const ready = compiled(card.name),
    written = store.server.jobs.find((one) => one.kind === "report" && one.state === "done");
  return panel(
    "Keep it",
    [],
    h(
      "div.body.buttons",
      h(
        "button",
        {
          class: ready ? "" : "primary",
          disabled: Boolean(running("compile")),
          onclick: attempt(() => compileNow(Number(rate))),
        },
        ready ? "Compile again" : "Save and compile",
      ),
      h(
        "label",
        "at the ADC's rate in flight, ",
        select(
          ["100", "500", "1000"].map((hz) => [hz, `${hz} Hz`]),
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
          id: "report",
          disabled: Boolean(running("report")),
          onclick: attempt(writeReport),
        },
        reportLabel(),
      ),
      written
        ? h("a", { href: "api/reports/" + written.result.report, download: "report.html" }, "latest report")
        : null,
    ),
    ready ? file(card, ready) : null,
  );
}

// the model as it lies in the folder, proven to fly
const file = (card, ready) =>
  h(
    "div.body.file",
    h(
      "dl.fields",
      ...[
        ["file", h("code", ready.path)],
        ["size, SHA-256", `${bytes(ready.bytes)}, ${ready.sha256.slice(0, 16)} …`],
        ["witness", `${ready.witness_rows} stored inputs give the stored outputs again, to the bit`],
        ["reads", ready.channels.join(", ")],
        [
          "rate",
          `${ready.rate_hz} Hz; its force there differs by ${newtons(ready.between_rates_n)} at most from that at the bench's rate`,
        ],
        [
          "fly it",
          h("code", `model = "${card.name}"`),
          " in the mount's section of the configuration, with scale_mm and offset_mm of its transducer",
        ],
      ].flatMap(([name, ...said]) => [h("dt", name), h("dd", ...said)]),
    ),
    h("button", { onclick: () => save(fileUrl(card.name), card.name.split("/").pop()) }, "Save a copy elsewhere"),
  );
