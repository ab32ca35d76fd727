// What is always there: the loop's steps, the choice of model and recordings, the next step in words, running work.

import { fill, h, keepFocus, select } from "./dom.js";
import { newtons } from "./format.js";
import { nextStep } from "./guide.js";
import { bar, ledgerOf, stepOf } from "./ledger.js";
import { showNotices } from "./notices.js";
import { readNext } from "./steps.js";
import { attempt, cancel, choose, store } from "./store.js";
import { add } from "./views/add.js";
import { fails } from "./views/fails.js";
import { flight } from "./views/flight.js";
import { flightTest } from "./views/flight_test.js";
import { histories } from "./views/histories.js";
import { identify } from "./views/identify.js";
import { missing } from "./views/missing.js";
import { overview } from "./views/overview.js";
import { against } from "./way_back.js";

const VIEWS = { overview, identify, histories, fails, missing, add, flight, flighttest: flightTest };
const NAMES = {
  overview: "Overview",
  identify: "Identify",
  histories: "Time histories",
  fails: "Where it fails",
  missing: "What is missing",
  add: "Add it",
  flight: "Live and flight",
  flighttest: "Flight test",
};

const FLIGHTS = ["flight", "flighttest"]; // what stands beside the loop

const LISTS_TELL = CSS.supports("selector(select:open)");
const LOOK_AGAIN_MS = 100;
const KINDS = ["jobs", "state", "all", "view"]; // of changes, the later draws what the earlier does

export class Frame {
  constructor(root) {
    this.nav = h("nav", { "aria-label": "steps" });
    this.ledger = h("div.ledger-small");
    this.folder = h("div");
    this.context = h("div.context");
    this.main = h("main", { class: "main", id: "main", tabindex: "-1" });
    this.guide = h("div", { class: "guide", role: "status" });
    this.body = h("div");
    this.main.append(this.guide, this.body);
    this.notices = h("div", { class: "notices", role: "log", "aria-label": "messages" });
    this.jobs = h("div", { class: "jobs", role: "status", "aria-label": "running work" });
    root.className = "app";
    const gone = h(
      "p",
      { class: "gone", role: "alert" },
      h("b", "The workbench does not answer. "),
      "What is shown may be old, and nothing can be asked. If it was closed, start it again with ",
      h("code", `thrustd workbench ${store.server.folder}`),
      " and open the address it prints; its answers are kept in the folder.",
    );
    fill(
      root,
      gone,
      h(
        "aside.rail",
        h("div.brand", h("b", "thrustd workbench"), this.folder),
        this.nav,
        this.ledger,
        h(
          "footer",
          h("button", { onclick: () => this.theme() }, "Light / dark"),
          h("span", `thrustd ${store.server.version}, this machine only`),
        ),
      ),
      this.context,
      this.main,
      this.notices,
      this.jobs,
    );
    root.addEventListener("pointerdown", (event) => {
      this.pressed = event.button === 0 && !event.target.closest("select"); // a list that opens tells no release
    });
    for (const end of ["pointerup", "pointercancel", "pointermove"])
      addEventListener(end, (event) => {
        if (!this.pressed || event.buttons) return; // a scroll bar or a menu may swallow the release: a move tells it
        setTimeout(() => {
          this.pressed = false;
          this.release();
        });
      });
    showNotices(this.notices);
    this.update("view");
  }

  // what is drawn anew between press and release loses the click or the drag, a list that is open its choice
  release() {
    const held = this.held;
    this.held = null;
    if (held) this.update(held);
  }

  update(what) {
    const open = LISTS_TELL && document.querySelector("select:open");
    if (this.pressed || open) {
      this.held = KINDS[Math.max(KINDS.indexOf(this.held), KINDS.indexOf(what))];
      clearTimeout(this.again);
      if (open) this.again = setTimeout(() => this.release(), LOOK_AGAIN_MS); // nobody says when a list is closed
      return;
    }
    keepFocus(() => this.draw(what));
  }

  draw(what) {
    if (what === "jobs") {
      this.drawJobs();
      this.view?.jobs?.();
      return;
    }
    readNext();
    this.drawRail();
    this.drawContext();
    this.drawGuide();
    this.drawJobs();
    const key = this.viewKey();
    if (what === "view" || what === "all" || key !== this.key) this.open(key);
    else this.view?.update?.();
  }

  viewKey() {
    return store.view in VIEWS ? store.view : "overview";
  }

  open(key) {
    const same = key === this.key;
    if (!same) store.ui.about = this.view?.about?.() ?? store.ui.about; // the recording that was worked with
    this.view?.close?.();
    this.key = key;
    const own = h("div"); // what a view that was left still draws is seen by nobody
    fill(this.body, own);
    this.view = VIEWS[key](own);
    this.context.hidden = FLIGHTS.includes(key); // flights are chosen on their own screens
    document.title = `${NAMES[key]} · thrustd workbench`;
    if (!same) this.main.scrollTop = 0;
  }

  drawRail() {
    this.folder.textContent = store.server.folder;
    const next = nextStep();
    fill(
      this.nav,
      ...Object.entries(NAMES).map(([key, name], i) =>
        h(
          "a",
          {
            href: "#" + key,
            "aria-current": key === this.viewKey() ? "page" : null,
            class: `${next?.view === key ? "next" : ""} ${key === FLIGHTS[0] ? "beside" : ""}`,
          },
          h("span.no", String(i + 1)),
          h("span", name),
          h("span", { class: "tick", "aria-hidden": "true" }, next?.view === key ? "●" : ""),
        ),
      ),
    );
    const steps = ledgerOf(store.server.session.model),
      top = Math.max(...steps.map((s) => s.rmse_n), 1);
    fill(
      this.ledger,
      ...(steps.length
        ? [
            h("h3", "Error on held-back blocks"),
            ...steps.map((s) =>
              h("div.ledger-line", h("span", s.name), h("span.num", newtons(s.rmse_n)), bar(s.rmse_n / top)),
            ),
          ]
        : []),
    );
  }

  drawContext() {
    const { recordings, session } = store.server,
      models = store.server.models.filter((m) => !m.problem);
    const names = recordings.map((r) => r.name);
    const wanted = nextStep()?.wants;
    if (
      this.same(
        "context",
        names,
        models.map((m) => m.name),
        session,
        wanted,
        store.refused,
      )
    )
      return;
    const chooser = (title, meaning, list, chosen, none, pick) =>
      h(
        "label",
        { title: chosen ? `${meaning}: ${chosen}` : meaning, class: wanted === title.toLowerCase() ? "wanted" : "" },
        title,
        select([["", none], ...list.map((name) => [name, name.replace(/\.json$/, "")])], chosen, pick, meaning),
      );
    const one = (field) => (name) => attempt(choose)({ [field]: name ? [name] : [] });
    fill(
      this.context,
      chooser(
        "Model",
        "model",
        models.map((m) => m.name),
        session.model,
        models.length ? "choose a model" : "no model yet",
        (name) => attempt(choose)({ model: name }),
      ),
      chooser(
        "Measured",
        "measured recording",
        names,
        session.measured[0] ?? "",
        "choose a recording",
        one("measured"),
      ),
      chooser(
        "Check on",
        "recording nothing is fitted to",
        names,
        session.heldout[0] ?? "",
        "none",
        (name) => attempt(choose)({ heldout: name ? [name] : [], unchecked: !name }), // none: its name does not make it one again
      ),
      chooser("Bench", "bench recording", names, session.bench[0] ?? "", "none", one("bench")),
    );
  }

  // a button that is being pressed, or a list that is open, stays what it is as long as it says the same
  same(part, ...said) {
    const key = JSON.stringify(said),
      same = this.said?.[part] === key;
    this.said = { ...this.said, [part]: key };
    return same;
  }

  drawGuide() {
    const next = (this.next = nextStep()),
      bad = next?.doubt ? "" : against(stepOf(store.server.session.model));
    const away = FLIGHTS.includes(this.viewKey()) && !FLIGHTS.includes(next?.view); // the loop's next step is elsewhere
    if (this.same("guide", next?.say, next?.label, next?.other?.label, next?.done, bad, away)) return;
    fill(
      this.guide,
      ...(next
        ? [
            h("div.say", bad ? h("p.bad", bad) : null, h("b", next.done ? "Done" : "Next"), next.say),
            next.other ? h("button", { onclick: attempt(() => this.next.other.go()) }, next.other.label) : null,
            next.label
              ? h("button", { class: "primary", id: "next", onclick: attempt(() => this.next.go()) }, next.label)
              : null,
          ].filter(Boolean)
        : []),
    );
    this.guide.hidden = !next || away;
  }

  drawJobs() {
    const open = store.server.jobs.filter((job) => ["waiting", "running"].includes(job.state)).reverse();
    fill(
      this.jobs,
      ...open.map((job) =>
        h(
          "div.job",
          h("span", job.title),
          bar(job.fraction),
          h("span.quiet", job.state === "waiting" ? "waiting" : job.note || "working"),
          h("button", { onclick: () => attempt(cancel)(job), "aria-label": `Cancel: ${job.title}` }, "Cancel"),
        ),
      ),
    );
    document.documentElement.dataset.busy = String(open.length + store.asking);
    const busy = open.length > 0 && nextStep()?.kinds?.some((kind) => open.some((job) => job.kind === kind));
    const button = document.getElementById("next");
    if (button) button.disabled = Boolean(busy);
  }

  theme() {
    const now = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
    document.documentElement.dataset.theme = now;
    localStorage.setItem("theme", now);
    this.open(this.key);
  }
}
