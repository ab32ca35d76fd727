// Live and flight: follow a log that a daemon is writing, or play a flight back, with both engines.

import { unreadable } from "../answers.js";
import { query } from "../api.js";
import { fill, h, heading, offer, select } from "../dom.js";
import { channelsOf, chooseFlight, chosenFlight, isLog } from "../flights.js";
import { fetchWindow, valueAt } from "../lines.js";
import { attempt, byItself, order, store } from "../store.js";
import { live } from "./live.js";
import { playback } from "./playback.js";
import { replayFirst } from "./raw_log.js";

export function flight(root) {
  const ui = (store.ui.flight ??= { mode: null });
  let stop = () => {},
    shown, // the log that is looked at
    seen, // the logs that are offered
    renew = []; // what offers them, to be done again when others have come
  const logs = () => store.server.recordings.filter(isLog),
    stamp = () => JSON.stringify(logs().map((r) => [r.name, r.growing, Boolean(r.meta)]));

  function draw() {
    const settled = !ui.waiting; // what was shown before it was read gives way to a log with estimates
    stop();
    stop = () => {};
    ui.waiting = false;
    renew = [];
    seen = stamp();
    const found = logs(),
      chosen = chosenFlight(found, settled ? shown : null),
      mode = ui.mode ?? (chosen?.growing ? "live" : "play");
    shown = chosen?.name;
    const state = h("span", { class: "quiet", role: "status" });
    const tools = h(
      "div.panel",
      h(
        "div.body.toolbar",
        h(
          "label",
          "Flight log",
          offered(
            () => logs().map(option),
            shown,
            (v) => {
              chooseFlight(v);
              draw();
            },
            "flight log",
          ),
        ),
        h(
          "button",
          {
            "aria-pressed": String(mode === "play"),
            onclick: () => {
              ui.mode = "play";
              draw();
            },
          },
          "Play back",
        ),
        h(
          "button",
          {
            "aria-pressed": String(mode === "live"),
            onclick: () => {
              ui.mode = "live";
              draw();
            },
          },
          "Follow live",
        ),
        mode === "play" ? beside(chosen, (shift_s) => shifted(body, shift_s)) : null,
        chosen?.meta
          ? h(
              "a",
              { href: "api/foxglove?" + query({ log: chosen.name }), download: "foxglove-layout.json" },
              "Foxglove layout",
            )
          : null,
        state,
      ),
    );
    const body = h("div");
    fill(
      root,
      heading(
        "Live and flight",
        "Fused net thrust of both engines with its 95 % band, the mount and the brochure source, and the state of the sensors.",
      ),
      found.length ? tools : null,
      body,
    );
    if (!chosen)
      fill(body, words("No flight log (MCAP) in this folder. Let thrustd run or thrustd replay write one here."));
    else if (mode === "live") stop = live(body, chosen.name, state);
    else stop = play(body, chosen);
  }

  // the same flights, shifted otherwise: the cursor stays where it is, and a button that is being pressed what it is
  function shifted(body, shift_s) {
    ui.shift_s = shift_s;
    body.dispatchEvent(new CustomEvent("shift"));
  }

  // a second flight to lie over the first, and by how much it is shifted
  function beside(chosen, say) {
    const others = () => logs().filter((r) => r.name !== shown && r.meta),
      other = others().find((r) => r.name === ui.other);
    const shift = h("input", {
      type: "number",
      step: "any",
      value: ui.shift_s ?? 0,
      "aria-label": "time shift in seconds",
      onchange: (event) => say(Number(event.target.value) || 0),
    });
    const tools = h(
      "span.toolbar",
      h(
        "label",
        "Over it",
        offered(
          () => [["", "no other flight"], ...others().map(option)],
          other?.name ?? "",
          (name) => {
            ui.other = name;
            draw();
          },
          "second flight",
        ),
      ),
      other ? h("label", "shifted by", shift, "s") : null,
      other
        ? h(
            "button",
            {
              onclick: attempt(async () => {
                const typed = shift.value,
                  found_s = await bestShift(chosen, other);
                if (!shift.isConnected || shift.value !== typed) return; // other flights or another shift since
                shift.value = found_s;
                say(found_s);
              }),
            },
            "Align",
          )
        : null,
    );
    const show = () => {
      tools.hidden = !others().length;
    };
    show();
    renew.push(show);
    return tools;
  }

  // a list that is added to when new logs come; what is played or followed meanwhile goes on
  function offered(options, chosen, pick, label) {
    const list = select(options(), chosen, pick, label);
    renew.push(() => offer(list, options()));
    return list;
  }

  draw();
  return {
    update: () => {
      if (ui.waiting || !logs().some((r) => r.name === shown)) draw();
      else if (stamp() !== seen) {
        seen = stamp();
        for (const again of renew) again();
      }
    },
    jobs: () => {
      if (ui.waiting) draw();
    },
    about: () => shown,
    close: () => stop(),
  };

  function play(body, card) {
    ui.waiting = !card.meta;
    if (card.growing) {
      ui.waiting = true;
      fill(body, words("This log is being written: follow it live. It can be played back when it is closed."));
      return () => {};
    }
    if (!card.meta) {
      const failed = unreadable(card.name);
      if (!failed && ui.asked !== card.name) {
        ui.asked = card.name;
        byItself(order)("prepare", { recording: card.name });
      }
      fill(
        body,
        words(!failed ? "Reading the flight log …" : `${failed}. It cannot be played back; it may be followed.`),
      );
      return () => {};
    }
    const channels = new Set(channelsOf(card));
    const engines = [...channels]
      .filter((c) => c.startsWith("estimate_thrust_n_"))
      .map((c) => c.slice("estimate_thrust_n_".length));
    if (!engines.length) {
      ui.waiting = true;
      fill(body, words(replayFirst(card.name)));
      return () => {};
    }
    const other = store.server.recordings.find((r) => r.name === ui.other && r.meta && r.name !== card.name);
    return playback(
      body,
      card,
      engines,
      channels,
      other && {
        name: other.name,
        shift: () => ui.shift_s ?? 0,
        channels: new Set(channelsOf(other)),
      },
    );
  }
}

const option = ({ name, growing }) => [name, growing ? `${name}, being written` : name];

const GRID = 1000; // points of the coarse look

// the shift at which the fused thrust of the second flight lies best on the first's, s
async function bestShift(one, other) {
  const engine = channelsOf(one).find((c) => c.startsWith("estimate_thrust_n_"));
  const [first, second] = await Promise.all(
    [one, other].map((card) => fetchWindow(card.name, [engine], card.meta.start_s, card.meta.stop_s, GRID)),
  );
  const length = Math.max(one.meta.stop_s - one.meta.start_s, other.meta.stop_s - other.meta.start_s),
    step = length / GRID;
  const line = (window, card) =>
    Array.from({ length: GRID }, (_, i) => valueAt(window, 0, card.meta.start_s + i * step)?.[0] ?? Number.NaN);
  const [a, b] = [line(first, one), line(second, other)];
  let best = { miss: Infinity, lag: 0 };
  for (let lag = -GRID / 2; lag <= GRID / 2; lag++) {
    let sum = 0,
      count = 0;
    for (let i = 0; i < GRID; i++) {
      const off = a[i] - b[i - lag];
      if (Number.isFinite(off)) {
        sum += off * off;
        count++;
      }
    }
    if (count > GRID / 4 && sum / count < best.miss) best = { miss: sum / count, lag };
  }
  return Number((best.lag * step + one.meta.start_s - other.meta.start_s).toPrecision(4));
}

const words = (...said) => h("section.panel", h("div.empty", ...said));
