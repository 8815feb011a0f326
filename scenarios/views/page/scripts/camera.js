// What part of the head's plane is seen: shared by all sections, so that they show the same.

const CLOSEST_PX_PER_MM = 2000;

/** Centre (mm) and magnification, in multiples of what shows the whole window. */
export class Camera {
  constructor(window) {
    this.listeners = [];
    this.window = window;
    this.reset();
  }

  /** Shows the whole window again. */
  reset() {
    const [left, bottom, right, top] = this.window;
    this.x = (left + right) / 2;
    this.y = (bottom + top) / 2;
    this.zoom = 1;
    this.changed();
  }

  changed() {
    for (const listener of this.listeners) listener();
  }

  /** Pixels per mm on a canvas of this size. */
  scale(width, height) {
    const [left, bottom, right, top] = this.window;
    const whole = Math.min(width / (right - left), height / (top - bottom));
    return Math.min(CLOSEST_PX_PER_MM, whole * this.zoom);
  }

  /** Moves by px of a canvas. */
  pan(dx, dy, width, height) {
    const scale = this.scale(width, height);
    this.x -= dx / scale;
    this.y += dy / scale;
    this.changed();
  }

  /** Zooms by a factor about a place (mm) that keeps still. */
  zoomAbout(factor, [x, y]) {
    const zoom = Math.max(0.3, Math.min(100, this.zoom * factor));
    const share = 1 - this.zoom / zoom;
    this.x += (x - this.x) * share;
    this.y += (y - this.y) * share;
    this.zoom = zoom;
    this.changed();
  }
}
