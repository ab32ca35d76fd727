import { h } from "../dom.js";
export function flight(root) { root.append(h("p", {class: "empty"}, "flight")); return {}; }
