// Overview: what the folder holds, the exercise, and the error ledger of every model.
import { unreadable } from "../answers.js";
import { fill, h, heading, panel, select, wideTable } from "../dom.js";
import { addFiles } from "../drop.js";
import { channelsOf, hasEstimates, isLog } from "../flights.js";
import { bytes, count, duration, hertz, newtons, number } from "../format.js";
import { bar, ledgerOf } from "../ledger.js";
import { attempt, choose, running, session, store } from "../store.js";
import { columnsPanel, nameColumns } from "./columns_panel.js";
import { exercisePanel } from "./exercise.js";

export function overview(root) {
  store.ui.panel?.again();
  const draw = () => {
    const { recordings, models } = store.server,
      named = recordings.some((one) => one.name === store.ui.columns && one.table) ? store.ui.columns : null;
    // of the file whose columns are being said; what is half said stays when another screen is looked at meanwhile
    const { panel: shown } = store.ui;
    if (named !== shown?.name || shown?.saidElsewhere()) store.ui.panel = named && columnsPanel(named);
    fill(
      root,
      heading("Overview", "Recordings and models of the folder. The page and the command line read the same files."),
      store.ui.panel?.root,
      panel(
        `Recordings (${recordings.length})`,
        [h("span.push"), picker()],
        recordings.length
          ? recordingTable(recordings)
          : h("p.empty", "None yet. Drop CSV, Parquet, MCAP, npz or MATLAB files anywhere on this page."),
      ),
      panel(
        `Models (${models.length})`,
        [],
        models.length
          ? modelTable(models)
          : h("p.empty", "None yet. Identify one from a bench recording, or drop a model file (JSON)."),
      ),
      exercisePanel(),
    );
  };
  draw();
  document.addEventListener("columns", draw);
  return { update: draw, jobs: () => {}, close: () => document.removeEventListener("columns", draw) };
}

function picker() {
  const input = h("input", {
    type: "file",
    multiple: true,
    hidden: true,
    onchange: (event) => addFiles([...event.target.files]),
    "aria-label": "add files",
  });
  return h("span", input, h("button", { onclick: () => input.click() }, "Add files …"));
}

const ROLES = [
  ["bench", "bench"],
  ["measured", "measured"],
  ["heldout", "check on"],
];

// what a recording is used for, chosen where it stands
function role(name) {
  const s = session(),
    now = ROLES.find(([field]) => s[field].includes(name))?.[0] ?? "";
  const change = (field) => {
    const others = ROLES.filter(([one]) => one !== field && s[one].includes(name)).map(([one]) => [one, []]);
    return attempt(choose)({ ...Object.fromEntries(others), ...(field ? { [field]: [name] } : {}) });
  };
  return select([["", "–"], ...ROLES], now, change, `use of ${name}`);
}

function recordingTable(recordings) {
  const rows = recordings.map((one) => {
    const meta = one.meta,
      channels = meta?.channels ?? [];
    const focus = () => {
      store.focus = { recording: one.name };
    };
    return [
      [
        h("a", { href: "#histories", onclick: focus }, one.name),
        h("div.bad", one.problem || unreadable(one.name)),
        meta?.notes.length ? remarks(one.name, meta.notes) : null,
      ],
      role(one.name),
      length(one),
      meta ? count(meta.samples) : "",
      meta ? hertz(meta.sample_hz) : "",
      [
        meta
          ? folded(
              `channels of ${one.name}`,
              "details",
              h("summary", `${channels.length} channels${telling(one)}`),
              h(
                "div.chips",
                channels.map((c) => h("span", { class: "chip", title: c.meaning }, c.name)),
              ),
            )
          : "",
        one.table
          ? h(
              "button",
              { class: meta ? "plain" : "primary", onclick: () => nameColumns(one.name) },
              one.mapped.columns?.length ? "Edit columns" : "Columns …",
            )
          : null,
      ],
      String(one.marks.length || ""),
      bytes(one.bytes),
    ];
  });
  return wideTable(
    { class: "recordings" },
    [
      "Recording",
      "Use",
      ["Length", "num"],
      ["Samples", "num"],
      ["Rate", "num"],
      ["Channels", "channels"],
      ["Marks", "num"],
      ["File", "num"],
    ],
    rows,
  );
}

// what a recording is good for
function telling(one) {
  if (channelsOf(one).includes("force_N")) return ", with force_N";
  return hasEstimates(one) ? ", with estimates" : isLog(one) ? ", raw log" : "";
}

function length({ name, meta, growing }) {
  if (meta) return duration(meta.stop_s - meta.start_s);
  if (growing) return "being written";
  return running("prepare")?.arguments.recording === name ? "reading …" : "–";
}

// what was unfolded stays so when the table is drawn anew
function folded(name, kind, ...held) {
  const opened = (store.ui.opened ??= new Set());
  const ontoggle = ({ target }) => (target.open ? opened.add(name) : opened.delete(name));
  return h(kind, { open: opened.has(name), ontoggle }, ...held);
}

// one remark is said, many are folded
const remarks = (name, notes) =>
  notes.length === 1
    ? h("div.faint", notes[0])
    : folded(
        `remarks on ${name}`,
        "details.faint",
        h("summary", `${notes.length} remarks on what was read`),
        h(
          "ul",
          notes.map((note) => h("li", note)),
        ),
      );

function modelTable(models) {
  const rows = models.map((one) => ({
    props: {
      "aria-selected": String(one.name === session().model),
      class: "pick",
      onclick: () => attempt(choose)({ model: one.name }),
    },
    cells: [
      [
        h("button", { class: "plain", "aria-pressed": String(one.name === session().model) }, one.name),
        one.problem ? h("div.bad", one.problem) : null,
      ],
      one.structure,
      h("div.chips", one.effects.length ? one.effects.map((e) => h("span.chip", e.name)) : h("span.faint", "none")),
      one.problem ? "" : `${number(one.force_n[0], 3)} to ${number(one.force_n[1], 4)} N`,
      ledgerCell(one.name),
    ],
  }));
  return wideTable(
    {},
    [["Model", "name"], "Structure", "Effects", ["Valid force", "num"], "Error ledger: RMSE on held-back blocks"],
    rows,
  );
}

function ledgerCell(name) {
  const steps = ledgerOf(name),
    top = Math.max(...steps.map((s) => s.rmse_n), 1);
  if (!steps.length) return h("span.faint", "as identified");
  return h(
    "div",
    steps.map((s) => h("div.ledger-line", h("span", s.name), h("span.num", newtons(s.rmse_n)), bar(s.rmse_n / top))),
  );
}
