// Above the time histories: which recordings, models and channels, whether they zoom together, and the condition.

import { conditionBar } from "./condition.js";
import { h } from "./dom.js";
import { FIRST } from "./history_panels.js";
import { recording, store } from "./store.js";

// state: what the view remembers; draw() draws it anew; hits(found, words) shades the samples of a condition
export function historyTools(state, recordings, models, draw, hits) {
  const units = new Map();
  for (const one of recordings().map(recording))
    for (const c of one?.meta?.channels ?? []) if (c.name !== "force_N") units.set(c.name, c.unit);
  const choose = (field) => (chosen) => {
    state[field] = chosen;
    draw();
  };
  const names = (list) => list.map((one) => one.name);
  const panels = state.channels ?? FIRST;
  const linked = h("input", {
    type: "checkbox",
    checked: state.linked,
    onchange: (event) => {
      state.linked = event.target.checked;
    },
  });
  return h(
    "div.body.toolbar",
    picker(state, "Recordings", names(store.server.recordings), recordings(), choose("shown")),
    picker(state, "Models", names(store.server.models), models(), choose("models")),
    picker(state, "Channels", [...units.keys()], panels, choose("channels"), (name) => units.get(name)),
    recordings().length > 1 ? h("label", linked, "zoom recordings together") : null,
    conditionBar(state.condition, recordings, models, hits),
  );
}

function picker(state, title, names, chosen, set, note = () => "") {
  const check = (name) =>
    h(
      "label",
      h("input", {
        type: "checkbox",
        checked: chosen.includes(name),
        onchange: ({ target }) => set(target.checked ? [...chosen, name] : chosen.filter((one) => one !== name)),
      }),
      h("span", name),
      h("span.faint", note(name)),
    );
  const here = chosen.filter((name) => names.includes(name)).length;
  return h(
    "details",
    {
      class: "pickers",
      open: state["open" + title],
      ontoggle: (event) => {
        state["open" + title] = event.target.open;
      },
    },
    h("summary", `${title} (${here} of ${names.length})`),
    h("div.checks", names.map(check)),
  );
}
