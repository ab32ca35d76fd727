// The physics card of an effect: equation, what it removes, parameters against what physics expects.

import { h } from "../dom.js";
import { typeset, withUnit } from "../format.js";
import { goAndAdd } from "../steps.js";
import { attempt } from "../store.js";
import { removed, WORTH } from "../worth.js";

export function physicsCard(c) {
  const k = c.card;
  return h(
    "div.card",
    h(
      "div",
      h("h3", k.title),
      h("div.equation", k.equation),
      h("p", typeset(c.evidence) + "."),
      h(
        "dl.fields",
        ...k.parameters.flatMap((p) => [h("dt", p.name), h("dd", p.meaning, expected(c, p.name))]),
        h("dt", "reads"),
        h("dd", k.channels.join(", ") || "the force itself"),
        c.separable_from.length ? [h("dt", "looks like"), h("dd", c.separable_from.join(", "))] : null,
        h("dt", "shown alone by"),
        h("dd", typeset(k.separating_test)),
        h("dt", "source"),
        h("dd", k.source),
      ),
      c.in_verdict
        ? null
        : h(
            "div.buttons",
            h(
              "button",
              { onclick: attempt(() => goAndAdd([c.name])) },
              removed(c) < WORTH ? `Add ${c.effect} although it removes nothing` : `Add ${c.effect} all the same`,
            ),
          ),
    ),
  );
}

function expected(c, name) {
  const found = c.estimates.find((p) => p.name === name);
  return found?.expected
    ? h(
        "span.quiet",
        `; found ${found.said ? typeset(found.said) : withUnit(found.value, found.unit, 4)}, expected on PH-LAB: ${found.expected}`,
      )
    : null;
}
