// Time histories: measured, models, residual and any channel of one or several recordings, zoomed and marked together.
import { fill, h, panel } from "../dom.js";
import { attempt, order, recording, refresh, running, session, store } from "../store.js";
import { put, query } from "../api.js";
import { FIRST, panelsOf } from "../history_panels.js";
import { Sheet } from "../timeplot.js";
import { askMark, marksTable } from "../marks.js";
import { save, savePicture } from "../save.js";
import { conditionBar } from "../condition.js";

const ui = () =>
  (store.ui.histories ??= { shown: null, models: null, channels: null, hidden: new Set(), hits: new Map() });

export function histories(root) {
  const sheets = new Map(),
    state = ui(),
    asked = new Set();
  const tools = h("div", { class: "panel" }),
    grid = h("div", { class: "columns one" });
  root.append(
    h(
      "div",
      { class: "head" },
      h("h1", {}, "Time histories"),
      h(
        "p",
        {},
        "Drag to zoom, wheel to zoom at the cursor, double click for all, Shift + drag to mark. Keys: ← → + − 0.",
      ),
    ),
    tools,
    grid,
  );

  const recordings = () => {
    const s = session(),
      fallback = [s.measured[0] ?? s.bench[0] ?? store.server.recordings[0]?.name].filter(Boolean);
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
    }
    drawTools();
    const wanted = recordings();
    grid.className = "columns " + (wanted.length > 1 ? "" : "one");
    fill(grid, ...wanted.map(sheetPanel));
    store.focus = null;
  }

  function ready(name) {
    const card = recording(name);
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
    attempt(order)(kind, fields);
  }

  function sheetPanel(name) {
    if (!ready(name))
      return panel(
        name,
        [],
        h(
          "p",
          { class: "empty" },
          running("prepare") ? "Reading the recording and making its zoom pyramid …" : "Not read yet.",
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
          : limits;
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
      },
    });
    state[name] = { range: [...range], limits };
    sheets.set(name, sheet);
    return panel(name, header(name, sheet, focus), h("div", {}, sheet.root), marksList(name));
  }

  // recordings over the same time zoom together
  function link(name, range) {
    if (!state.linked) return;
    for (const [other, sheet] of sheets) if (other !== name && sheet.root.isConnected) sheet.show(range, false);
  }

  function header(name, sheet, focus) {
    const window = () =>
      query({
        recording: name,
        channel: panelsOf(recording(name), [], state.channels).flatMap((p) => p.series.map((s) => s.channel)),
        from: sheet.range[0],
        to: sheet.range[1],
      });
    return [
      focus?.why ? h("span", { class: "quiet" }, focus.why) : null,
      h(
        "span",
        { class: "push buttons" },
        h("button", { onclick: () => sheet.show([...sheet.limits]) }, "Whole record"),
        h("button", { onclick: () => mark(name, ...sheet.range) }, "Mark this window"),
        h("button", { onclick: () => save("api/window.csv?" + window(), "window.csv") }, "CSV of window"),
        h("button", { onclick: () => savePicture(sheet, name) }, "PNG"),
      ),
    ].filter(Boolean);
  }

  function spansOf(name) {
    const hits = (state.hits.get(name) ?? []).map(([from, to]) => ({ from, to, color: "--hit" }));
    return [
      ...hits,
      ...recording(name).marks.map((m) => ({
        from: m.start_s,
        to: m.stop_s,
        color: m.exclude ? "--mark-out" : "--mark",
      })),
    ];
  }

  function mark(name, from, to) {
    askMark(
      name,
      from,
      to,
      attempt(async (made) => setMarks(name, [...recording(name).marks, made])),
    );
  }

  async function setMarks(name, marks) {
    await put("api/marks/" + name.split("/").map(encodeURIComponent).join("/"), JSON.stringify(marks));
    await refresh();
    sheets.get(name)?.reshade();
  }

  const marksList = (name) =>
    marksTable(
      recording(name).marks,
      (m) => sheets.get(name).show([m.start_s, m.stop_s]),
      attempt((marks) => setMarks(name, marks)),
    );

  function drawTools() {
    const toggle = (list, name, on) => (on ? [...list, name] : list.filter((one) => one !== name));
    const checks = (names, chosen, set, note = () => "") =>
      h(
        "div",
        { class: "checks" },
        names.map((name) =>
          h(
            "label",
            {},
            h("input", {
              type: "checkbox",
              checked: chosen.includes(name),
              onchange: (e) => {
                set(toggle(chosen, name, e.target.checked));
                draw();
              },
            }),
            name,
            h("span", { class: "faint" }, note(name)),
          ),
        ),
      );
    const metas = recordings()
        .map(recording)
        .filter((one) => one?.meta),
      units = new Map();
    for (const one of metas) for (const c of one.meta.channels) if (c.name !== "force_N") units.set(c.name, c.unit);
    const shownChannels = state.channels ?? ["deformation_mm", ...FIRST];
    fill(
      tools,
      h(
        "div",
        { class: "body toolbar" },
        pick(
          "Recordings",
          checks(
            store.server.recordings.map((r) => r.name),
            recordings(),
            (v) => {
              state.shown = v;
            },
          ),
          "recordings",
        ),
        pick(
          "Models",
          checks(
            store.server.models.map((m) => m.name),
            models(),
            (v) => {
              state.models = v;
            },
          ),
          "models",
        ),
        pick(
          "Channels",
          checks(
            [...units.keys()],
            shownChannels,
            (v) => {
              state.channels = v;
            },
            (c) => units.get(c),
          ),
          "channels",
        ),
        h(
          "label",
          {},
          h("input", {
            type: "checkbox",
            checked: state.linked,
            onchange: (e) => {
              state.linked = e.target.checked;
            },
          }),
          "zoom recordings together",
        ),
        conditionBar(recordings, models, (found) => {
          state.hits = found;
          for (const sheet of sheets.values()) sheet.reshade();
        }),
      ),
    );
  }

  const pick = (title, content, key) =>
    h(
      "details",
      {
        class: "pickers",
        open: state["open-" + key],
        ontoggle: (e) => {
          state["open-" + key] = e.target.open;
        },
      },
      h("summary", {}, title),
      content,
    );

  let signature = "";
  const look = () =>
    JSON.stringify([
      recordings().map((r) => [r, recording(r)?.meta?.sha256, recording(r)?.models, recording(r)?.marks]),
      models(),
    ]);
  draw();
  signature = look();
  return {
    update() {
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
