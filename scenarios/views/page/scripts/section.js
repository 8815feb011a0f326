// The deformed section of a run on a canvas: tissue coloured by a field, neck, teeth, contact.

import { theme } from "./colours.js";
import { LIPS } from "./run.js";

const PARTS = [
  // name, fill (the package has its theme's), edge; drawn in this order below the tissue
  ["package", null, null],
  ["upper_jaw", "#dcd8cf", "#a8a294"],
  ["lower_jaw", "#dcd8cf", "#a8a294"],
  ["upper_tooth", "#f7f4ea", "#a8a294"],
  ["lower_tooth", "#f7f4ea", "#a8a294"],
];
const WALLS = ["upper_wall", "lower_wall"];
const BULK = "#efc9b8";
const NO_VALUE = "#e8e6e1";
const SKIN = "#7c4a3c";
const NECK = "#6d7f92";
const NECK_EDGE = "#3e4c5b";
const BAND_PX = 46;
const AROUND = [0, 3, 1, 4, 2, 5];

/** Draws one run, or the difference of two, on a canvas that keeps its size on the page. */
export class SectionView {
  constructor(canvas, camera) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.camera = camera;
    this.probe = null;
  }

  /** What is shown: `value(frame, element)` in the dermis by `scale`; NaN stays grey. */
  show(run, frame, scale, value, pressureScale) {
    Object.assign(this, { run, frame, scaleOfField: scale, value, pressureScale });
    this.draw();
  }

  fit() {
    const ratio = window.devicePixelRatio || 1;
    const box = this.canvas.getBoundingClientRect();
    const width = Math.max(1, Math.round(box.width * ratio));
    const height = Math.max(1, Math.round(box.height * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    this.ratio = ratio;
    this.px = this.camera.scale(width / ratio, height / ratio) * ratio;
  }

  x(mm) {
    return this.canvas.width / 2 + (mm - this.camera.x) * this.px;
  }

  y(mm) {
    return this.canvas.height / 2 - (mm - this.camera.y) * this.px;
  }

  /** The place (mm) of a point of the canvas, CSS px from its upper left corner. */
  placeOf(left, top) {
    return [
      this.camera.x + (left * this.ratio - this.canvas.width / 2) / this.px,
      this.camera.y - (top * this.ratio - this.canvas.height / 2) / this.px,
    ];
  }

  draw() {
    if (!this.run) return;
    this.fit();
    const { context: c, run, frame } = this;
    run.place(frame);
    c.fillStyle = theme.panel;
    c.fillRect(0, 0, this.canvas.width, this.canvas.height);
    c.lineJoin = "round";
    for (const [name, fill, edge] of PARTS) this.area(name, fill, edge, 1);
    this.profile();
    this.tissue();
    for (const wall of WALLS) this.area(wall, NECK, NECK_EDGE, 1);
    for (const lip of LIPS) this.band(lip);
    this.hand();
    this.ruler();
    if (this.probe) this.cross(this.probe);
    const { dataset } = this.canvas;
    dataset.timeS = run.seconds[frame];
    dataset.pxPerMm = this.px / this.ratio;
    dataset.centre = `${this.camera.x} ${this.camera.y}`;
  }

  area(name, fill, edge, width) {
    const { context: c, run } = this;
    if (!run.data.outlines[name]) return;
    c.beginPath();
    for (const [x, y] of run.outline(name, this.frame)) c.lineTo(this.x(x), this.y(y));
    c.closePath();
    c.fillStyle = fill ?? theme.package;
    c.fill();
    if (edge) this.stroke(edge, width);
  }

  profile() {
    const line = this.run.data.outlines.profile;
    if (!line) return;
    const { context: c } = this;
    c.beginPath();
    for (const [x, y] of line.points) c.lineTo(this.x(x), this.y(y));
    this.stroke(theme.quiet, 1);
  }

  stroke(colour, width) {
    this.context.strokeStyle = colour;
    this.context.lineWidth = width * this.ratio;
    this.context.stroke();
  }

  tissue() {
    const { context: c, run } = this;
    for (const [name, loops] of Object.entries(run.data.loops)) {
      if (name.endsWith("dermis")) continue;
      this.loops(loops);
      c.fillStyle = BULK;
      c.fill("evenodd");
    }
    this.elements();
    for (const loops of Object.values(run.data.loops)) {
      this.loops(loops);
      this.stroke(SKIN, 0.8);
    }
  }

  loops(loops) {
    const { context: c } = this;
    const at = this.run.positions;
    c.beginPath();
    for (const loop of loops) {
      loop.forEach((node, k) => {
        const x = this.x(at[2 * node]);
        const y = this.y(at[2 * node + 1]);
        if (k) c.lineTo(x, y);
        else c.moveTo(x, y);
      });
      c.closePath();
    }
  }

  /** Fills the tissue that a field colours: one path for each colour, which is what makes it fast. */
  elements() {
    const { context: c, run, scaleOfField: scale } = this;
    const at = run.positions;
    const bins = new Map();
    for (let e = 0; e < run.triangles.rows; e++) {
      if (!scale.whole && !run.isDermis[e]) continue;
      const value = this.value(this.frame, e);
      const colour = Number.isNaN(value) ? NO_VALUE : scale.colours[scale.index(value)];
      if (!bins.has(colour)) bins.set(colour, []);
      bins.get(colour).push(e);
    }
    for (const [colour, elements] of bins) {
      c.beginPath();
      for (const e of elements) {
        const t = run.triangles.row(e);
        c.moveTo(this.x(at[2 * t[0]]), this.y(at[2 * t[0] + 1]));
        for (let k = 1; k < 6; k++) {
          const node = t[AROUND[k]];
          c.lineTo(this.x(at[2 * node]), this.y(at[2 * node + 1]));
        }
        c.closePath();
      }
      c.fillStyle = colour;
      c.fill();
      this.stroke(colour, 0.5);
    }
  }

  /** The pressure of a lip as a band that stands off its skin. */
  band(lip) {
    if (!this.run.contact[lip]) return;
    const { context: c, pressureScale: scale } = this;
    const { points, normals, pressures } = this.run.skin(lip, this.frame);
    const tip = (k) => {
      const height = (BAND_PX * this.ratio * pressures[k]) / scale.limit;
      return [
        this.x(points[k][0]) + normals[k][0] * height,
        this.y(points[k][1]) - normals[k][1] * height,
      ];
    };
    for (let k = 0; k + 1 < points.length; k++) {
      const middle = (pressures[k] + pressures[k + 1]) / 2;
      if (!(middle > 0)) continue;
      c.beginPath();
      c.moveTo(this.x(points[k][0]), this.y(points[k][1]));
      c.lineTo(...tip(k));
      c.lineTo(...tip(k + 1));
      c.lineTo(this.x(points[k + 1][0]), this.y(points[k + 1][1]));
      c.closePath();
      c.fillStyle = scale.colours[scale.index(middle)];
      c.fill();
      this.stroke(c.fillStyle, 0.6);
      c.beginPath();
      c.moveTo(...tip(k));
      c.lineTo(...tip(k + 1));
      this.stroke(theme.ink, 1);
      c.beginPath();
      c.moveTo(this.x(points[k][0]), this.y(points[k][1]));
      c.lineTo(this.x(points[k + 1][0]), this.y(points[k + 1][1]));
      this.stroke(scale.colours[scale.index(middle)], 4);
    }
  }

  /** The force of both lips on the hand, an arrow at the neck's lower mark. */
  hand() {
    const [fx, fy] = this.run.handForce(this.frame);
    const size = Math.hypot(fx, fy);
    if (size < 0.5) return;
    const { context: c } = this;
    const [mx, my] = this.run.fromNeck([0, 0], this.frame);
    const length = (14 + 2 * Math.min(size, 40)) * this.ratio;
    const [ux, uy] = [fx / size, fy / size];
    const [x, y] = [this.x(mx), this.y(my)];
    const [ex, ey] = [x + ux * length, y - uy * length];
    c.beginPath();
    c.moveTo(x, y);
    c.lineTo(ex, ey);
    const head = 7 * this.ratio;
    c.moveTo(ex - head * (ux - 0.5 * uy), ey + head * (uy + 0.5 * ux));
    c.lineTo(ex, ey);
    c.lineTo(ex - head * (ux + 0.5 * uy), ey + head * (uy - 0.5 * ux));
    this.stroke(theme.ink, 2);
  }

  ruler() {
    const { context: c, canvas, ratio } = this;
    const lengths = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20];
    const length = lengths.find((mm) => mm * this.px > 50 * ratio) ?? 20;
    const x = 12 * ratio;
    const y = canvas.height - 12 * ratio;
    c.beginPath();
    c.moveTo(x, y);
    c.lineTo(x + length * this.px, y);
    this.stroke(theme.panel, 6);
    this.stroke(theme.ink, 3);
    c.fillStyle = theme.ink;
    c.font = `${13 * ratio}px system-ui, sans-serif`;
    c.strokeStyle = theme.panel;
    c.lineWidth = 3 * ratio;
    c.strokeText(`${length} mm`, x, y - 6 * ratio);
    c.fillText(`${length} mm`, x, y - 6 * ratio);
  }

  cross([x, y]) {
    const { context: c, ratio } = this;
    const reach = 9 * ratio;
    c.beginPath();
    c.moveTo(this.x(x) - reach, this.y(y));
    c.lineTo(this.x(x) + reach, this.y(y));
    c.moveTo(this.x(x), this.y(y) - reach);
    c.lineTo(this.x(x), this.y(y) + reach);
    this.stroke("#ffffff", 4);
    this.stroke("#000000", 1.5);
  }
}
