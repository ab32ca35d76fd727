// Time histories: measured, models, residual and any channel of one or several recordings, zoomed and marked together.

import { unreadable } from "../answers.js";
import { inUrl, put, query } from "../api.js";
import { fill, h, heading, panel } from "../dom.js";
import { chosenFlight, flights } from "../flights.js";
import { number } from "../format.js";
import { readAddress, writeAddress } from "../history_address.js";
import { bandedOf, panelsOf } from "../history_panels.js";
import { readable, turn, ui } from "../history_state.js";
import { historyTools } from "../history_tools.js";
import { askMark, marksTable } from "../marks.js";
import { save } from "../save.js";
import { attempt, byItself, order, recording, refresh, running, session, store } from "../store.js";
import { Sheet } from "../timeplot.js";

export function histories(root) {
  const sheets = new Map(),
    keys = new Map(),
    state = ui(),
    asked = new Set();
  turn();
  const address = readAddress(); // of somebody else's window, or of this one before the page was loaded again
  if (address.names.length && !store.focus) state.shown = address.names;
  const tools = h("div.panel"),
    grid = h("div.columns.one");
  root.append(
    heading(
      "Time histories",
      "Drag to zoom, wheel to zoom at the cursor, double click for all, Shift + drag to mark. Keys: ← → + − 0.",
    ),
    tools,
    grid,
  );

  const recordings = () => {
    const s = session(),
      first = chosenFlight(flights())?.name ?? store.server.recordings[0]?.name,
      fallback = [readable(state.about) ?? s.measured[0] ?? s.bench[0] ?? first].filter(Boolean);
    const shown = (state.shown ?? fallback).filter((name) => recording(name));
    return shown.length ? shown : fallback;
  };
  const models = () =>
    (state.models ?? [session().model]).filter((name) =>
      store.server.models.some((m) => m.name === name && !m.problem),
    );

  function draw() {
    if (store.focus) {
      if (!recordings().includes(store.focus.recording)) state.shown = [store.focus.recording];
      state.hits = new Map([[store.focus.recording, store.focus.intervals ?? []]]);
      state.why = store.focus.why ?? "";
    }
    drawTools();
    const wanted = recordings(),
      held = [...sheets].find(([, sheet]) => sheet.root === document.activeElement)?.[0];
    grid.className = "columns " + (wanted.length > 1 ? "" : "one");
    fill(
      grid,
      wanted.length
        ? wanted.map(sheetPanel)
        : h("section.panel", h("p.empty", "No recording yet. Drop one anywhere on this page.")),
    );
    sheets.get(held)?.root.focus({ preventScroll: true }); // keys go on to the same plots
    if (!store.focus || sheets.has(store.focus.recording)) store.focus = null; // kept until its recording is read
  }

  function ready(name) {
    const card = recording(name);
    if (!card.meta && card.growing) return false;
    if (!card.meta) {
      want("prepare", { recording: name });
      return false;
    }
    if (!card.meta.channels.some((c) => c.name === "deformation_mm")) return true;
    const missing = models().filter((m) => !(m in (card.models ?? {})));
    if (missing.length) want("simulate", { recording: name, models: missing });
    return true;
  }

  function want(kind, fields) {
    const key = kind + JSON.stringify(fields);
    if (asked.has(key)) return;
    asked.add(key);
    byItself(order)(kind, fields);
  }

  function sheetPanel(name) {
    if (!ready(name))
      return panel(
        name,
        [],
        h(
          "p.empty",
          recording(name).growing
            ? "This log is being written. Follow it under Live and flight; its time histories are here when it is closed."
            : running("prepare")
              ? "Reading the recording and making its zoom pyramid …"
              : unreadable(name) || "Not read yet.",
        ),
      );
    sheets.get(name)?.close();
    const card = recording(name),
      has = models().filter((m) => m in (card.models ?? {}));
    const limits = [card.meta.start_s, card.meta.stop_s];
    const focus = store.focus?.recording === name ? store.focus : null;
    const range =
      focus?.from !== undefined
        ? around(focus, limits)
        : state[name]?.limits?.[1] === limits[1]
          ? state[name].range
          : (address.range ?? limits);
    const sheet = new Sheet({
      recording: name,
      panels: panelsOf(card, has, state.channels),
      limits,
      range: [...range],
      sync: "histories",
      spans: () => spansOf(name),
      onMark: (from, to) => mark(name, from, to),
      onRange: (next) => {
        state[name] = { range: next, limits };
        link(name, next);
        writeAddress(recordings(), next);
      },
    });
    state[name] = { range: [...range], limits };
    sheets.set(name, sheet);
    keys.set(name, h("div.keys", keysOf(name)));
    return panel(name, header(name, sheet), h("div", sheet.root), keys.get(name), marksList(name));
  }

  // recordings over the same time zoom together
  function link(name, range) {
    if (!state.linked) return;
    for (const [other, sheet] of sheets)
      if (other !== name && sheet.root.isConnected) {
        sheet.show(range, false);
        state[other] = { range: sheet.range, limits: sheet.limits }; // drawn anew, it is still where it was zoomed to
      }
  }

  function header(name, sheet) {
    const card = recording(name),
      run = models().filter((m) => m in (card.models ?? {})),
      shown = panelsOf(card, run, state.channels),
      named = (p) => p.series.filter((s) => !s.silent),
      panels = shown.map((p) => ({
        title: p.title,
        channels: named(p)
          .filter((s) => !s.unseen)
          .map((s) => s.channel),
      }));
    const window = () =>
      query({
        recording: name,
        channel: shown.flatMap(named).map((s) => s.channel),
        from: sheet.range[0],
        to: sheet.range[1],
      });
    const figure = (format) =>
      attempt(async () => {
        const [start_s, stop_s] = sheet.range,
          title = `${name}, ${number(start_s, 5)} to ${number(stop_s, 5)} s${run.length ? `: ${run.join(", ")}` : ""}`;
        const job = await order("figure", { recording: name, title, panels, start_s, stop_s, format });
        if (job.state === "done") save("api/reports/" + job.result.report, `${name.replace(/[/.]/g, "-")}.${format}`);
      });
    return [
      h(
        "span.push.buttons",
        h("button", { onclick: () => sheet.show([...sheet.limits]) }, "Whole record"),
        h("button", { onclick: () => mark(name, ...sheet.range) }, "Mark this window"),
        h("button", { onclick: () => save("api/window.csv?" + window(), "window.csv") }, "CSV of window"),
        h("button", { onclick: figure("png"), title: "180 mm wide, 300 dpi" }, "PNG"),
        h("button", { onclick: figure("svg"), title: "180 mm wide" }, "SVG"),
      ),
    ];
  }

  function spansOf(name) {
    return [
      ...(state.hits.get(name) ?? []).map(([from, to]) => ({ from, to, color: "--hit" })),
      ...recording(name).marks.map((m) => ({
        from: m.start_s,
        to: m.stop_s,
        color: m.exclude ? "--mark-out" : "--mark",
      })),
    ];
  }

  // what the shades mean
  function keysOf(name) {
    const { marks, models: run } = recording(name),
      banded = bandedOf(
        recording(name),
        models().filter((m) => m in (run ?? {})),
      ),
      key = (color, ...words) => h("span.shade-key", h("i", { class: color }), ...words);
    return [
      banded ? key("band", `band: 95 % interval of ${banded}, from its error on held-out bench data`) : null,
      state.hits.get(name)?.length ? key("hit", state.why || "chosen samples") : null,
      marks.some((m) => !m.exclude) ? key("mark", "marked") : null,
      marks.some((m) => m.exclude) ? key("out", "excluded from every comparison, diagnosis and fit") : null,
    ];
  }

  function mark(name, from, to) {
    askMark(
      name,
      from,
      to,
      attempt((made) => setMarks(name, (now) => [...now, made])),
    );
  }

  // one after the other: a change is made to the list that holds the one before
  function setMarks(name, change) {
    const kept = async () => {
      const marks = change(recording(name).marks);
      await put("api/marks/" + inUrl(name), JSON.stringify(marks));
      await refresh();
    };
    state.marking = (state.marking ?? Promise.resolve()).then(kept, kept);
    return state.marking;
  }

  const marksList = (name) =>
    marksTable(
      recording(name).marks,
      (m) => sheets.get(name).show([m.start_s, m.stop_s]),
      attempt((change) => setMarks(name, change)),
    );

  let offered = ""; // a limit that is being typed stays while the tools say the same
  function drawTools() {
    const channels = recordings().map((name) => recording(name)?.meta?.channels.map((c) => [c.name, c.unit])),
      names = [store.server.recordings, store.server.models].map((list) => list.map((one) => one.name)),
      now = JSON.stringify([channels, names, recordings(), models(), state.models, state.channels]);
    if (now === offered) return;
    offered = now;
    fill(
      tools,
      historyTools(state, recordings, models, draw, (found, said) => state.shade(found, said)),
    );
  }
  // an answer may come when the screen was left and opened again: it is for the sheets in sight
  state.shade = (found, said) => {
    [state.hits, state.why] = [found, said];
    for (const [name, sheet] of sheets) {
      sheet.reshade();
      fill(keys.get(name), keysOf(name));
    }
  };

  let signature = "";
  const look = () =>
    JSON.stringify([
      recordings().map((r) => [
        r,
        recording(r)?.meta,
        recording(r)?.growing,
        recording(r)?.models,
        recording(r)?.marks,
      ]),
      models(),
    ]);
  draw();
  signature = look();
  return {
    update() {
      turn();
      const now = look();
      if (now !== signature) {
        signature = now;
        draw();
      }
    },
    close() {
      for (const sheet of sheets.values()) sheet.close();
    },
  };
}

function around({ from, to }, limits) {
  const room = Math.max(0.6 * (to - from), 10);
  return [Math.max(limits[0], from - room), Math.min(limits[1], to + room)];
}
