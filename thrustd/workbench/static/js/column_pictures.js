// A preview of what the columns of a file become: force and deformation over time, and one over the other.
import { chart, line, nearest, span } from "./axes.js";
import { h } from "./dom.js";
import { number } from "./format.js";

// each: {values, title}, or null
export function columnPictures(time, force, deformation, slope) {
  const at = time?.values ?? ((force ?? deformation)?.values ?? []).map((_, i) => i);
  const overTime = (channel, color) => {
    if (!channel) return null;
    const { values, title } = channel;
    return chart({
      height: 150,
      x: { title: time ? "time [s]" : "sample", ...span([at], 0) },
      y: { title, ...span([values]) },
      at: (x) => number(values[nearest(at, x)], 5),
      draw: (p) => line(p, at, values, color, 1.2),
    });
  };
  return [
    h("div", overTime(force, "--measured"), overTime(deformation, "--s1")),
    force && deformation
      ? chart({
          height: 300,
          x: { title: deformation.title, ...span([deformation.values]) },
          y: { title: force.title, ...span([force.values]) },
          draw: (p) => line(p, deformation.values, force.values, slope < 0 ? "--s2" : "--s1", 1),
        })
      : null,
  ];
}

// of which only the sign counts
export function correlation(xs, ys) {
  const pairs = xs.map((x, i) => [x, ys[i]]).filter(([x, y]) => x !== null && y !== null && x !== undefined),
    mean = (k) => pairs.reduce((sum, p) => sum + p[k], 0) / pairs.length,
    [mx, my] = [mean(0), mean(1)];
  return pairs.reduce((sum, [x, y]) => sum + (x - mx) * (y - my), 0);
}
