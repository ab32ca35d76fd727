// Starts the page: frame, views, events.

import { dropFiles } from "./drop.js";
import { Frame } from "./frame.js";
import { changed, follow, listen, refresh, store, viewOf } from "./store.js";

const theme = localStorage.getItem("theme") ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
document.documentElement.dataset.theme = theme;

document.querySelector(".skip").addEventListener("click", (event) => {
  event.preventDefault(); // the address says which screen is shown
  document.getElementById("main").focus();
});
addEventListener("hashchange", () => {
  store.view = viewOf(location.hash);
  changed("view");
});

async function start() {
  await refresh();
  const frame = new Frame(document.getElementById("app"));
  listen((what) => frame.update(what));
  follow();
  dropFiles(document.body);
  document.documentElement.dataset.started = "yes";
}
start().catch((problem) => {
  console.error(problem);
  document.getElementById("app").textContent = problem.message;
});
