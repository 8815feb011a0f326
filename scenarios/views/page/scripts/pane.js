// One run on the page: its section, what is said of a place, its imprints and its recording.

import { nearest, written } from "./arrays.js";
import { SectionView } from "./section.js";
import { described, elementAt } from "./pointing.js";
import { ImprintMap } from "./imprint.js";

const REACH_PX = 7;
const STEP_PX = 4;
const PAN_PX = 40;
const ZOOM = 1.5;
const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** A run, or the difference of two, in an element of the page. */
export class Pane {
  constructor(element, camera, page, pressure) {
    this.element = element;
    this.camera = camera;
    this.page = page;
    this.canvas = element.querySelector(".section");
    this.view = new SectionView(this.canvas, camera);
    this.isDifference = element.dataset.kind === "difference";
    this.title = element.querySelector("h3");
    this.film = element.querySelector(".film");
    this.told = element.querySelector(".pointed");
    this.imprints = [...element.querySelectorAll(".imprint-map")].map((figure) => new ImprintMap(
      figure.querySelector("canvas"), figure.querySelector(".values"), figure.dataset.lip, pressure,
    ));
    this.listen();
  }

  get shown() {
    return !this.element.hidden;
  }

  /** Shows a run from now on, nothing if there is none; `pressing` has the imprints to be shown. */
  hold(run, title, onTime, pressing = run) {
    this.element.hidden = !run;
    this.run = run;
    this.view.run = null;
    if (!run) return;
    this.title.textContent = title;
    this.imprints.forEach((map) => map.show(pressing, onTime));
    if (this.film) this.film.parentElement.hidden = run.data.film.length === 0;
  }

  /** Moves imprints and recording to a frame of the run. */
  move(frame) {
    this.imprints.forEach((map) => map.move(frame));
    const { film } = this.run.data;
    if (!this.film || !film.length) return;
    const picture = film[nearest(film.map((one) => one.time_s), this.run.seconds[frame])];
    if (this.film.dataset.timeS === String(picture.time_s)) return;
    this.film.src = picture.picture;
    this.film.dataset.timeS = String(picture.time_s);
  }

  listen() {
    const { canvas, view, camera } = this;
    let dragged = null;
    const local = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    canvas.addEventListener("pointerdown", (event) => {
      dragged = local(event);
      canvas.setPointerCapture(event.pointerId);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, () => { dragged = null; });
    }
    canvas.addEventListener("pointermove", (event) => {
      const [left, top] = local(event);
      if (dragged) {
        camera.pan(left - dragged[0], top - dragged[1], canvas.clientWidth, canvas.clientHeight);
        dragged = [left, top];
      } else {
        this.point(view.placeOf(left, top));
      }
    });
    canvas.addEventListener("wheel", (event) => {
      // Who scrolls down the page must not be caught here: only a section in use zooms.
      if (document.activeElement !== canvas && !event.ctrlKey) return;
      event.preventDefault();
      camera.zoomAbout(Math.exp(-0.0015 * event.deltaY), view.placeOf(...local(event)));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /** Arrows move the cross, with Shift the view; plus and minus zoom; 0 shows all. */
  key(event) {
    const { canvas, view, camera } = this;
    const step = STEPS[event.key];
    const place = view.probe ?? [camera.x, camera.y];
    if (step && event.shiftKey) {
      camera.pan(-PAN_PX * step[0], -PAN_PX * step[1], canvas.clientWidth, canvas.clientHeight);
    } else if (step) {
      const mm = (STEP_PX * view.ratio) / view.px;
      this.point([place[0] + step[0] * mm, place[1] - step[1] * mm]);
    } else if (event.key === "+" || event.key === "=") {
      camera.zoomAbout(ZOOM, place);
    } else if (event.key === "-") {
      camera.zoomAbout(1 / ZOOM, place);
    } else if (event.key === "0") {
      camera.reset();
    } else {
      return;
    }
    event.preventDefault();
  }

  point(place) {
    this.view.probe = place;
    this.view.draw();
    this.tell();
  }

  /** Says what is under the cross, in the frame that is shown. */
  tell() {
    const { view } = this;
    if (!view.probe || !view.run) return;
    const reach = (REACH_PX * view.ratio) / view.px;
    this.told.textContent = this.isDifference
      ? this.difference()
      : described(view.run, view.frame, view.probe, reach, this.page.fields);
  }

  difference() {
    const { view } = this;
    view.run.place(view.frame);
    const e = elementAt(view.run, ...view.probe);
    const value = e < 0 ? NaN : view.value(view.frame, e);
    if (Number.isNaN(value)) return "no tissue that both runs have";
    const { title, unit, decimals } = view.scaleOfField;
    const withUnit = `${written(value, decimals)}${unit ? ` ${unit}` : ""}`;
    return `${title}, ${this.title.textContent}: ${withUnit} (element ${e})`;
  }
}
