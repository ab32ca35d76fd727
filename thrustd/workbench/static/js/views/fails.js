import { h } from "../dom.js";
export function fails(root) { root.append(h("p", {class: "empty"}, "fails")); return {}; }
