// The window in sight as part of the address: it can be sent, kept and loaded again.
import { recording } from "./store.js";

export function writeAddress(names, [from, to]) {
  const said = new URLSearchParams([
    ...names.map((name) => ["recording", name]),
    ["from", from.toPrecision(8)],
    ["to", to.toPrecision(8)],
  ]);
  history.replaceState(null, "", `#histories?${said}`);
}

export function readAddress() {
  const said = new URLSearchParams(location.hash.split("?")[1] ?? ""),
    [from, to] = ["from", "to"].map((key) => Number(said.get(key) ?? NaN));
  return { names: said.getAll("recording").filter(recording), range: from < to ? [from, to] : null };
}
