// Files for the person: downloads and pictures.
import { h } from "./dom.js";

export function save(href, name) {
  const link = h("a", { href, download: name });
  document.body.append(link);
  link.click();
  link.remove();
}

export function savePicture(sheet, name) {
  sheet.picture().toBlob((blob) => {
    const url = URL.createObjectURL(blob);
    save(url, name.replace(/[/.]/g, "-") + ".png");
    setTimeout(() => URL.revokeObjectURL(url), 10_000);
  });
}
