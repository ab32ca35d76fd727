// The pictures of where a model fails, one model alone or several on the same samples, and its regions as a table.

import { span } from "../axes.js";
import { coherenceChart, dependenceChart, loopChart, mapChart, spectrumChart, topOf } from "../charts.js";
import { h, key, panel, table } from "../dom.js";
import { newtons, percent, signedNewtons, typeset } from "../format.js";

const SHOWN = 9; // channels drawn, those that carry most of the residual first
const FRONT = "--s1";
const BEHIND = ["--ink-3", "--s3", "--s4"]; // before is grey on every page

// c: the model looked at; rest: others on the same recording; failure: the chosen sentence, number `chosen`, or null
export function pictures(c, rest, failure, chosen) {
  const all = [...rest, c],
    limit = Math.max(...all.map((one) => one.loop.limit_n)),
    top = topOf(all.map((one) => one.map));
  const each = (title, picture) =>
    all.map((one) => panel(title, [h("span.faint", rest.length ? one.model : "")], h("div.body", picture(one))));
  const loops = each("Force over deformation, coloured by error", (one) =>
    loopChart(one.loop, one === c ? chosen : null, limit),
  );
  const maps = each("Error over force and rate", (one) => mapChart(one.map, one === c ? failure?.map : null, top));
  return h(
    "div",
    panel(
      "Residual against each channel",
      [
        h("span.faint", "mean and 10 to 90 % band"),
        failure
          ? keys([
              ["all samples", "--s2"],
              ["the chosen samples", FRONT],
            ])
          : rest.length
            ? modelKeys(c, rest)
            : null,
      ],
      h("div.columns.three.body", dependences(c, rest, failure)),
    ),
    ...(rest.length ? [columns(loops), columns(maps)] : [columns([...loops, ...maps])]),
    h(
      "div.columns",
      panel(
        "Spectrum of the residual",
        [rest.length ? modelKeys(c, rest) : null],
        h(
          "div.body",
          spectrumChart([
            ...rest.map((one, i) => ({ s: one.spectrum, color: BEHIND[i % BEHIND.length] })),
            { s: c.spectrum, color: rest.length ? FRONT : "--s2" },
          ]),
        ),
      ),
      panel(
        "Correlation by frequency",
        [h("span.faint", `${rest.length ? c.model + ": " : ""}the five most coherent channels`)],
        h("div.body", coherenceChart(c.spectrum)),
      ),
    ),
  );
}

function dependences(c, rest, failure) {
  const spread = (d) => Math.max(...d.mean) - Math.min(...d.mean),
    drawn = failure ? [c] : [c, ...rest];
  const y = span(
    [...drawn, ...(failure ? [failure] : [])].flatMap((one) => one.dependences.map((d) => [...d.low, ...d.high])),
    0.04,
  );
  const widest = (d) => Math.max(...drawn.map((one) => spread(same(one, d) ?? d)));
  const most = [...c.dependences].sort((a, b) => widest(b) - widest(a)).slice(0, SHOWN);
  return most.map((d) => {
    if (failure)
      return dependenceChart(
        layers([
          [d, "--s2"],
          [same(failure, d), FRONT],
        ]),
        y,
      );
    if (!rest.length) return dependenceChart([{ d, color: "--s2" }], y);
    return dependenceChart(layers([...rest.map((one, i) => [same(one, d), BEHIND[i % BEHIND.length]]), [d, FRONT]]), y);
  });
}

const same = (one, d) => one.dependences.find((other) => other.channel === d.channel);
const layers = (pairs) => pairs.filter(([d]) => d).map(([d, color]) => ({ d, color }));

const columns = (panels) => h("div.columns", panels);

const modelKeys = (c, rest) =>
  keys([...rest.map((one, i) => [one.model, BEHIND[i % BEHIND.length]]), [c.model, FRONT]]);

const keys = (list) =>
  h(
    "span.push.buttons",
    list.map(([name, color]) => key(color, name)),
  );

export function regions(c) {
  const row = (r, i) => [
    i && c.regions[i - 1].dimension === r.dimension ? "" : h("b", r.dimension),
    typeset(r.region),
    newtons(r.rmse_n),
    signedNewtons(r.bias_n),
    percent(r.share_of_squared_error),
    percent(r.share_of_time),
  ];
  const heads = ["RMSE", "Bias", "Share of squared error", "Share of time"];
  return table({ class: "regions" }, [["Region", "", 2], ...heads.map((name) => [name, "num"])], c.regions.map(row));
}
