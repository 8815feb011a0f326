// One run: its arrays, and where everything is at an increment.

import { nearest, unpacked } from "./arrays.js";

export const LIPS = ["upper", "lower"];

/** A run whose arrays are read when it is first shown. */
export class Run {
  constructor(data) {
    this.data = data;
    this.label = data.label;
    this.relative = data.increment.map((i) => data.relative_time[i]);
    this.seconds = data.increment.map((i) => data.time_s[i]);
    this.placedFrame = -1;
  }

  /** Reads the arrays, once. */
  async read() {
    if (this.nodes) return this;
    const { data } = this;
    const read = { element: {}, contact: {}, imprint: {} };
    const jobs = [];
    const into = (place, key, packed) =>
      jobs.push(unpacked(packed).then((table) => { place[key] = table; }));
    into(read, "nodeTable", data.nodes);
    into(read, "triangles", data.triangles);
    into(read, "displacement", data.displacement);
    for (const [name, packed] of Object.entries(data.element)) into(read.element, name, packed);
    for (const lip of Object.keys(data.contact)) {
      read.contact[lip] = {};
      for (const name of ["pressure_kpa", "shear_kpa", "gap_mm", "neck_arc_mm"]) {
        into(read.contact[lip], name, data.contact[lip][name]);
      }
      into(read.imprint, lip, data.imprint[lip].pressure_kpa);
    }
    await Promise.all(jobs);
    // Arrays leave the text they came from to be collected.
    data.displacement = data.element = null;
    Object.assign(this, read);
    this.nodes = Float64Array.from(read.nodeTable.values, (v) => v * read.nodeTable.unit);
    this.positions = new Float32Array(this.nodes.length);
    this.isDermis = Uint8Array.from(data.region, (r) => data.region_names[r].endsWith("dermis"));
    return this;
  }

  get frames() {
    return this.relative.length;
  }

  /** The frame nearest to a relative time. */
  frameAt(relative) {
    return nearest(this.relative, relative);
  }

  /** Puts `positions` (x, y of every node, mm) to where they are in a frame. */
  place(frame) {
    if (frame === this.placedFrame) return;
    const moved = this.displacement.row(frame);
    const { nodes, positions } = this;
    for (let i = 0; i < nodes.length; i++) positions[i] = nodes[i] + 0.001 * moved[i];
    this.placedFrame = frame;
  }

  /** The place in the head frame of a point of the neck frame. */
  fromNeck(point, frame) {
    return placed(point, this.data.placement[frame]);
  }

  /** An outline in the head frame. */
  outline(name, frame) {
    const { points, moves } = this.data.outlines[name];
    const courses = { neck: this.data.placement, jaw: this.data.jaw };
    const course = courses[moves];
    return course ? points.map((point) => placed(point, course[frame])) : points;
  }

  /** The force of both lips on the neck, mN for each mm of width, forward and up. */
  handForce(frame) {
    const increment = this.data.increment[frame];
    return ["x", "y"].map((axis) => {
      const both = LIPS.map((lip) => this.data.history[`${lip}_lip_force_${axis}_n`][increment]);
      return (1000 * (both[0] + both[1])) / this.data.thickness_mm;
    });
  }

  /** The contact points of a lip: places, outward normals and pressures (kPa). */
  skin(lip, frame) {
    this.place(frame);
    const { first, second, weight, outward } = this.data.contact[lip];
    const { positions } = this;
    const points = first.map((a, k) => {
      const b = second[k];
      const w = weight[k];
      return [
        (1 - w) * positions[2 * a] + w * positions[2 * b],
        (1 - w) * positions[2 * a + 1] + w * positions[2 * b + 1],
      ];
    });
    const normals = points.map((_, k) => {
      const before = points[Math.max(0, k - 1)];
      const after = points[Math.min(points.length - 1, k + 1)];
      const tx = after[0] - before[0];
      const ty = after[1] - before[1];
      const length = Math.hypot(tx, ty) || 1;
      return [(-outward * ty) / length, (outward * tx) / length];
    });
    const row = this.contact[lip].pressure_kpa.row(frame);
    const pressures = Array.from(row, (v) => v * this.contact[lip].pressure_kpa.unit);
    return { points, normals, pressures };
  }

  /** The centres of the undeformed elements, x and y in turn. */
  centres() {
    if (this.centresKnown) return this.centresKnown;
    const { triangles, nodes } = this;
    const centres = new Float64Array(2 * triangles.rows);
    for (let e = 0; e < triangles.rows; e++) {
      const t = triangles.row(e);
      for (let axis = 0; axis < 2; axis++) {
        centres[2 * e + axis] =
          (nodes[2 * t[0] + axis] + nodes[2 * t[1] + axis] + nodes[2 * t[2] + axis]) / 3;
      }
    }
    this.centresKnown = centres;
    return centres;
  }
}

/** A point turned by an angle, then shifted. */
function placed([x, y], [angle, dx, dy]) {
  const c = Math.cos(angle);
  const s = Math.sin(angle);
  return [c * x - s * y + dx, s * x + c * y + dy];
}

/** For each element of `run` the nearest of `other` in the same tissue; -1 beyond `reach` mm. */
export function counterparts(run, other, reach = 0.8) {
  const mine = run.centres();
  const theirs = other.centres();
  const cells = new Map();
  const cell = (x, y) => `${Math.floor(x / reach)} ${Math.floor(y / reach)}`;
  for (let o = 0; o < other.triangles.rows; o++) {
    const key = cell(theirs[2 * o], theirs[2 * o + 1]);
    if (!cells.has(key)) cells.set(key, []);
    cells.get(key).push(o);
  }
  const found = new Int32Array(run.triangles.rows).fill(-1);
  for (let e = 0; e < found.length; e++) {
    const [x, y] = [mine[2 * e], mine[2 * e + 1]];
    let best = reach * reach;
    for (let k = 0; k < 9; k++) {
      const near = cell(x + ((k % 3) - 1) * reach, y + (Math.floor(k / 3) - 1) * reach);
      for (const o of cells.get(near) ?? []) {
        if (other.isDermis[o] !== run.isDermis[e]) continue;
        const distance = (x - theirs[2 * o]) ** 2 + (y - theirs[2 * o + 1]) ** 2;
        if (distance < best) {
          best = distance;
          found[e] = o;
        }
      }
    }
  }
  return found;
}
