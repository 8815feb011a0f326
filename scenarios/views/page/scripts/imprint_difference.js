// By how much more the second of two runs presses, along the neck's contour and in time.

import { Table, nearest } from "./arrays.js";
import { LIPS } from "./run.js";

/**
 * What an imprint's map shows of a run, with the pressure of the second less that of the first.
 *
 * Instants are those of the first, and of the second at the same relative time. Places are those of
 * the first contour; where necks differ they are counted from the start of the rim of each.
 */
export function imprintDifference(first, second) {
  const imprint = {};
  const described = {};
  for (const lip of LIPS) {
    if (!first.imprint[lip] || !second.imprint[lip]) continue;
    imprint[lip] = difference(first, second, lip);
    described[lip] = first.data.imprint[lip];
  }
  return {
    label: `${second.label} less ${first.label}`,
    seconds: first.seconds,
    isDifference: true,
    imprint,
    data: { ...first.data, imprint: described },
  };
}

function difference(first, second, lip) {
  const [mine, theirs] = [first.imprint[lip], second.imprint[lip]];
  const from = first.data.imprint[lip];
  const to = second.data.imprint[lip];
  const apart = (to.stretches.rim?.[0] ?? 0) - (from.stretches.rim?.[0] ?? 0);
  // The step is the same in all runs, so that places fall together but for less than half of it.
  const shift = Math.round((from.start_mm + apart - to.start_mm) / from.step_mm);
  const values = new Int32Array(mine.values.length);
  for (let k = 0; k < mine.rows; k++) {
    const row = mine.row(k);
    const at = nearest(second.data.relative_time, first.data.relative_time[k]);
    const other = theirs.row(at);
    for (let a = 0; a < row.length; a++) {
      values[k * row.length + a] = (other[a + shift] ?? 0) - row[a];
    }
  }
  return new Table(values, mine.rowLength, mine.rows, mine.decimals, mine.absent);
}
