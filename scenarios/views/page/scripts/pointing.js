// What is at a place of the section, in words and numbers with units.

import { written } from "./arrays.js";
import { LIPS } from "./run.js";

const CORNERS = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];
const RIGID = {
  upper_tooth: "upper teeth",
  lower_tooth: "lower teeth",
  upper_jaw: "upper jaw bone",
  lower_jaw: "lower jaw bone",
  package: "package",
};

/**
 * Describes what is at a place (mm) in a frame: skin within `reachMm` first, then neck, tissue, and
 * what is rigid in the head.
 */
export function described(run, frame, place, reachMm, fields) {
  run.place(frame);
  return (
    skinAt(run, frame, place, reachMm) ??
    wallAt(run, frame, place) ??
    tissueAt(run, frame, place, fields) ??
    rigidAt(run, frame, place) ??
    `nothing at (${written(place[0], 2)}, ${written(place[1], 2)}) mm of the head frame`
  );
}

function skinAt(run, frame, [x, y], reachMm) {
  let best = reachMm;
  let found = null;
  for (const lip of LIPS) {
    if (!run.contact[lip]) continue;
    run.skin(lip, frame).points.forEach(([px, py], k) => {
      const distance = Math.hypot(px - x, py - y);
      if (distance < best) {
        best = distance;
        found = [lip, k];
      }
    });
  }
  if (!found) return null;
  const [lip, k] = found;
  const value = (name) => {
    const table = run.contact[lip][name];
    return written(table.at(frame, k), table.decimals);
  };
  const arc = written(run.data.contact[lip].arc_mm[k], 2);
  const place = run.contact[lip].neck_arc_mm.at(frame, k);
  const touched = run.contact[lip].pressure_kpa.at(frame, k) > 0 && Number.isFinite(place);
  const on = touched
    ? `, on the neck's ${stretchAt(run, lip, place)} (${written(place, 2)} mm along its contour)`
    : "";
  return (
    `${lip} lip's skin, point ${k}, ${arc} mm along it: contact pressure ` +
    `${value("pressure_kpa")} kPa, shear ${value("shear_kpa")} kPa, gap ${value("gap_mm")} mm${on}`
  );
}

function stretchAt(run, lip, place) {
  for (const [name, [from, to]] of Object.entries(run.data.imprint[lip].stretches)) {
    if (from <= place && place <= to) return name;
  }
  return "bore";
}

function tissueAt(run, frame, [x, y], fields) {
  const e = elementAt(run, x, y);
  if (e < 0) return null;
  const region = run.data.region_names[run.data.region[e]].replace("_", " ");
  const values = fields.map(({ name, title, unit, decimals }) => {
    const value = written(run.element[name].at(frame, e), decimals);
    return `${title.replace(" in dermis", "")} ${value}${unit ? ` ${unit}` : ""}`;
  });
  const node = nearestNode(run, e, x, y);
  const moved = [0, 1].map((axis) => written(run.displacement.at(frame, 2 * node + axis), 3));
  return (
    `${region}, element ${e}: ${values.join(", ")}; ` +
    `node ${node} moved by (${moved.join(", ")}) mm`
  );
}

/** The element at a place of the deformed section, -1 outside. */
export function elementAt(run, x, y) {
  const at = run.positions;
  for (let e = 0; e < run.triangles.rows; e++) {
    const t = run.triangles.row(e);
    for (const [a, b, c] of CORNERS) {
      if (holds(at, t[a], t[b], t[c], x, y)) return e;
    }
  }
  return -1;
}

function holds(at, a, b, c, x, y) {
  const side = (p, q) =>
    (at[2 * q] - at[2 * p]) * (y - at[2 * p + 1]) - (at[2 * q + 1] - at[2 * p + 1]) * (x - at[2 * p]);
  const [u, v, w] = [side(a, b), side(b, c), side(c, a)];
  return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

function nearestNode(run, e, x, y) {
  const at = run.positions;
  let best = Infinity;
  let found = -1;
  for (const node of run.triangles.row(e)) {
    const distance = Math.hypot(at[2 * node] - x, at[2 * node + 1] - y);
    if (distance < best) {
      best = distance;
      found = node;
    }
  }
  return found;
}

function wallAt(run, frame, place) {
  for (const lip of LIPS) {
    const name = `${lip}_wall`;
    if (!run.data.outlines[name] || !inside(run.outline(name, frame), place)) continue;
    const pressure = run.contact[lip].pressure_kpa;
    const highest = pressure.row(frame).reduce((a, b) => Math.max(a, b), 0) * pressure.unit;
    const pressed = highest > 0
      ? `the ${lip} lip presses it with up to ${written(highest, pressure.decimals)} kPa`
      : `the ${lip} lip does not touch it`;
    const [angle, x, y] = run.data.placement[frame];
    return (
      `neck, ${lip} wall: ${pressed}; lower mark at (${written(x, 2)}, ${written(y, 2)}) mm, ` +
      `turned by ${written((180 / Math.PI) * angle, 2)}°`
    );
  }
  return null;
}

function rigidAt(run, frame, place) {
  for (const [name, words] of Object.entries(RIGID)) {
    if (run.data.outlines[name] && inside(run.outline(name, frame), place)) return words;
  }
  return null;
}

function inside(points, [x, y]) {
  let odd = false;
  for (let i = 0, j = points.length - 1; i < points.length; j = i++) {
    const [ax, ay] = points[i];
    const [bx, by] = points[j];
    if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) odd = !odd;
  }
  return odd;
}
