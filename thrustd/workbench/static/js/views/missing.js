import { h } from "../dom.js";
export function missing(root) { root.append(h("p", {class: "empty"}, "missing")); return {}; }
