// A strip chart of one engine that grows while the daemon writes: the last minutes, band and both sources.
import uPlot from "../vendor/uPlot.esm.js";
import { css, h, key, panel } from "./dom.js";
import { edge, FUSED, SOURCES } from "./engine.js";
import { px } from "./scale.js";
import { timeAxis, valueAxis } from "./time_axes.js";

const SPAN_S = 300;
const HEIGHT = px(210);
const LINES = [...SOURCES, FUSED]; // the fused line in front

export class LiveStrip {
  constructor(name) {
    this.data = [[], [], [], ...LINES.map(() => [])];
    this.box = h("div");
    const keys = [FUSED, ...SOURCES].map(([, label, color]) => key(color, label));
    this.root = panel(`${name} engine: net thrust [N], forward +; band 95 %`, [h("span.push.buttons", keys)], this.box);
    this.observer = new ResizeObserver(() => this.size());
    this.observer.observe(this.box);
  }

  size() {
    const width = this.box.clientWidth;
    if (!width) return;
    if (this.chart) {
      this.chart.setSize({ width, height: HEIGHT });
      return;
    }
    const line = (label, color, lineWidth) => ({
      label,
      stroke: () => (color ? css(color) : "transparent"),
      width: lineWidth,
      points: { show: false },
    });
    this.chart = new uPlot(
      {
        width,
        height: HEIGHT,
        legend: { show: false },
        padding: [10, 14, 0, 0],
        cursor: { y: false, points: { show: false } },
        scales: {
          x: { time: false, range: (_u, low, high) => [Math.max(low, high - SPAN_S), Math.max(high, low + 10)] },
        },
        axes: [timeAxis(), valueAxis()],
        series: [{}, line("high"), line("low"), ...LINES.map(([, label, color, w]) => line(label, color, w))],
        bands: [{ series: [1, 2], fill: () => css("--mark") }],
      },
      this.data,
      this.box,
    );
  }

  add(row) {
    const values = [
      row.t_ns * 1e-9,
      edge(1, row.thrust_n, row.thrust_std_n),
      edge(-1, row.thrust_n, row.thrust_std_n),
      ...LINES.map(([field]) => row[field]),
    ];
    for (const [i, v] of values.entries()) this.data[i].push(v);
    const first = this.data[0].findIndex((t) => t >= row.t_ns * 1e-9 - SPAN_S);
    if (first > 1000) for (const column of this.data) column.splice(0, first);
  }

  paint() {
    this.chart?.setData(this.data);
  }

  close() {
    this.observer.disconnect();
    this.chart?.destroy();
  }
}
