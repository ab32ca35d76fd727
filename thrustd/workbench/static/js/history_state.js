// What the time histories remember, and which recording they open with.
import { recording, store } from "./store.js";

// what was worked with since, on another screen or at the top, is what is looked at
export function turn() {
  const state = ui();
  if (store.ui.about === state.about) return;
  state.about = store.ui.about;
  if (!state.shown?.includes(state.about)) state.shown = null;
}

export const readable = (name) => (recording(name)?.growing ? undefined : recording(name)?.name);

export const ui = () =>
  (store.ui.histories ??= {
    shown: null,
    models: null,
    channels: null,
    hits: new Map(),
    condition: { channel: "force_N", low: "", high: "", phase: "" },
  });
