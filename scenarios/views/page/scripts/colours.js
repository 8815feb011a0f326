// Colour scales: a value to one of a list of colours, and a legend that says what it cuts.

import { written } from "./arrays.js";

const THEME = [
  "panel", "ink", "quiet", "line", "package", "upper", "lower", "warning", "track", "above", "below",
];
const DARK = window.matchMedia("screen and (prefers-color-scheme: dark)");

/** The colours of the page's style sheet, by name. */
export const theme = {};

/** Reads the colours that hold now, and calls `changed` whenever others do. */
export function followTheme(changed) {
  const read = () => {
    const style = getComputedStyle(document.documentElement);
    for (const name of THEME) theme[name] = style.getPropertyValue(`--${name}`).trim();
    theme.isDark = DARK.matches;
  };
  read();
  DARK.addEventListener("change", () => {
    read();
    changed();
  });
}

/** Colours from 0 to `limit`; low values tell apart, as the colours go with the square root. */
export class Scale {
  constructor({ title, unit, decimals, limit, colours, whole = false }) {
    Object.assign(this, { title, unit, decimals, limit, colours, whole });
  }

  /** Which of the colours a value has. */
  index(value) {
    if (!(value > 0)) return 0;
    const share = Math.sqrt(value / this.limit);
    return Math.min(this.colours.length - 1, Math.floor(share * this.colours.length));
  }

  /** Values at places (0 to 1) of the legend. */
  tick(share) {
    return this.limit * share * share;
  }
}

/** Colours that reach as far below a centre as above it. */
export class CentredScale {
  constructor({ title, unit, decimals, limit, colours, centre = 0, whole = false }) {
    Object.assign(this, { title, unit, decimals, limit, colours, centre, whole });
  }

  index(value) {
    const share = ((value - this.centre) / this.limit + 1) / 2;
    const last = this.colours.length - 1;
    return Math.max(0, Math.min(last, Math.floor(share * this.colours.length)));
  }

  tick(share) {
    return this.centre + this.limit * (2 * share - 1);
  }
}

/** The scale of a field: around its centre where it has one. */
export function scaleOf(field) {
  return field.centre ? new CentredScale(field) : new Scale(field);
}

/** Fills `place` with the legend of a scale. */
export function showLegend(place, scale, note = "") {
  const title = document.createElement("span");
  title.textContent = `${scale.title}${scale.unit ? `, ${scale.unit}` : ""}${note}`;
  const strip = document.createElement("span");
  strip.className = "colours";
  strip.style.background = `linear-gradient(to right, ${scale.colours.join(", ")})`;
  const ticks = document.createElement("span");
  ticks.className = "ticks";
  for (const share of [0, 0.25, 0.5, 0.75, 1]) {
    const tick = document.createElement("span");
    const value = scale.tick(share);
    tick.textContent = written(value, Math.abs(scale.limit) >= 20 ? 0 : 2);
    ticks.append(tick);
  }
  place.replaceChildren(title, strip, ticks);
}
