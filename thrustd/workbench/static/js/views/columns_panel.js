// The panel in which the columns of a file are said: which file, and what is kept while another screen is shown.

import { get, inUrl } from "../api.js";
import { h, panel } from "../dom.js";
import { attempt, recording, store } from "../store.js";
import { Columns } from "./columns.js";

export const nameColumns = (name) => {
  location.hash = "overview";
  turnTo(name);
};

const turnTo = (name) => {
  store.ui.columns = name;
  document.dispatchEvent(new CustomEvent("columns"));
};

// the file, and what was said of it, that the questions were made from
const asRead = ({ reading, mapped }) => JSON.stringify([reading?.[""], mapped]);

// again(): before it is shown anew; forgotten where the file is another one by now, or another tab has said what it is
// saidElsewhere(): while it is shown; another reading of the file alone takes nothing from under somebody's hands
export function columnsPanel(name) {
  const root = panel(`Columns of ${name}`, [], h("p.empty", "Reading …")),
    from = asRead(recording(name)),
    before = JSON.stringify(recording(name).mapped);
  let said = null;
  const done = () => {
    if (store.ui.columns === name) turnTo(null); // another file's may be asked for since
  };
  const ask = async () => {
    const table = await get("api/columns/" + inUrl(name));
    said = new Columns(root, name, table, done);
    said.draw();
  };
  const again = () => {
    const now = recording(name);
    if (said && now && asRead(now) === from) said.draw();
    else store.ui.panel = null;
  };
  const saidElsewhere = () => JSON.stringify(recording(name)?.mapped) !== before;
  attempt(ask)();
  return { name, root, again, saidElsewhere };
}
