// Files for the person: downloads.
import { h } from "./dom.js";

export function save(href, name) {
  const link = h("a", { href, download: name });
  document.body.append(link);
  link.click();
  link.remove();
}
