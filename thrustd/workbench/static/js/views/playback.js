// A flight played back: a cursor runs through the recorded estimates of both engines.
import { fill, h, panel, select } from "../dom.js";
import { EngineTile, errorPanel, FIELDS, settledAt, thrustPanel, twoFlightsPanel } from "../engine.js";
import { clock, seconds } from "../format.js";
import { fetchWindow, valueAt } from "../lines.js";
import { MountTable } from "../mounts.js";
import { byItself, store } from "../store.js";
import { Sheet } from "../timeplot.js";

const LOOK = 20_000; // points of a look at the whole flight
const BELOW = (engine) => [`n1_pct_${engine}`, "accel_x_g"]; // channels under the thrust
const AHEAD_S = 20; // of playback fetched at once, times its speed

// other: {name, shift(), channels} of a second flight to lie over this one, or null; `body` hears "shift" when it is another
export function playback(body, card, engines, channels, other) {
  const limits = [card.meta.start_s, card.meta.stop_s],
    tiles = engines.map((name) => new EngineTile(name));
  let over = false; // another flight is shown
  const now = { t: limits[0], speed: 5, playing: false, windows: [], until: -1, from: 0 };
  const mounts = [...channels]
    .filter((c) => c.startsWith("mount_force_n_"))
    .map((c) => c.slice("mount_force_n_".length));
  const slider = h("input", {
    type: "range",
    min: limits[0],
    max: limits[1],
    step: "any",
    value: limits[0],
    "aria-label": "time",
    oninput: (event) => {
      now.t = Number(event.target.value);
      tick();
    },
  });
  const button = h(
    "button",
    {
      class: "primary",
      onclick: () => {
        now.playing = !now.playing;
        button.textContent = now.playing ? "Pause" : "Play";
      },
    },
    "Play",
  );
  const at = h("span.num"),
    mountTable = new MountTable();
  const second = other && { recording: other.name, shift: other.shift };
  const panels = engines.flatMap((name) =>
    [
      thrustPanel(name, channels, 170),
      errorPanel(name, channels, 90),
      second && other.channels.has(`estimate_thrust_n_${name}`) ? twoFlightsPanel(name, second, 150) : null,
    ].filter(Boolean),
  );
  const below = BELOW(engines[0]).map((name) => card.meta.channels.find((one) => one.name === name));
  for (const { name: c, meaning, unit } of below.filter(Boolean))
    panels.push({
      title: meaning ? `${c}: ${meaning}` : c,
      unit: unit === "-" ? "" : unit,
      height: 90,
      series: [{ channel: c, label: c, color: "--s4" }],
    });
  const sheet = new Sheet({
    recording: card.name,
    panels,
    limits,
    spans: () => [{ from: now.t, to: now.t, color: "--s2" }],
    sync: "flight",
  });
  fill(
    body,
    h(
      "div.panel",
      h(
        "div.body.playbar",
        button,
        select(
          [
            ["1", "1×"],
            ["5", "5×"],
            ["20", "20×"],
            ["60", "60×"],
          ],
          "5",
          (v) => {
            now.speed = Number(v);
          },
          "speed",
        ),
        slider,
        at,
      ),
    ),
    h(
      "div.engines",
      tiles.map((t) => t.root),
    ),
    panel(card.name, [], sheet.root),
    mountTable.root,
  );

  const wanted = [
    ...engines.map((e) => FIELDS.map((f) => `estimate_${f}_${e}`)),
    mounts.flatMap((m) => [`deformation_mm_${m}`, `mount_force_n_${m}`, `mount_std_n_${m}`]),
  ].filter((list) => list.length);

  async function load() {
    const from = now.t,
      to = Math.min(limits[1], from + AHEAD_S * now.speed);
    [now.from, now.until] = [from, to];
    const windows = await Promise.all(
      wanted.map((list) => fetchWindow(card.name, list, from, Math.max(to, from + 1), 4000)),
    );
    if (over || now.from !== from) return; // the cursor went elsewhere meanwhile, and that is asked for
    now.windows = windows;
    paint();
  }

  function paint() {
    at.textContent = `${clock(now.t - limits[0])} (t = ${seconds(now.t)})`;
    slider.value = now.t;
    engines.forEach((_name, i) => {
      const window = now.windows[i];
      if (!window) return;
      const values = FIELDS.map((field, k) => {
        const hit = valueAt(window, k, now.t);
        return [field, hit ? hit[1] : NaN];
      });
      const since = Object.entries(now.clear?.[i] ?? {}).reduce((bits, [bit, t]) => (now.t < t ? bits | bit : bits), 0);
      tiles[i].show(Object.fromEntries(values), since);
    });
    const last = now.windows[engines.length];
    if (last) mountTable.show(mounts.map((m, i) => [m, [0, 1, 2].map((k) => valueAt(last, 3 * i + k, now.t)?.[1])]));
    sheet.reshade();
  }

  function tick() {
    if (now.t < now.from || now.t >= now.until) byItself(load)();
    else paint();
  }

  // when each engine had its first estimate, before which there is nothing to see, and when each of its status bits was
  // clear for the first time: what is on since the log began is no alarm
  async function begin() {
    const of = (field) => engines.map((e) => `estimate_${field}_${e}`),
      [stds, states] = await Promise.all(
        [of("thrust_std_n"), of("status")].map((list) => fetchWindow(card.name, list, ...limits, LOOK)),
      );
    const when = (window, s, holds) => {
      const at = s.low.findIndex((v, k) => !Number.isNaN(v) && holds(v, s.high[k]));
      return at < 0 ? Infinity : window.time[at];
    };
    if (over) return;
    now.clear = states.series.map((s) =>
      Object.fromEntries(
        Object.keys(store.server.status_words).map((bit) => [bit, when(states, s, (low, high) => !(low & high & bit))]),
      ),
    );
    const first = Math.max(...stds.series.map((s) => when(stds, s, settledAt)));
    if (now.t === limits[0] && first < limits[1]) now.t = first;
    tick();
  }

  body.addEventListener("shift", () => sheet.fetch());
  let before = performance.now();
  const timer = setInterval(() => {
    const present = performance.now();
    if (now.playing) {
      now.t = Math.min(limits[1], now.t + (now.speed * (present - before)) / 1000);
      tick();
    }
    before = present;
  }, 100);
  byItself(begin)();
  byItself(load)();
  return () => {
    over = true;
    clearInterval(timer);
    sheet.close();
  };
}
