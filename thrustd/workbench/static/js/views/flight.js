// Live and flight: follow a log that a daemon is writing, or play a flight back, with both engines.
import { fill, h, panel, select } from "../dom.js";
import { clock, number, seconds } from "../format.js";
import { get, query } from "../api.js";
import { attempt, order, store } from "../store.js";
import { EngineTile, FIELDS, thrustPanel } from "../engine.js";
import { fetchWindow, valueAt } from "../lines.js";
import { LiveStrip } from "../strip.js";
import { Sheet } from "../timeplot.js";

const AHEAD_S = 20; // of playback fetched at once, times its speed

export function flight(root) {
  const ui = (store.ui.flight ??= { log: null, mode: "play" });
  let stop = () => {};
  const logs = () => store.server.recordings.filter((r) => r.name.endsWith(".mcap"));

  function draw() {
    stop();
    stop = () => {};
    const found = logs(), chosen = found.find((r) => r.name === ui.log) ?? found[0];
    const tools = h("div", { class: "panel" }, h("div", { class: "body toolbar" },
      h("label", {}, "Flight log", select(found.map((r) => [r.name, r.name]), chosen?.name, (v) => { ui.log = v; draw(); }, "flight log")),
      h("button", { "aria-pressed": String(ui.mode === "play"), onclick: () => { ui.mode = "play"; draw(); } }, "Play back"),
      h("button", { "aria-pressed": String(ui.mode === "live"), onclick: () => { ui.mode = "live"; draw(); } }, "Follow live"),
      h("span", { class: "faint" }, "A running daemon's log may be followed while it is being written.")));
    const body = h("div", {});
    fill(root, h("div", { class: "head" }, h("h1", {}, "Live and flight"), h("p", {}, "Fused net thrust of both engines with its 95 % band, the mount and the brochure route, and the state of the sensors.")),
      found.length ? tools : null, body);
    if (!chosen) fill(body, h("section", { class: "panel" }, h("p", { class: "empty" }, "No flight log (MCAP) in this folder. Let thrustd run or thrustd replay write one here.")));
    else if (ui.mode === "live") stop = live(body, chosen.name);
    else stop = play(body, chosen);
  }

  draw();
  return { update: () => { if (ui.waiting || !logs().length) draw(); }, close: () => stop() };

  function play(body, card) {
    ui.waiting = false;
    if (!card.meta) {
      ui.waiting = true;
      const failed = store.server.jobs.find((job) => job.kind === "prepare" && job.state === "failed" && job.arguments.recording === card.name);
      if (!failed && ui.asked !== card.name) { ui.asked = card.name; attempt(order)("prepare", { recording: card.name }); }
      fill(body, h("section", { class: "panel" }, h("p", { class: "empty" }, !failed ? "Reading the flight log …" : "This log could not be read as columns; it may hold raw events only (run thrustd replay on it), or follow it live.")));
      return () => {};
    }
    const channels = new Set(card.meta.channels.map((c) => c.name));
    const engines = [...channels].filter((c) => c.startsWith("estimate_thrust_n_")).map((c) => c.slice("estimate_thrust_n_".length));
    if (!engines.length) { fill(body, h("section", { class: "panel" }, h("p", { class: "empty" }, "No estimates in this log. Run thrustd replay on it to get them."))); return () => {}; }
    return playback(body, card, engines, channels);
  }
}

function playback(body, card, engines, channels) {
  const limits = [card.meta.start_s, card.meta.stop_s], tiles = engines.map((name) => new EngineTile(name));
  const now = { t: limits[0], speed: 5, playing: false, windows: [], until: -1, from: 0 };
  const mounts = [...channels].filter((c) => c.startsWith("mount_force_n_")).map((c) => c.slice("mount_force_n_".length));
  const slider = h("input", { type: "range", min: limits[0], max: limits[1], step: "any", value: limits[0], "aria-label": "time", oninput: (event) => { now.t = Number(event.target.value); tick(); } });
  const button = h("button", { class: "primary", onclick: () => { now.playing = !now.playing; button.textContent = now.playing ? "Pause" : "Play"; } }, "Play");
  const at = h("span", { class: "num" }), table = h("tbody", {});
  const panels = engines.map((name) => thrustPanel(name, channels, 170));
  for (const c of [`n1_pct_${engines[0]}`, "accel_x_g"].filter((one) => channels.has(one))) panels.push({ title: card.meta.channels.find((m) => m.name === c).meaning ? `${c}: ${card.meta.channels.find((m) => m.name === c).meaning}` : c, unit: "", height: 90, series: [{ channel: c, label: c, color: "--s4" }] });
  const sheet = new Sheet({ recording: card.name, panels, limits, spans: () => [{ from: now.t, to: now.t, color: "--s2" }], sync: "flight" });
  fill(body, h("div", { class: "panel" }, h("div", { class: "body playbar" }, button, select([["1", "1×"], ["5", "5×"], ["20", "20×"], ["60", "60×"]], "5", (v) => { now.speed = Number(v); }, "speed"), slider, at)),
    h("div", { class: "engines" }, tiles.map((t) => t.root)), panel(card.name, [], sheet.root),
    mounts.length ? panel("Mounts", [], h("div", { class: "flush" }, h("table", {}, h("thead", {}, h("tr", {}, h("th", {}, "Mount"), h("th", { class: "num" }, "Deformation"), h("th", { class: "num" }, "Thrust share"), h("th", { class: "num" }, "One sigma"))), table))) : null);

  const wanted = [...engines.map((e) => FIELDS.map((f) => `estimate_${f}_${e}`)), mounts.flatMap((m) => [`deformation_mm_${m}`, `mount_force_n_${m}`, `mount_std_n_${m}`])].filter((list) => list.length);

  async function load() {
    const from = now.t, to = Math.min(limits[1], from + AHEAD_S * now.speed);
    [now.from, now.until] = [from, to];
    now.windows = await Promise.all(wanted.map((list) => fetchWindow(card.name, list, from, Math.max(to, from + 1), 4000)));
    paint();
  }

  function paint() {
    at.textContent = `${clock(now.t - limits[0])} (t = ${seconds(now.t)})`;
    slider.value = now.t;
    engines.forEach((name, i) => {
      const window = now.windows[i];
      if (!window) return;
      const values = FIELDS.map((field, k) => { const hit = valueAt(window, k, now.t); return [field, hit ? hit[1] : NaN]; });
      tiles[i].show(Object.fromEntries(values));
    });
    const last = now.windows[engines.length];
    if (last) fill(table, mounts.map((m, i) => h("tr", {}, h("td", {}, m.replace("_", " ")), ...[[0, "mm", 5], [1, "N", 4], [2, "N", 3]].map(([k, unit, digits]) => { const hit = valueAt(last, 3 * i + k, now.t); return h("td", { class: "num" }, hit ? `${number(hit[1], digits)} ${unit}` : "–"); }))));
    sheet.reshade();
  }

  function tick() {
    if (now.t < now.from || now.t >= now.until) attempt(load)(); else paint();
  }

  let before = performance.now();
  const timer = setInterval(() => {
    const present = performance.now();
    if (now.playing) { now.t = Math.min(limits[1], now.t + (now.speed * (present - before)) / 1000); tick(); }
    before = present;
  }, 100);
  attempt(load)();
  return () => { clearInterval(timer); sheet.close(); };
}

function live(body, log) {
  const tiles = new Map(), strips = new Map(), area = h("div", { class: "engines" }), charts = h("div", {}), readings = h("tbody", {}), faults = h("tbody", {}), state = h("span", { class: "quiet", role: "status" }, "waiting for data");
  fill(body, h("div", { class: "panel" }, h("div", { class: "body" }, state)), area, charts,
    h("div", { class: "columns" }, panel("Latest readings", [], h("div", { class: "flush" }, h("table", {}, readings))), panel("Faults so far", [], h("div", { class: "flush" }, h("table", {}, faults)))));
  let after = 0, bytes = -1, over = false;

  const look = attempt(async () => {
    const found = await get("api/live?" + query({ log, after }));
    if (over) return;
    after = found.next;
    for (const row of found.rows) {
      const name = row.topic.replace("/estimate/", "");
      if (!row.topic.startsWith("/estimate/")) continue;
      if (!tiles.has(name)) {
        tiles.set(name, new EngineTile(name));
        strips.set(name, new LiveStrip(name));
        area.append(tiles.get(name).root);
        charts.append(strips.get(name).root);
      }
      strips.get(name).add(row);
      tiles.get(name).latest = row;
    }
    for (const tile of tiles.values()) if (tile.latest) tile.show(tile.latest);
    for (const strip of strips.values()) strip.paint();
    const growing = found.bytes !== bytes;
    bytes = found.bytes;
    state.textContent = found.latest_ns ? `${growing ? "● following" : "○ no new data"}: ${log}, t = ${seconds(found.latest_ns * 1e-9)}` : "no estimates in this log yet";
    fill(readings, Object.entries(found.readings).map(([name, r]) => h("tr", {}, h("td", {}, name), h("td", { class: "num" }, number(r.value, 5)), h("td", { class: "num faint" }, `${number((found.latest_ns - r.t_ns) * 1e-9, 2)} s old`))));
    fill(faults, Object.entries(found.faults).length ? Object.entries(found.faults).map(([what, n]) => h("tr", {}, h("td", {}, what), h("td", { class: "num" }, `× ${n}`))) : h("tr", {}, h("td", { class: "good" }, "none")));
    timer = setTimeout(look, growing && found.rows.length > 5000 ? 0 : 1000);
  });
  let timer = setTimeout(look, 0);
  return () => { over = true; clearTimeout(timer); for (const strip of strips.values()) strip.close(); };
}


