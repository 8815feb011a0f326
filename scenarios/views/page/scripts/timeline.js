// The slider, the play button and their keys.

import { nearest } from "./arrays.js";

/** Steps through the frames of the first run; tells its listener the relative time. */
export class Timeline {
  constructor({ slider, play, speed, told }, onTime) {
    Object.assign(this, { slider, play, speed, told, onTime });
    slider.addEventListener("input", () => this.changed());
    play.addEventListener("click", () => (this.playing ? this.stop() : this.start()));
  }

  /** Follows another run, at the nearest instant to where it was. */
  follow(run) {
    const relative = this.run ? this.relative : null;
    this.run = run;
    this.slider.max = String(run.frames - 1);
    const frame = relative === null ? this.mostPressed() : run.frameAt(relative);
    this.slider.value = String(frame);
  }

  /** The frame in which a lip is pressed most: where the page opens. */
  mostPressed() {
    const { increment, history } = this.run.data;
    let best = 0;
    let found = 0;
    increment.forEach((i, frame) => {
      const p = Math.max(history.upper_lip_window_kpa[i], history.lower_lip_window_kpa[i]);
      if (p > best) {
        best = p;
        found = frame;
      }
    });
    return found;
  }

  get frame() {
    return Number(this.slider.value);
  }

  get relative() {
    return this.run.relative[this.frame];
  }

  go(relative) {
    this.slider.value = String(this.run.frameAt(relative));
    this.changed();
  }

  changed() {
    this.onTime(this.relative);
  }

  /** Says the instant beside the slider and to those who hear it. */
  tell(words) {
    this.told.textContent = words;
    this.slider.setAttribute("aria-valuetext", words);
  }

  start() {
    this.playing = true;
    this.play.textContent = "Pause";
    if (this.frame >= this.run.frames - 1) this.slider.value = "0";
    this.begun = performance.now();
    this.from = this.run.seconds[this.frame];
    requestAnimationFrame((now) => this.step(now));
  }

  stop() {
    this.playing = false;
    this.play.textContent = "Play";
  }

  step(now) {
    if (!this.playing) return;
    const time = this.from + ((now - this.begun) / 1000) * Number(this.speed.value);
    const frame = nearest(this.run.seconds, time);
    if (frame !== this.frame) {
      this.slider.value = String(frame);
      this.changed();
    }
    if (frame >= this.run.frames - 1) this.stop();
    else requestAnimationFrame((later) => this.step(later));
  }
}
