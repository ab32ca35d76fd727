// The flight that is looked at: one choice for both flight screens, which a reload of the page keeps.
import { store } from "./store.js";

const KEPT = "flight";

export const isLog = (one) => one.name.endsWith(".mcap");
export const channelsOf = (one) => (one?.meta?.channels ?? []).map((c) => c.name);
export const hasEstimates = (one) => channelsOf(one).some((name) => name.startsWith("estimate_thrust_n_"));

// recordings with a fan speed, and logs that are closed: a raw one is replayed
const flew = (one) => isLog(one) || channelsOf(one).some((name) => name.startsWith("n1_pct_"));
export const flights = () => store.server.recordings.filter((one) => flew(one) && !one.growing);

export const chooseFlight = (name) => sessionStorage.setItem(KEPT, name);

// of these, the one that was chosen; else what is shown, is being written just now, or has estimates
export function chosenFlight(among, shown) {
  const named = (name) => among.find((one) => one.name === name);
  return (
    named(sessionStorage.getItem(KEPT)) ??
    named(shown) ??
    among.find((one) => one.growing) ??
    among.find(hasEstimates) ??
    among[0]
  );
}
