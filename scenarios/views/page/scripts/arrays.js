// Arrays of a page: base64, deflated, differences from row to row. See packed.py.

const ABSENT = { int16: -32768, int32: -2147483648 };

/** A table of whole numbers with a fixed number of decimals: rows of equal length. */
export class Table {
  constructor(values, rowLength, rows, decimals, absent) {
    this.values = values;
    this.rowLength = rowLength;
    this.rows = rows;
    this.decimals = decimals;
    this.unit = 10 ** -decimals;
    this.absent = absent;
  }

  /** The row as whole numbers, in units of the last decimal. */
  row(index) {
    return this.values.subarray(index * this.rowLength, (index + 1) * this.rowLength);
  }

  /** The value as a number; NaN where there is none. */
  at(row, column) {
    const whole = this.values[row * this.rowLength + column];
    return whole === this.absent ? NaN : whole * this.unit;
  }
}

/** Reads what `packed` of packed.py wrote. */
export async function unpacked({ data, shape, type, decimals }) {
  const text = atob(data);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(stream).arrayBuffer();
  const values = type === "int16" ? new Int16Array(buffer) : new Int32Array(buffer);
  const rowLength = shape.slice(1).reduce((a, b) => a * b, 1);
  // Sums wrap around as the differences did.
  for (let i = rowLength; i < values.length; i++) values[i] += values[i - rowLength];
  return new Table(values, rowLength, shape[0], decimals, ABSENT[type]);
}

/** The index of the value nearest to `wanted` in an increasing list. */
export function nearest(sorted, wanted) {
  let low = 0;
  let high = sorted.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (sorted[middle] <= wanted) low = middle;
    else high = middle;
  }
  return Math.abs(sorted[low] - wanted) <= Math.abs(sorted[high] - wanted) ? low : high;
}

/** The value at `x` of a polyline through (xs, ys), constant beyond its ends. */
export function interpolated(xs, ys, x) {
  if (x <= xs[0]) return ys[0];
  const last = xs.length - 1;
  if (x >= xs[last]) return ys[last];
  let i = nearest(xs, x);
  if (xs[i] > x) i -= 1;
  const share = (x - xs[i]) / (xs[i + 1] - xs[i]);
  return ys[i] + share * (ys[i + 1] - ys[i]);
}

/** A number as the page writes it, with a real minus sign. */
export function written(value, decimals) {
  if (!Number.isFinite(value)) return "–";
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? (0).toFixed(decimals) : text.replace("-", "−");
}
