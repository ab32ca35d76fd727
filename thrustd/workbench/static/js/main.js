// Starts the page: frame, views, events.
import { h } from "./dom.js";
import { Frame } from "./frame.js";
import { attempt, changed, follow, listen, refresh, say, store } from "./store.js";
import { dropFiles } from "./drop.js";

const theme = localStorage.getItem("theme") ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
document.documentElement.dataset.theme = theme;

document.addEventListener("say", ({ detail }) => {
  document.querySelector(".toast")?.remove();
  const toast = h(
    "div",
    { class: `toast ${detail.kind}`, role: "alert" },
    h("div", {}, detail.line),
    h("button", { class: "plain", onclick: () => toast.remove(), "aria-label": "close" }, "✕"),
  );
  document.body.append(toast);
  if (detail.kind === "ok") setTimeout(() => toast.remove(), 5000);
});

addEventListener("hashchange", () => {
  store.view = location.hash.slice(1) || "overview";
  changed("view");
});

attempt(async () => {
  await refresh();
  const frame = new Frame(document.getElementById("app"));
  listen((what) => frame.update(what));
  follow();
  dropFiles(document.body);
  document.documentElement.dataset.started = "yes";
})().catch((problem) => say(String(problem)));
