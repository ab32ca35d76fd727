import { h } from "../dom.js";
export function add(root) { root.append(h("p", {class: "empty"}, "add")); return {}; }
