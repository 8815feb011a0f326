// Puts the moving part of the page together: which runs, which field, which instant.

import { written } from "./arrays.js";
import { DifferenceScale, Scale, showLegend } from "./colours.js";
import { LIPS, Run, counterparts } from "./run.js";
import { Camera } from "./camera.js";
import { SectionView } from "./section.js";
import { described, elementAt } from "./pointing.js";
import { HistoryChart } from "./curves.js";
import { ImprintMap } from "./imprint.js";
import { Timeline } from "./timeline.js";

const STYLES = [{ colour: "#1d6a86", dash: [] }, { colour: "#d07a2d", dash: [8, 4] }];
const REACH_PX = 7;
const STEP_PX = 4;

class Explorer {
  constructor(root, page) {
    this.root = root;
    this.page = page;
    this.runs = page.runs.map((data) => new Run(data));
    this.pressure = new Scale(page.pressure);
    this.chosen = this.runs.slice(0, 2);
    this.camera = new Camera(this.commonWindow());
    this.panes = [...root.querySelectorAll(".pane")].map((pane) => this.pane(pane));
    this.charts = [...root.querySelectorAll(".chart")].map(
      (figure) => new HistoryChart(figure, figure.dataset.name, page, (r) => this.timeline.go(r)),
    );
    this.timeline = new Timeline(
      {
        slider: this.find(".time"), play: this.find(".play"), speed: this.find(".speed"),
        told: this.find(".now"),
      },
      (relative) => this.move(relative),
    );
    this.find(".field").addEventListener("change", () => this.paint());
    this.find(".zoom-in").addEventListener("click", () => this.zoom(1.5));
    this.find(".zoom-out").addEventListener("click", () => this.zoom(1 / 1.5));
    this.find(".zoom-all").addEventListener("click", () => this.camera.reset());
    this.camera.listeners.push(() => this.redraw());
    root.querySelectorAll(".chosen").forEach((select, i) =>
      select.addEventListener("change", () => this.choose(i, Number(select.value))));
    window.addEventListener("resize", () => this.redraw());
  }

  find(selector) {
    return this.root.querySelector(selector);
  }

  commonWindow() {
    const all = this.page.runs.map((run) => run.window);
    return [0, 1].map((k) => Math.min(...all.map((w) => w[k])))
      .concat([2, 3].map((k) => Math.max(...all.map((w) => w[k]))));
  }

  /** Sets up a section's canvas, its film and its imprints. */
  pane(element) {
    const canvas = element.querySelector(".section");
    const view = new SectionView(canvas, this.camera);
    const pane = {
      element, canvas, view,
      isDifference: element.dataset.kind === "difference",
      title: element.querySelector("h3"),
      film: element.querySelector(".film"),
      told: element.querySelector(".pointed"),
      imprints: [...element.querySelectorAll(".imprint-map")].map((figure) => new ImprintMap(
        figure.querySelector("canvas"), figure.querySelector(".values"), figure.dataset.lip,
        this.pressure,
      )),
    };
    this.listen(pane);
    return pane;
  }

  listen(pane) {
    const { canvas, view } = pane;
    let dragged = null;
    const local = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    canvas.addEventListener("pointerdown", (event) => {
      dragged = local(event);
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointerup", () => { dragged = null; });
    canvas.addEventListener("pointermove", (event) => {
      const [left, top] = local(event);
      if (dragged) {
        this.camera.pan(left - dragged[0], top - dragged[1], canvas.clientWidth, canvas.clientHeight);
        dragged = [left, top];
      } else {
        this.point(pane, view.placeOf(left, top));
      }
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.camera.zoomAbout(Math.exp(-0.0015 * event.deltaY), view.placeOf(...local(event)));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(pane, event));
  }

  /** Arrows move the cross, with Shift the view; plus and minus zoom; 0 shows all. */
  key(pane, event) {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const { canvas, view } = pane;
    const step = steps[event.key];
    if (step && event.shiftKey) {
      this.camera.pan(-40 * step[0], -40 * step[1], canvas.clientWidth, canvas.clientHeight);
    } else if (step) {
      const [x, y] = view.probe ?? [this.camera.x, this.camera.y];
      const mm = (STEP_PX * view.ratio) / view.px;
      this.point(pane, [x + step[0] * mm, y - step[1] * mm]);
    } else if (event.key === "+" || event.key === "=") {
      this.camera.zoomAbout(1.5, view.probe ?? [this.camera.x, this.camera.y]);
    } else if (event.key === "-") {
      this.camera.zoomAbout(1 / 1.5, view.probe ?? [this.camera.x, this.camera.y]);
    } else if (event.key === "0") {
      this.camera.reset();
    } else {
      return;
    }
    event.preventDefault();
  }

  zoom(factor) {
    this.camera.zoomAbout(factor, [this.camera.x, this.camera.y]);
  }

  point(pane, place) {
    pane.view.probe = place;
    pane.view.draw();
    this.tell(pane);
  }

  /** Says what is under the cross of a pane, in the frame that is shown. */
  tell(pane) {
    const { view } = pane;
    if (!view.probe || !view.run) return;
    const reach = (REACH_PX * view.ratio) / view.px;
    const words = pane.isDifference
      ? this.differenceAt(view)
      : described(view.run, view.frame, view.probe, reach, this.page.fields);
    pane.told.textContent = words;
  }

  differenceAt(view) {
    const { run, frame } = view;
    const e = this.elementAt(run, frame, view.probe);
    const field = this.field;
    const value = e < 0 || !field ? NaN : view.value(frame, e);
    if (Number.isNaN(value)) return "no tissue that both runs have";
    const unit = field.unit ? ` ${field.unit}` : "";
    return `${field.title}, ${this.chosen[1].label} less ${this.chosen[0].label}: ` +
      `${written(value, field.decimals)}${unit} (element ${e})`;
  }

  elementAt(run, frame, [x, y]) {
    run.place(frame);
    return elementAt(run, x, y);
  }

  get field() {
    return this.page.fields.find((field) => field.name === this.find(".field").value) ?? null;
  }

  async choose(place, index) {
    const other = this.chosen[1 - place];
    const run = index < 0 ? null : this.runs[index];
    this.chosen[place] = run;
    if (run && run === other) this.chosen[1 - place] = null;
    this.chosen = this.chosen.filter(Boolean);
    await this.open();
  }

  /** Reads the chosen runs and shows them. */
  async open() {
    await Promise.all(this.chosen.map((run) => run.read()));
    const [first, second] = this.chosen;
    this.counterparts = second ? counterparts(first, second) : null;
    this.root.dataset.count = String(this.chosen.length);
    this.root.querySelectorAll(".chosen").forEach((select, i) => {
      select.value = String(this.runs.indexOf(this.chosen[i]));
    });
    this.panes.forEach((pane, i) => {
      const run = pane.isDifference ? second && first : this.chosen[i];
      pane.element.hidden = !run;
      if (!run) return;
      pane.view.run = null;
      pane.run = run;
      pane.title.textContent = pane.isDifference ? `${second.label} less ${first.label}` : run.label;
      pane.imprints.forEach((map) => map.show(run, (r) => this.timeline.go(r)));
      if (pane.film) pane.film.parentElement.hidden = run.data.film.length === 0;
    });
    this.showKey();
    for (const chart of this.charts) chart.show(this.chosen, STYLES.slice(0, this.chosen.length));
    this.timeline.follow(first);
    this.move(this.timeline.relative);
  }

  /** Says which line is which run. */
  showKey() {
    const svg = (name) => document.createElementNS("http://www.w3.org/2000/svg", name);
    this.find(".lines-of-runs").replaceChildren(...this.chosen.map((run, i) => {
      const entry = document.createElement("li");
      const [swatch, line] = [svg("svg"), svg("line")];
      const { colour, dash } = STYLES[i];
      Object.entries({ width: 44, height: 12, "aria-hidden": true })
        .forEach(([name, value]) => swatch.setAttribute(name, value));
      Object.entries({
        x1: 1, y1: 6, x2: 43, y2: 6, stroke: colour, "stroke-width": 2.6,
        "stroke-dasharray": dash.join(" ") || "none",
      }).forEach(([name, value]) => line.setAttribute(name, value));
      swatch.append(line);
      entry.append(swatch, run.label);
      return entry;
    }));
    this.find(".difference-said").hidden = this.chosen.length < 2;
  }

  /** Shows everything at a relative time. */
  move(relative) {
    this.frames = this.chosen.map((run) => run.frameAt(relative));
    const times = this.chosen.map((run, i) => `${written(run.seconds[this.frames[i]], 2)} s`);
    const words = this.chosen.length === 1
      ? `${times[0]}, ${written(100 * relative, 0)} % of the sip`
      : `${times.map((time, i) => `${this.chosen[i].label} ${time}`).join(", ")}, ` +
        `${written(100 * relative, 0)} % of each sip`;
    this.timeline.tell(words);
    for (const chart of this.charts) chart.move(this.frames);
    this.paint();
    this.panes.forEach((pane, i) => {
      if (pane.element.hidden || pane.isDifference) return;
      pane.imprints.forEach((map) => map.move(this.frames[i]));
      this.showFilm(pane, this.frames[i]);
    });
  }

  showFilm(pane, frame) {
    const { film } = pane.run.data;
    if (!film.length) return;
    const time = pane.run.seconds[frame];
    let best = film[0];
    for (const one of film) if (Math.abs(one.time_s - time) < Math.abs(best.time_s - time)) best = one;
    if (pane.film.dataset.timeS !== String(best.time_s)) {
      pane.film.src = best.picture;
      pane.film.dataset.timeS = String(best.time_s);
    }
  }

  /** Colours the sections by the chosen field. */
  paint() {
    const { field } = this;
    const scale = field ? new Scale(field) : this.pressure;
    this.panes.forEach((pane, i) => {
      if (pane.element.hidden) return;
      if (pane.isDifference) this.paintDifference(pane, field);
      else {
        const table = field ? pane.run.element[field.name] : null;
        const value = table ? (frame, e) => table.at(frame, e) : () => NaN;
        pane.view.show(pane.run, this.frames[i], scale, value, this.pressure);
      }
      this.tell(pane);
    });
    this.legends(field);
  }

  paintDifference(pane, field) {
    const [first, second] = this.chosen;
    const name = field?.name;
    const other = this.frames[1];
    const value = field
      ? (frame, e) => {
        const o = this.counterparts[e];
        return o < 0 ? NaN : second.element[name].at(other, o) - first.element[name].at(frame, e);
      }
      : () => NaN;
    pane.view.show(first, this.frames[0], this.differenceScale(field), value, this.pressure);
  }

  differenceScale(field) {
    const base = field ?? this.page.pressure;
    return new DifferenceScale({
      ...base, title: `${base.title}, difference`, limit: base.limit / 2,
      colours: this.page.difference,
    });
  }

  legends(field) {
    if (this.legendOf === field && this.legendCount === this.chosen.length) return;
    this.legendOf = field;
    this.legendCount = this.chosen.length;
    const place = this.find(".legend-field");
    place.hidden = !field;
    if (field) {
      const largest = written(field.highest, field.decimals);
      showLegend(place, new Scale(field), `, element means up to ${largest}`);
    }
    showLegend(this.find(".legend-pressure"), this.pressure);
    const difference = this.find(".legend-difference");
    difference.hidden = this.chosen.length < 2 || !field;
    if (!difference.hidden) showLegend(difference, this.differenceScale(field));
  }

  redraw() {
    for (const pane of this.panes) if (!pane.element.hidden) pane.view.draw();
  }
}

/** What is only for paper is folded on the screen, and unfolded when the page is printed. */
function foldForScreen() {
  const folded = [...document.querySelectorAll("details[data-folded]")];
  for (const one of folded) one.open = false;
  window.addEventListener("beforeprint", () => { for (const one of folded) one.open = true; });
  window.addEventListener("afterprint", () => { for (const one of folded) one.open = false; });
  window.addEventListener("hashchange", unfoldTarget);
}

/** A link of the contents opens what it leads to. */
function unfoldTarget() {
  const target = document.getElementById(location.hash.slice(1));
  const around = target?.closest("details") ?? target?.querySelector("details");
  if (around) around.open = true;
}

async function begin() {
  const root = document.getElementById("explore");
  const page = JSON.parse(document.getElementById("moving").textContent);
  root.hidden = false;
  for (const one of document.querySelectorAll(".scripted")) one.hidden = false;
  foldForScreen();
  await new Explorer(root, page).open();
  root.dataset.ready = "true";
}

begin();
