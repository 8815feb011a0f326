// Histories of one or two runs: curves, thresholds, the difference in red and blue, a mark in time.

import { theme } from "./colours.js";
import { interpolated, nearest, written } from "./arrays.js";

const HEIGHT = 190;
const SPLITS_PX = 60;
const TIME_PX = 22;
const FONT = "12px system-ui, sans-serif";

/** One history on the page: a figure with its curves and a line of values at the instant. */
export class HistoryChart {
  constructor(figure, name, page, onTime) {
    this.figure = figure;
    this.name = name;
    this.page = page;
    this.place = figure.querySelector(".curve");
    this.values = figure.querySelector(".values");
    this.onTime = onTime;
    new ResizeObserver(() => this.resize()).observe(this.place);
  }

  /**
   * Draws these runs with these styles ({colour, dash}), the difference between two of them.
   *
   * Both lie along relative time, which the axis above tells; those below tell the seconds of each.
   */
  show(runs, styles) {
    this.runs = runs;
    this.plot?.destroy();
    this.xs = runs.map((run) => run.data.relative_time);
    const grid = [...new Set(this.xs.flat())].sort((a, b) => a - b);
    const lines = runs.map((run, i) =>
      grid.map((x) => interpolated(this.xs[i], run.data.history[this.name], x)),
    );
    const series = styles.map(({ colour, dash }, i) => ({
      label: runs[i].label, stroke: colour, width: 1.8, dash, points: { show: false },
    }));
    this.plot = new uPlot(
      {
        width: Math.max(200, this.place.clientWidth),
        height: HEIGHT,
        legend: { show: false },
        cursor: { drag: { x: false, y: false }, y: false, points: { show: false } },
        scales: { x: { time: false }, y: { range: (_, low, high) => this.range(low, high) } },
        axes: [...this.timeAxes(runs, styles), axis(this.unit(), { size: 52 })],
        series: [{}, ...series],
        hooks: {
          setCursor: [(plot) => this.hover(plot)],
          drawClear: [(plot) => this.difference(plot), (plot) => this.doubt(plot, styles)],
          draw: [(plot) => this.threshold(plot)],
          init: [(plot) => this.listen(plot)],
          ready: [() => this.frames && this.move(this.frames)],
        },
      },
      [grid, ...lines],
      this.place,
    );
    this.mark = document.createElement("div");
    this.mark.className = "mark";
    this.plot.over.append(this.mark);
  }

  /** Relative time above, and below seconds: once for all runs that were as long, else for each. */
  timeAxes(runs, styles) {
    const ends = runs.map((run) => [run.data.time_s[0], run.data.time_s.at(-1)]);
    const alike = ends.every(([from, to]) => from === ends[0][0] && to === ends[0][1]);
    const below = ends.slice(0, alike ? 1 : ends.length).map((span, i) => axis(null, {
      scale: "x", side: 2, size: TIME_PX, gap: 1, grid: { show: false },
      ...(alike ? {} : { stroke: styles[i].colour }),
      splits: (plot) => secondsAt(span, plot.bbox.width / devicePixelRatio / SPLITS_PX),
      values: (_, places) => places.map((x) => `${written(span[0] + x * (span[1] - span[0]), 1)} s`),
    }));
    const above = axis(null, {
      scale: "x", side: 0, size: TIME_PX, gap: 1, stroke: theme.quiet,
      splits: () => [0, 0.2, 0.4, 0.6, 0.8, 1],
      values: (_, places) => places.map((x) => `${written(100 * x, 0)} %`),
    });
    return [above, ...below];
  }

  unit() {
    return this.page.quantities[this.name].unit || "log strain";
  }

  decimals() {
    return { kPa: 1, mm: 3, N: 4, "": 3 }[this.page.quantities[this.name].unit] ?? 3;
  }

  listen(plot) {
    plot.over.addEventListener("click", () => {
      const x = plot.posToVal(plot.cursor.left, "x");
      this.onTime(x);
    });
    plot.over.addEventListener("mouseleave", () => this.tell());
  }

  /** Moves the mark and the values to an instant: a frame of each run. */
  move(frames) {
    this.frames = frames;
    const increment = this.runs[0].data.increment[frames[0]];
    const x = this.xs[0][increment];
    this.mark.style.transform = `translateX(${this.plot.valToPos(x, "x")}px)`;
    this.figure.dataset.timeS = this.runs[0].data.time_s[increment];
    this.tell();
  }

  tell() {
    if (!this.frames) return;
    this.say(this.runs.map((run, i) => run.data.increment[this.frames[i]]));
  }

  hover(plot) {
    if (plot.cursor.left < 0 || plot.cursor.left === null) return;
    const x = plot.posToVal(plot.cursor.left, "x");
    this.say(this.xs.map((xs) => nearest(xs, x)));
  }

  /** Writes the values of each run at an increment of its own. */
  say(increments) {
    const decimals = this.decimals();
    const values = this.runs.map((run, i) => run.data.history[this.name][increments[i]]);
    const unit = this.page.quantities[this.name].unit;
    const parts = this.runs.map((run, i) => {
      const time = written(run.data.time_s[increments[i]], 2);
      return `${run.label} ${written(values[i], decimals)}${unit ? ` ${unit}` : ""} at ${time} s`;
    });
    if (values.length > 1) parts.push(`difference ${written(values[1] - values[0], decimals)}`);
    this.values.textContent = parts.join(" · ");
  }

  /** The bands of what recordings leave open, of the runs that have them: [number, low, high]. */
  bands() {
    return this.runs.flatMap((run, i) => {
      const band = run.data.bands[this.name];
      return band ? [[i, ...band]] : [];
    });
  }

  range(low, high) {
    const ends = this.bands().flatMap(([, lows, highs]) => [Math.min(...lows), Math.max(...highs)]);
    return uPlot.rangeNum(Math.min(low, ...ends), Math.max(high, ...ends), 0.1, true);
  }

  /** Fills the band of each run. */
  doubt(plot, styles) {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.globalAlpha = 0.22;
    for (const [i, lows, highs] of this.bands()) {
      const xs = this.xs[i].map((x) => plot.valToPos(x, "x", true));
      ctx.beginPath();
      lows.forEach((low, k) => ctx.lineTo(xs[k], plot.valToPos(low, "y", true)));
      for (let k = highs.length - 1; k >= 0; k--) {
        ctx.lineTo(xs[k], plot.valToPos(highs[k], "y", true));
      }
      ctx.fillStyle = styles[i].colour;
      ctx.fill();
    }
    ctx.restore();
  }

  /** Fills between the two curves: red where the second lies above the first, blue below. */
  difference(plot) {
    if (this.runs.length < 2) return;
    const { ctx, data } = plot;
    const [grid, first, second] = data;
    const y = (value) => plot.valToPos(value, "y", true);
    for (let k = 0; k + 1 < grid.length; k++) {
      const [left, right] = [plot.valToPos(grid[k], "x", true), plot.valToPos(grid[k + 1], "x", true)];
      ctx.fillStyle = second[k] + second[k + 1] > first[k] + first[k + 1] ? theme.above : theme.below;
      ctx.beginPath();
      ctx.moveTo(left, y(first[k]));
      ctx.lineTo(right, y(first[k + 1]));
      ctx.lineTo(right, y(second[k + 1]));
      ctx.lineTo(left, y(second[k]));
      ctx.fill();
    }
  }

  /** Draws the threshold that the quantity has if it lies within the axis, and says where it is. */
  threshold(plot) {
    const found = thresholdOf(this.name, this.page);
    if (!found) return;
    const above = found.low > plot.scales.y.max;
    this.figure.querySelector(".limit").textContent = `${found.words}${above ? ", above ↑" : ""}`;
    if (above) return;
    const { ctx, bbox } = plot;
    ctx.fillStyle = theme.warning;
    ctx.fillRect(bbox.left, plot.valToPos(found.low, "y", true), bbox.width, 2);
  }

  resize() {
    if (this.plot && this.place.clientWidth) {
      this.plot.setSize({ width: this.place.clientWidth, height: HEIGHT });
      if (this.frames) this.move(this.frames);
    }
  }
}

function thresholdOf(name, page) {
  if (name.endsWith("_kpa") && name.includes("_lip_")) {
    const { low } = page.pain;
    return { low, words: `pain from ${low.toFixed(0)} kPa` };
  }
  if (name === "dermis_max_log_strain") {
    const { low } = page.failure;
    return { low, words: `skin tears at ${low.toFixed(2)}` };
  }
  return null;
}

/** Places (0 to 1) of about `count` round numbers of seconds between two ends. */
function secondsAt([from, to], count) {
  const steps = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 60];
  const step = steps.find((one) => (to - from) / one <= count) ?? steps.at(-1);
  const places = [];
  for (let k = Math.ceil(from / step - 1e-9); k * step <= to + 1e-9; k++) {
    places.push((k * step - from) / (to - from || 1));
  }
  return places;
}

function axis(label, more) {
  return {
    ...(label ? { label } : {}),
    stroke: theme.ink,
    font: FONT,
    labelFont: FONT,
    labelSize: 16,
    grid: { stroke: theme.track, width: 1 },
    ticks: { stroke: theme.line, width: 1, size: 4 },
    ...more,
  };
}
