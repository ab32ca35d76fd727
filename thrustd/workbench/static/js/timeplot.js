// One sheet: panels of lines over the same time axis, zoomed together, each zoom answered by the server's pyramid.
import uPlot from "../vendor/uPlot.esm.js";
import { css, h, key } from "./dom.js";
import { clock, count, number, seconds } from "./format.js";
import { fetchWindow, onTimes, toColumns, valueAt } from "./lines.js";
import { px } from "./scale.js";
import { emptyAxis, TIME_AXIS_PX, timeAxis, valueAxis } from "./time_axes.js";
import { beyond, moved, padded, scaleOf } from "./value_range.js";

const MIN_SPAN_S = 1e-3;

export class Sheet {
  // panels: [{title, unit, series: [{channel, label, color, width}], bands: [...], height}]; spans(): shaded stretches
  constructor({ recording, panels, range, limits, spans = () => [], onRange, onMark, sync }) {
    Object.assign(this, { recording, limits, spans, onRange, onMark, sync });
    this.range = range ?? [...limits];
    this.plots = panels.map((panel) => ({ panel, window: null }));
    this.status = h("div", { class: "status", "aria-live": "off" });
    this.axisBox = h("div");
    this.root = h(
      "div",
      {
        class: "sheet",
        tabindex: "0",
        role: "group",
        "aria-label": `time histories of ${recording}`,
        onkeydown: (event) => this.key(event),
      },
      this.plots.map((plot) => this.build(plot)),
      h("div.foot", this.axisBox, this.status), // always in sight, however many panels there are
    );
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.root);
  }

  build(plot) {
    plot.readout = h("div.readout");
    plot.title = h("div.title", plot.panel.title);
    plot.box = h("div");
    plot.named = (plot.panel.second ? plot.panel.drawn : plot.panel.series).filter((s) => !s.unseen).length;
    plot.root = h("div.plot", plot.title, plot.readout, plot.box);
    return plot.root;
  }

  resize() {
    const width = Math.max(240, this.root.clientWidth - 10);
    if (width === this.width) return;
    this.width = width;
    for (const plot of this.plots)
      plot.root.classList.toggle("many", plot.named > 1 && px(320 + 230 * plot.named) > width);
    if (this.plots[0]?.chart) {
      for (const plot of this.plots) plot.chart.setSize({ width, height: this.height(plot) });
      this.axis.setSize({ width, height: TIME_AXIS_PX });
    } else this.draw();
    this.fetch();
  }

  height(plot) {
    return px(plot.panel.height ?? 150);
  }

  draw() {
    const key = uPlot.sync(this.sync ?? this.recording);
    for (const plot of this.plots) {
      plot.chart?.destroy();
      plot.chart = new uPlot(this.options(plot, key), this.columns(plot), plot.box);
    }
    this.axis?.destroy();
    this.axis = new uPlot(
      {
        width: this.width,
        height: TIME_AXIS_PX,
        legend: { show: false },
        padding: [0, 14, 0, 0],
        cursor: { show: false },
        scales: { x: { time: false, range: () => this.range }, y: { range: () => [0, 1] } },
        axes: [timeAxis(), emptyAxis()],
        series: [{}, { show: false }],
      },
      [this.range, [null, null]],
      this.axisBox,
    );
    this.paint();
  }

  // what uPlot draws; a panel may turn the fetched channels into others (a band out of value and sigma)
  columns({ panel, window, beside }) {
    if (!window) return [[], ...(panel.drawn ?? panel.series).map(() => [])];
    const columns = toColumns(window);
    if (beside)
      columns.push(
        ...panel.second.channels.map((_, i) =>
          onTimes(beside, i, columns[0], panel.second.shift(), window.raw ? 1 : 2),
        ),
      );
    return panel.transform ? panel.transform(columns) : columns;
  }

  options(plot, key) {
    return {
      width: this.width,
      height: this.height(plot),
      legend: { show: false },
      padding: [px(22), 14, 6, 0],
      cursor: {
        sync: { key: key.key, setSeries: false },
        drag: { x: true, y: false, setScale: false },
        points: { show: false },
        y: false,
      },
      scales: {
        x: { time: false, range: () => this.range },
        y: { range: (u, low, high) => padded(...(scaleOf(u, plot.panel, this.range) ?? [low, high])) },
      },
      axes: [timeAxis(false), valueAxis()],
      series: [
        {},
        ...(plot.panel.drawn ?? plot.panel.series).map((s) => ({
          label: s.label,
          stroke: () => (s.color ? css(s.color) : "transparent"),
          width: s.width ?? 1.25,
          points: { show: () => (plot.window?.raw && plot.window.count < 160) || false, size: 4 },
          spanGaps: false,
        })),
      ],
      bands: plot.panel.bands?.map((b) => ({ series: b, fill: () => css("--mark") })),
      hooks: {
        setSelect: [(u) => this.selected(u)],
        setCursor: [(u) => this.cursor(u)],
        drawClear: [(u) => this.shade(u)],
        ready: [(u) => this.gestures(u)],
      },
    };
  }

  shade(u) {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const span of this.spans()) {
      if (span.to < this.range[0] || span.from > this.range[1]) continue;
      const a = u.valToPos(span.from, "x", true),
        b = u.valToPos(span.to, "x", true);
      ctx.fillStyle = css(span.color);
      ctx.fillRect(a, bbox.top, Math.max(b - a, 1.5), bbox.height);
    }
    ctx.restore();
  }

  gestures(u) {
    u.over.addEventListener("mousedown", (event) => {
      this.marking = event.shiftKey;
    });
    u.over.addEventListener("dblclick", () => this.show([...this.limits]));
    u.over.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        const at = u.posToVal(event.offsetX, "x"),
          by = Math.exp(Math.sign(event.deltaY) * 0.25);
        this.show([at - (at - this.range[0]) * by, at + (this.range[1] - at) * by]);
      },
      { passive: false },
    );
  }

  selected(u) {
    if (u.select.width < 4) return;
    const from = u.posToVal(u.select.left, "x"),
      to = u.posToVal(u.select.left + u.select.width, "x");
    u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    if (this.marking && this.onMark) this.onMark(from, to);
    else this.show([from, to]);
  }

  cursor(u) {
    const t = u.cursor.left >= 0 ? u.posToVal(u.cursor.left, "x") : null;
    for (const plot of this.plots) {
      const cells = plot.panel.series.map((s, i) => {
        if (s.silent) return "";
        const hit = t === null || !plot.window ? null : valueAt(plot.window, i, t);
        const said =
          hit === null ? "" : hit[0] === hit[1] ? number(hit[0], 6) : `${number(hit[0], 5)} … ${number(hit[1], 5)}`;
        if (s.unseen && !said) return "";
        const crowded = plot.root.classList.contains("many"), // the colour must do while there is a value
          named = s.unseen || (plot.named > 1 && !(crowded && said)), // what has no colour has its name
          words = [named && s.label, said, said && plot.panel.unit];
        const cell = key(s.color, words.filter(Boolean).join(" "));
        cell.firstChild.hidden = s.unseen || plot.named < 2;
        return cell;
      });
      if (plot.panel.second) cells.push(...this.besideCells(plot, t));
      const band = plot.panel.band && h("span.shade-key", h("i.band"), plot.panel.band);
      plot.readout.replaceChildren(...[band].filter(Boolean), ...cells);
    }
    this.at = t;
    this.tell();
  }

  // names and values of the lines of a second recording
  besideCells({ panel, beside }, t) {
    return panel.drawn.slice(panel.series.length).map((s, i) => {
      const hit = t === null || !beside ? null : valueAt(beside, i, t - panel.second.shift());
      return key(s.color, s.label + (hit ? ` ${number(hit[0], 5)} ${panel.unit}` : ""));
    });
  }

  tell() {
    const first = this.plots[0].window;
    if (!first) return;
    const each = first.raw
      ? "every sample"
      : `lowest and highest of ${Math.round(first.samples / first.count)} samples at each point`;
    this.status.replaceChildren(
      h("span", this.at === null || this.at === undefined ? "" : `t = ${seconds(this.at)} (${clock(this.at)})`),
      h("span", `${count(first.samples)} samples in ${number(this.range[1] - this.range[0], 4)} s; ${each}`),
      h("span", `answered in ${Math.round(this.took)} ms`),
    );
  }

  key(event) {
    const range = moved(event.key, this.range, this.limits);
    if (!range) return;
    event.preventDefault();
    this.show(range);
  }

  show([from, to], tell = true) {
    const whole = this.limits[1] - this.limits[0],
      span = Math.min(Math.max(to - from, MIN_SPAN_S), whole);
    const start = Math.min(Math.max(from, this.limits[0]), this.limits[1] - span);
    this.range = [start, start + span];
    for (const plot of this.plots) plot.chart?.redraw(false, true);
    this.paint();
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.fetch(), 25);
    if (tell) this.onRange?.(this.range);
  }

  paint() {
    for (const plot of [...this.plots.map((one) => one.chart), this.axis])
      plot?.setScale("x", { min: this.range[0], max: this.range[1] });
  }

  async fetch() {
    this.abort?.abort();
    const abort = (this.abort = new AbortController()),
      began = performance.now(),
      [from, to] = this.range;
    try {
      const ask = (recording, channels, start, stop) =>
        fetchWindow(recording, channels, start, stop, this.width, abort.signal);
      const windows = await Promise.all(
        this.plots.map(({ panel }) => {
          const own = panel.series.map((s) => s.channel);
          return ask(this.recording, own, from, to);
        }),
      );
      const beside = await Promise.all(
        this.plots.map(({ panel: { second } }) => {
          const shift = second?.shift();
          return second && ask(second.recording, second.channels, from - shift, to - shift);
        }),
      );
      this.took = performance.now() - began;
      this.plots.forEach((plot, i) => {
        plot.window = windows[i];
        plot.beside = beside[i];
        plot.chart.setData(this.columns(plot), true);
      });
      this.paint();
      await null; // uPlot sets its scales behind this
      for (const { chart, panel, title } of this.plots.filter((plot) => plot.panel.share))
        title.textContent = panel.title + beyond(chart.data, [chart.scales.y.min, chart.scales.y.max], panel.unit);
      this.cursor(this.plots[0].chart);
      this.root.dataset.ready = `${from} ${to}`;
    } catch (problem) {
      if (problem.name !== "AbortError") this.status.replaceChildren(h("span.bad", problem.message));
    }
  }

  reshade() {
    for (const plot of this.plots) plot.chart?.redraw(false);
  }

  close() {
    this.abort?.abort();
    this.observer.disconnect();
    this.axis?.destroy();
    for (const plot of this.plots) plot.chart?.destroy();
  }
}
