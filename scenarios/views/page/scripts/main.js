// Puts the moving part of the page together: which runs, which field, which instant.

import { written } from "./arrays.js";
import { CentredScale, Scale, followTheme, scaleOf, showLegend, theme } from "./colours.js";
import { Run, counterparts } from "./run.js";
import { imprintDifference } from "./imprint_difference.js";
import { Camera } from "./camera.js";
import { HistoryChart } from "./curves.js";
import { Pane } from "./pane.js";
import { Timeline } from "./timeline.js";

const DASHES = [[], [8, 4]];
const BUTTON_ZOOM = 1.5;

/** The moving part: at most two chosen runs, side by side at one instant. */
class Explorer {
  constructor(root, page) {
    this.root = root;
    this.page = page;
    this.runs = page.runs.map((data) => new Run(data));
    this.pressure = new Scale(page.pressure);
    this.pressureDifference = new CentredScale({
      ...page.pressure, limit: page.pressure.limit / 2, colours: page.difference,
    });
    followTheme(() => this.recolour());
    this.takeColours();
    this.chosen = this.runs.slice(0, 2);
    this.camera = new Camera(this.commonWindow());
    this.panes = [...root.querySelectorAll(".pane")]
      .map((element) => new Pane(
        element, this.camera, page,
        element.dataset.kind === "difference" ? this.pressureDifference : this.pressure,
      ));
    const onTime = (relative) => this.timeline.go(relative);
    this.charts = [...root.querySelectorAll(".chart")]
      .map((figure) => new HistoryChart(figure, figure.dataset.name, page, onTime));
    this.onTime = onTime;
    this.timeline = new Timeline(
      {
        slider: this.find(".time"), play: this.find(".play"), speed: this.find(".speed"),
        told: this.find(".now"),
      },
      (relative) => this.move(relative),
    );
    this.listen();
  }

  find(selector) {
    return this.root.querySelector(selector);
  }

  listen() {
    const zoom = (factor) => this.camera.zoomAbout(factor, [this.camera.x, this.camera.y]);
    this.find(".field").addEventListener("change", () => this.paint());
    this.find(".zoom-in").addEventListener("click", () => zoom(BUTTON_ZOOM));
    this.find(".zoom-out").addEventListener("click", () => zoom(1 / BUTTON_ZOOM));
    this.find(".zoom-all").addEventListener("click", () => this.camera.reset());
    this.camera.listeners.push(() => this.redraw());
    this.root.querySelectorAll(".chosen").forEach((select, i) =>
      select.addEventListener("change", () => this.choose(i, Number(select.value))));
    window.addEventListener("resize", () => this.redraw());
  }

  takeColours() {
    const { colours, colours_on_dark: onDark } = this.page.pressure;
    this.pressure.colours = theme.isDark ? onDark : colours;
  }

  /** Draws everything anew when light paper became dark, or dark light. */
  async recolour() {
    this.takeColours();
    this.legendState = null;
    await this.open();
  }

  /** Colour and dashes of each chosen run. */
  get styles() {
    return this.chosen.map((_, i) => ({ colour: [theme.upper, theme.lower][i], dash: DASHES[i] }));
  }

  /** The window that holds the windows of all runs. */
  commonWindow() {
    const all = this.page.runs.map((run) => run.window);
    return [0, 1].map((k) => Math.min(...all.map((w) => w[k])))
      .concat([2, 3].map((k) => Math.max(...all.map((w) => w[k]))));
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
    if (this.chosen.length === 0) this.chosen = [other ?? this.runs[0]];
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
      if (pane.isDifference) {
        const pressing = second && imprintDifference(first, second);
        pane.hold(second && first, pressing?.label, this.onTime, pressing);
      } else {
        pane.hold(this.chosen[i], this.chosen[i]?.label, this.onTime);
      }
    });
    this.showKey();
    for (const chart of this.charts) chart.show(this.chosen, this.styles);
    this.timeline.follow(first);
    this.move(this.timeline.relative);
  }

  /** Says which line is which run. */
  showKey() {
    const svg = (name, attributes) => {
      const made = document.createElementNS("http://www.w3.org/2000/svg", name);
      for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
      return made;
    };
    this.find(".lines-of-runs").replaceChildren(...this.chosen.map((run, i) => {
      const entry = document.createElement("li");
      const { colour, dash } = this.styles[i];
      const swatch = svg("svg", { width: 44, height: 12, "aria-hidden": true });
      swatch.append(svg("line", {
        x1: 1, y1: 6, x2: 43, y2: 6, stroke: colour, "stroke-width": 2.6,
        "stroke-dasharray": dash.join(" ") || "none",
      }));
      entry.append(swatch, run.label);
      return entry;
    }));
    this.find(".difference-said").hidden = this.chosen.length < 2;
  }

  /** Shows everything at a relative time. */
  move(relative) {
    this.frames = this.chosen.map((run) => run.frameAt(relative));
    const times = this.chosen.map((run, i) => `${written(run.seconds[this.frames[i]], 2)} s`);
    const share = `${written(100 * relative, 0)} %`;
    this.timeline.tell(this.chosen.length === 1
      ? `${times[0]}, ${share} of the sip`
      : `${times.map((time, i) => `${this.chosen[i].label} ${time}`).join(", ")}, ${share} of each`);
    for (const chart of this.charts) chart.move(this.frames);
    this.paint();
    this.panes.forEach((pane, i) => {
      if (pane.shown) pane.move(this.frames[pane.isDifference ? 0 : i]);
    });
  }

  /** Colours the sections by the chosen field. */
  paint() {
    const { field } = this;
    const scale = field ? scaleOf(field) : this.pressure;
    this.panes.forEach((pane, i) => {
      if (!pane.shown) return;
      if (pane.isDifference) {
        this.paintDifference(pane, field);
      } else {
        const table = field ? pane.run.element[field.name] : null;
        const value = table ? (frame, e) => table.at(frame, e) : () => NaN;
        pane.view.show(pane.run, this.frames[i], scale, value, this.pressure);
      }
      pane.tell();
    });
    this.legends(field);
  }

  paintDifference(pane, field) {
    const [first, second] = this.chosen;
    const other = this.frames[1];
    const difference = (frame, e) => {
      const o = this.counterparts[e];
      const { name } = field;
      return o < 0 ? NaN : second.element[name].at(other, o) - first.element[name].at(frame, e);
    };
    const value = field ? difference : () => NaN;
    pane.view.show(first, this.frames[0], this.differenceScale(field), value, this.pressure);
  }

  differenceScale(field) {
    const base = field ?? this.page.pressure;
    return new CentredScale({
      ...base, title: `${base.title}, difference`, limit: base.limit / 2, centre: 0,
      colours: this.page.difference,
    });
  }

  /** Shows what the colours mean, if that changed. */
  legends(field) {
    const state = `${field?.name} ${this.chosen.length}`;
    if (this.legendState === state) return;
    this.legendState = state;
    const place = this.find(".legend-field");
    place.hidden = !field;
    if (field) {
      const largest = written(field.highest, field.decimals);
      const around = field.centre ? `${written(field.centre, 0)} ± ` : "";
      showLegend(place, scaleOf(field), `, element means up to ${around}${largest}`);
    }
    showLegend(this.find(".legend-pressure"), this.pressure);
    const difference = this.find(".legend-difference");
    difference.hidden = this.chosen.length < 2 || !field;
    if (!difference.hidden) showLegend(difference, this.differenceScale(field));
  }

  redraw() {
    for (const pane of this.panes) if (pane.shown) pane.view.draw();
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
