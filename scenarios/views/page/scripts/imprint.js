// Where along the neck's contour a lip presses, against time: a map with a mark in time.

import { theme } from "./colours.js";
import { nearest, written } from "./arrays.js";

const LEFT = 46;
const BOTTOM = 22;
const TOP = 18;

/** The imprint of one lip of one run. */
export class ImprintMap {
  constructor(canvas, values, lip, scale) {
    this.canvas = canvas;
    this.values = values;
    this.lip = lip;
    this.scale = scale;
    canvas.addEventListener("pointermove", (event) => this.point(event));
    canvas.addEventListener("pointerleave", () => this.tell());
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  show(run, onTime) {
    this.run = run;
    this.map = null;
    this.canvas.onclick = (event) => onTime(this.run.data.relative_time[this.placeOf(event)[0]]);
    this.canvas.setAttribute(
      "aria-label",
      `${run.label}: pressure of the ${this.lip} lip along the neck's contour against time`,
    );
  }

  move(frame) {
    this.frame = frame;
    this.draw();
    this.tell();
  }

  get imprint() {
    return this.run.data.imprint[this.lip];
  }

  draw() {
    if (!this.run || this.frame === undefined) return;
    const ratio = window.devicePixelRatio || 1;
    const box = this.canvas.getBoundingClientRect();
    if (!box.width) return;
    const [width, height] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
    if (!this.map || this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
      this.map = this.drawnMap(width, height, ratio);
    }
    const c = this.canvas.getContext("2d");
    c.drawImage(this.map, 0, 0);
    const time = this.run.seconds[this.frame];
    const x = this.left(time, width, ratio);
    c.fillStyle = theme.ink;
    c.fillRect(x - ratio, TOP * ratio, 2 * ratio, height - (BOTTOM + TOP) * ratio);
    this.canvas.dataset.timeS = time;
  }

  left(time, width, ratio) {
    const times = this.run.data.time_s;
    const share = (time - times[0]) / (times[times.length - 1] - times[0] || 1);
    return LEFT * ratio + share * (width - (LEFT + 6) * ratio);
  }

  drawnMap(width, height, ratio) {
    const map = document.createElement("canvas");
    map.width = width;
    map.height = height;
    const c = map.getContext("2d");
    c.fillStyle = theme.panel;
    c.fillRect(0, 0, width, height);
    const table = this.run.imprint[this.lip];
    const times = this.run.data.time_s;
    const inner = height - (BOTTOM + TOP) * ratio;
    const high = inner / table.rowLength;
    this.stretches(c, width, inner, ratio);
    for (let k = 0; k < table.rows; k++) {
      const row = table.row(k);
      const before = this.left((times[Math.max(0, k - 1)] + times[k]) / 2, width, ratio);
      const after = this.left((times[Math.min(table.rows - 1, k + 1)] + times[k]) / 2, width, ratio);
      for (let a = 0; a < row.length; a++) {
        if (row[a] === 0) continue;
        c.fillStyle = this.scale.colours[this.scale.index(row[a] * table.unit)];
        c.fillRect(before, TOP * ratio + inner - (a + 1) * high, after - before + 0.6, high + 0.6);
      }
    }
    this.axes(c, width, height, ratio);
    return map;
  }

  /** Shades the thread's crests and names what the contour is made of. */
  stretches(c, width, inner, ratio) {
    const { start_mm: start, step_mm: step, stretches } = this.imprint;
    const end = start + step * this.run.imprint[this.lip].rowLength;
    c.font = `${11 * ratio}px system-ui, sans-serif`;
    c.textAlign = "right";
    for (const [name, [from, to]] of Object.entries(stretches)) {
      const [low, high] = [Math.max(from, start), Math.min(to, end)];
      if (high <= low) continue;
      const top = TOP * ratio + inner * (1 - (high - start) / (end - start));
      const tall = (inner * (high - low)) / (end - start);
      if (name.startsWith("crest")) {
        c.fillStyle = theme.track;
        c.fillRect(LEFT * ratio, top, width, tall);
      }
      if (tall > 12 * ratio) {
        c.fillStyle = theme.quiet;
        c.fillText(name, width - 8 * ratio, top + tall / 2 + 4 * ratio);
      }
    }
  }

  axes(c, width, height, ratio) {
    const { start_mm: start } = this.imprint;
    const length = this.imprint.step_mm * this.run.imprint[this.lip].rowLength;
    const inner = height - (BOTTOM + TOP) * ratio;
    c.fillStyle = theme.ink;
    c.font = `${11 * ratio}px system-ui, sans-serif`;
    c.textAlign = "right";
    for (const share of [0, 0.5, 1]) {
      const y = TOP * ratio + inner * (1 - share);
      const place = Math.min(height - BOTTOM * ratio, y + 4 * ratio);
      c.fillText(written(start + share * length, 1), (LEFT - 6) * ratio, place);
    }
    this.relativeAxis(c, width, ratio);
    c.fillStyle = theme.ink;
    c.textAlign = "center";
    const times = this.run.data.time_s;
    const step = width < 280 * ratio ? 0.5 : 0.25;
    for (let share = 0; share <= 1; share += step) {
      const time = times[0] + share * (times[times.length - 1] - times[0]);
      const inset = share === 0 ? 8 : share === 1 ? -14 : 0;
      const unit = share === 1 ? " s" : "";
      c.fillText(
        written(time, 1) + unit, this.left(time, width, ratio) + inset * ratio, height - 6 * ratio,
      );
    }
  }

  /** Writes relative time above the map, as seconds stand below it. */
  relativeAxis(c, width, ratio) {
    const times = this.run.data.time_s;
    c.fillStyle = theme.quiet;
    for (const [share, align] of [[0, "left"], [0.5, "center"], [1, "right"]]) {
      const time = times[0] + share * (times[times.length - 1] - times[0]);
      c.textAlign = align;
      c.fillText(`${100 * share} %`, this.left(time, width, ratio), 12 * ratio);
    }
  }

  /** The increment and the row of the map under a pointer. */
  placeOf(event) {
    const box = this.canvas.getBoundingClientRect();
    const times = this.run.data.time_s;
    const share = (event.clientX - box.left - LEFT) / (box.width - LEFT - 6);
    const time = times[0] + share * (times[times.length - 1] - times[0]);
    const up = 1 - (event.clientY - box.top - TOP) / (box.height - BOTTOM - TOP);
    const rows = this.run.imprint[this.lip].rowLength;
    const row = Math.max(0, Math.min(rows - 1, Math.floor(up * rows)));
    return [nearest(times, time), row];
  }

  point(event) {
    if (!this.run) return;
    const [increment, row] = this.placeOf(event);
    const table = this.run.imprint[this.lip];
    const { start_mm: start, step_mm: step } = this.imprint;
    this.values.textContent =
      `${written(start + row * step, 2)} mm along the ${this.lip} wall at ` +
      `${written(this.run.data.time_s[increment], 2)} s: ` +
      `${written(table.at(increment, row), table.decimals)} kPa`;
  }

  tell() {
    if (!this.run) return;
    const table = this.run.imprint[this.lip];
    const row = table.row(this.run.data.increment[this.frame]);
    let highest = 0;
    for (let a = 1; a < row.length; a++) {
      if (Math.abs(row[a]) > Math.abs(row[highest])) highest = a;
    }
    const { start_mm: start, step_mm: step } = this.imprint;
    this.values.textContent = row[highest] !== 0
      ? `now up to ${written(row[highest] * table.unit, table.decimals)} kPa at ` +
        `${written(start + highest * step, 2)} mm of the ${this.lip} wall's contour`
      : `now the ${this.lip} wall is not touched${this.run.isDifference ? " differently" : ""}`;
  }
}
