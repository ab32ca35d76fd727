// A screen for the newest answer of one kind about the chosen model and recordings; before there is one, it offers to ask.

import { latest } from "../answers.js";
import { fill, h, heading } from "../dom.js";
import { percent } from "../format.js";
import { bar } from "../ledger.js";
import { attempt, byItself, report, running, session } from "../store.js";

// about() is the recording that the screen is about
// kind of the order; title and words at the head; label of the button; ask() orders; never(session) says why it is empty;
// show(answer, head) draws; find() is the answer, can(session) whether it may be asked for, `wants` what else is missing
export function answerView(root, of) {
  const { kind, title, words, label, ask, never, show, find = () => latest(kind) } = of,
    { about = () => session().measured[0] } = of,
    { can = (s) => s.model && s.measured.length, wants = "a model and a measured recording" } = of;
  const head = heading(title, words);
  let shown = null;

  const update = byItself(async () => {
    const found = find();
    if (!found) {
      shown = null;
      empty();
    } else if (found.report !== shown) {
      const answer = await report(found.report);
      if (shown === found.report) return; // another update was faster: what was chosen since stays chosen
      if (find()?.report !== found.report) return; // another one is asked for since: what is drawn of it stays
      shown = found.report;
      show(answer, head);
    }
  });

  function empty() {
    const job = running(kind),
      s = session();
    const said = job
      ? [h("p", `${job.title}: ${job.note || job.state} (${percent(job.fraction)})`), bar(job.fraction)]
      : [
          h("p", can(s) ? never(s) : `Choose ${wants} at the top.`),
          h("button", { class: "primary", disabled: !can(s), onclick: attempt(ask) }, label),
        ];
    fill(root, head, h("section.panel", h("div.empty", said)));
  }

  update();
  return {
    update,
    about,
    jobs: () => {
      if (!shown) update();
    },
  };
}
