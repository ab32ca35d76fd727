// A log that a daemon is writing, followed: the latest estimates, readings and faults.

import { get, Problem, query } from "../api.js";
import { fill, h, panel } from "../dom.js";
import { EngineTile } from "../engine.js";
import { count, number } from "../format.js";
import { MountTable } from "../mounts.js";
import { LiveStrip } from "../strip.js";

const EVERY_MS = 1000;
const OLD_S = 2; // a reading that has not come for this long is said to be old

export function live(body, log, state) {
  const tiles = new Map(),
    strips = new Map(),
    area = h("div.engines"),
    charts = h("div.columns.wide"),
    mounts = new Map(),
    mountTable = new MountTable(),
    readings = h("div.readings"),
    faults = h("div.readings");
  state.textContent = "waiting for data";
  fill(
    body,
    area,
    charts,
    mountTable.root,
    panel("Latest readings", [h("span.faint", "name with its unit, value, age")], readings),
    panel("Faults so far", [], faults),
  );
  body.hidden = true; // until there is something to show
  let after = 0,
    bytes = -1,
    over = false;

  async function look() {
    try {
      await read();
    } catch (problem) {
      if (!(problem instanceof Problem)) console.error(problem);
      state.textContent = `○ ${problem.message}`;
      again(EVERY_MS); // a server that is gone may come back
    }
  }
  const again = (ms) => {
    if (!over) timer = setTimeout(look, ms);
  };
  async function read() {
    const found = await get("api/live?" + query({ log, after }));
    if (over) return;
    after = found.next;
    body.hidden = false;
    for (const row of found.rows) {
      const [, kind, name] = row.topic.split("/");
      if (kind === "mount") mounts.set(name, [row.deformation_mm, row.force_n, row.std_n]);
      if (kind !== "estimate") continue;
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
    mountTable.show([...mounts].sort());
    const growing = found.bytes !== bytes;
    bytes = found.bytes;
    state.textContent = found.latest_ns
      ? `${growing ? "● following" : "○ no new data"}, log time ${(found.latest_ns * 1e-9).toFixed(1)} s`
      : "no estimates in this log yet";
    fill(
      readings,
      Object.entries(found.readings).map(([name, r]) => reading(name, r, found.latest_ns)),
    );
    const said = Object.entries(found.faults);
    fill(
      faults,
      said.length
        ? said.map(([what, n]) => h("div", h("span", what), h("b.num", `× ${count(n)}`)))
        : h("div", h("span.good", "none")),
    );
    again(growing && found.rows.length > 5000 ? 0 : EVERY_MS);
  }
  let timer = setTimeout(look, 0);
  return () => {
    over = true;
    clearTimeout(timer);
    for (const strip of strips.values()) strip.close();
  };
}

function reading(name, { value, t_ns }, latest_ns) {
  const age_s = Math.max(0, (latest_ns - t_ns) * 1e-9);
  return h(
    "div",
    h("span", name.replace("/", " ")),
    h("b.num", number(value, 4)),
    h("span", { class: `num ${age_s > OLD_S ? "warn" : "faint"}` }, `${age_s.toFixed(1)} s`),
  );
}
