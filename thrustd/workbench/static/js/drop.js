// Drag and drop: files go to the server, which checks them before the folder gets them.

import { fileUrl, put } from "./api.js";
import { h } from "./dom.js";
import { attempt, byItself, ended, store } from "./store.js";

export function dropFiles(target) {
  let veil = null;
  const end = () => {
    veil?.remove();
    veil = null;
  };
  target.addEventListener("dragover", (event) => {
    if (![...event.dataTransfer.types].includes("Files")) return;
    event.preventDefault();
    if (!veil) {
      veil = h(
        "div.drop-veil",
        h(
          "p",
          h("b", `Drop to add to the folder ${store.server.folder}`),
          h("br"),
          "recordings: CSV, Parquet, npz, MATLAB, MCAP; models: JSON. Every file is read whole before it is taken.",
        ),
      );
      document.body.append(veil);
    }
  });
  target.addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) end();
  });
  target.addEventListener("drop", (event) => {
    event.preventDefault();
    end();
    addFiles([...event.dataTransfer.files]);
  });
}

export const addFiles = attempt(async (files) => {
  for (const file of files) await byItself(add)(file); // what is said of one file stays while the next is taken
});

async function add(file) {
  ended(await put(fileUrl(file.name), file));
}
