// A log that a daemon is writing, followed: the latest estimates, readings and faults.
import { fill, h, panel } from "../dom.js";
import { number, seconds } from "../format.js";
import { get, query } from "../api.js";
import { attempt } from "../store.js";
import { EngineTile } from "../engine.js";
import { LiveStrip } from "../strip.js";

export function live(body, log) {
  const tiles = new Map(),
    strips = new Map(),
    area = h("div", { class: "engines" }),
    charts = h("div", {}),
    readings = h("tbody", {}),
    faults = h("tbody", {}),
    state = h("span", { class: "quiet", role: "status" }, "waiting for data");
  fill(
    body,
    h("div", { class: "panel" }, h("div", { class: "body" }, state)),
    area,
    charts,
    h(
      "div",
      { class: "columns" },
      panel("Latest readings", [], h("div", { class: "flush" }, h("table", {}, readings))),
      panel("Faults so far", [], h("div", { class: "flush" }, h("table", {}, faults))),
    ),
  );
  let after = 0,
    bytes = -1,
    over = false;

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
    state.textContent = found.latest_ns
      ? `${growing ? "● following" : "○ no new data"}: ${log}, t = ${seconds(found.latest_ns * 1e-9)}`
      : "no estimates in this log yet";
    fill(
      readings,
      Object.entries(found.readings).map(([name, r]) =>
        h(
          "tr",
          {},
          h("td", {}, name),
          h("td", { class: "num" }, number(r.value, 5)),
          h("td", { class: "num faint" }, `${number((found.latest_ns - r.t_ns) * 1e-9, 2)} s old`),
        ),
      ),
    );
    fill(
      faults,
      Object.entries(found.faults).length
        ? Object.entries(found.faults).map(([what, n]) =>
            h("tr", {}, h("td", {}, what), h("td", { class: "num" }, `× ${n}`)),
          )
        : h("tr", {}, h("td", { class: "good" }, "none")),
    );
    timer = setTimeout(look, growing && found.rows.length > 5000 ? 0 : 1000);
  });
  let timer = setTimeout(look, 0);
  return () => {
    over = true;
    clearTimeout(timer);
    for (const strip of strips.values()) strip.close();
  };
}
