// Live and flight: follow a log that a daemon is writing, or play a flight back, with both engines.
import { fill, h, select } from "../dom.js";
import { attempt, order, store } from "../store.js";
import { live } from "./live.js";
import { playback } from "./playback.js";

export function flight(root) {
  const ui = (store.ui.flight ??= { log: null, mode: null });
  let stop = () => {};
  const logs = () => store.server.recordings.filter((r) => r.name.endsWith(".mcap"));

  function draw() {
    stop();
    stop = () => {};
    ui.waiting = false;
    const found = logs(),
      chosen = found.find((r) => r.name === ui.log) ?? found.find((r) => r.growing) ?? found[0],
      mode = ui.mode ?? (chosen?.growing ? "live" : "play");
    const state = h(
      "span",
      { class: "quiet", role: "status" },
      "A log may be followed while the daemon is writing it.",
    );
    const tools = h(
      "div",
      { class: "panel" },
      h(
        "div",
        { class: "body toolbar" },
        h(
          "label",
          {},
          "Flight log",
          select(
            found.map((r) => [r.name, r.name]),
            chosen?.name,
            (v) => {
              ui.log = v;
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
        state,
      ),
    );
    const body = h("div", {});
    fill(
      root,
      h(
        "div",
        { class: "head" },
        h("h1", {}, "Live and flight"),
        h(
          "p",
          {},
          "Fused net thrust of both engines with its 95 % band, the mount and the brochure source, and the state of the sensors.",
        ),
      ),
      found.length ? tools : null,
      body,
    );
    if (!chosen)
      fill(body, words("No flight log (MCAP) in this folder. Let thrustd run or thrustd replay write one here."));
    else if (mode === "live") stop = live(body, chosen.name, state);
    else stop = play(body, chosen);
  }

  draw();
  return {
    update: () => {
      if (ui.waiting || !logs().length) draw();
    },
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
      const failed = store.server.jobs.find(
        (job) => job.kind === "prepare" && job.state === "failed" && job.arguments.recording === card.name,
      );
      if (!failed && ui.asked !== card.name) {
        ui.asked = card.name;
        attempt(order)("prepare", { recording: card.name });
      }
      fill(
        body,
        words(
          !failed
            ? "Reading the flight log …"
            : "This log could not be read as columns; it may hold raw events only (run thrustd replay on it), or follow it live.",
        ),
      );
      return () => {};
    }
    const channels = new Set(card.meta.channels.map((c) => c.name));
    const engines = [...channels]
      .filter((c) => c.startsWith("estimate_thrust_n_"))
      .map((c) => c.slice("estimate_thrust_n_".length));
    if (!engines.length) {
      fill(body, words("No estimates in this log. Run thrustd replay on it to get them."));
      return () => {};
    }
    return playback(body, card, engines, channels);
  }
}

const words = (said) => h("section", { class: "panel" }, h("p", { class: "empty" }, said));
