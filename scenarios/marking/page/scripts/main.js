// The page: what is asked of the server, and what happens then.

import { prepareKeys } from "./keys.js";
import { drawPanel } from "./panel.js";
import { drawSoon, preparePicture, showWhole, zoomBy } from "./picture.js";
import { done, progressNow, spotsIn, stateNow } from "./server.js";
import { advice, changed, choose, frame, goTo, listen, markerAt, nextTool, store } from "./store.js";
import { drawTimeline } from "./timeline.js";
import { inPicture } from "./view.js";

const find = (selector) => document.querySelector(selector);
const POLL_MS = 200;
const SPOTS_AFTER_MS = 350;
let playing = null;
let spotsTimer = null;

async function act(event, after = () => {}) {
  if (document.body.dataset.busy) return;
  document.body.dataset.busy = event.do;
  const watch = setInterval(showProgress, POLL_MS);
  find("#error").hidden = true;
  try {
    store.state = await done(event);
    if (event.do === "polarity") store.spots = [];
    after();
  } catch (error) {
    find("#error").textContent = error.message;
    find("#error").hidden = false;
    find("#error").scrollIntoView({ block: "nearest" });
  } finally {
    clearInterval(watch);
    find("#busy").hidden = true;
    delete document.body.dataset.busy;
    changed();
  }
}

async function showProgress() {
  try {
    const { busy, text, share } = await progressNow();
    if (!document.body.dataset.busy) return;
    find("#busy").hidden = !busy;
    find("#busy p").textContent = text || "working";
    find("#busy progress").value = share;
  } catch {
    // The server is gone; the request that is waited for says so.
  }
}

function point(at, free) {
  const { tool } = store;
  const [x, y] = at;
  store.cross = at;
  if (!tool) {
    find("#error").textContent = "Choose first what you point at: a marker, a ruler, a contact.";
    find("#error").hidden = false;
  } else if (tool.kind === "marker") placeMarker(tool.name, at, free);
  else if (tool.kind === "style") act({ do: "style", name: tool.name, x, y }, () => choose(null));
  else if (tool.kind === "touch") act({ do: "touch", lip: tool.lip, frame: frame(), x, y }, () => choose(null));
  else if (tool.kind === "ruler") {
    store.ruler = store.ruler.length === 2 ? [at] : [...store.ruler, at];
    changed();
  }
}

function placeMarker(marker, [x, y], free) {
  const first = frame() === store.state.film.first;
  const exactly = free || find("#free").checked;
  act({ do: "place", marker, frame: frame(), x, y, free: exactly }, () => {
    if (first && !store.state.tracks) nextTool();
  });
}

function moveCross(x, y) {
  store.cross = inPicture([store.cross[0] + x, store.cross[1] + y]);
  drawSoon();
}

function nextSpot(step) {
  const spots = [...store.spots].sort((one, other) => one.x - other.x);
  if (!spots.length) return;
  const here = spots.findIndex(({ x, y }) => Math.hypot(x - store.cross[0], y - store.cross[1]) < 0.5);
  const index = here < 0 ? (step > 0 ? 0 : spots.length - 1) : (here + step + spots.length) % spots.length;
  store.cross = [spots[index].x, spots[index].y];
  drawSoon();
}

// Spots are looked for only while markers are placed, and once a frame is rested on.
function spotsSoon() {
  clearTimeout(spotsTimer);
  const wanted = !playing && store.spots.length === 0 && store.tool?.kind === "marker" && !markerAt(store.tool.name);
  if (!wanted) return;
  const asked = frame();
  spotsTimer = setTimeout(async () => {
    try {
      const spots = await spotsIn(asked);
      if (asked !== frame()) return;
      store.spots = spots;
      document.body.dataset.spots = asked;
      drawSoon();
    } catch {
      // Suggestions are a help only: without them the picture shows as much.
    }
  }, SPOTS_AFTER_MS);
}

function play() {
  if (playing) {
    cancelAnimationFrame(playing.request);
    playing = null;
    changed();
    return;
  }
  const { times } = store.state.film;
  if (store.row === times.length - 1) goTo(0);
  playing = { start: performance.now() - 1000 * (times[store.row] - times[0]) };
  const step = (now) => {
    const time = times[0] + (now - playing.start) / 1000;
    let row = store.row;
    while (row < times.length - 1 && times[row + 1] <= time) row += 1;
    if (row >= times.length - 1) {
      goTo(row);
      play();
      return;
    }
    goTo(row);
    playing.request = requestAnimationFrame(step);
  };
  playing.request = requestAnimationFrame(step);
  changed();
}

function forget() {
  if (store.tool?.kind === "marker") act({ do: "forget", marker: store.tool.name, frame: frame() });
}

function draw() {
  const { film } = store.state;
  find("#film").textContent = `${film.name} · ${film.width} × ${film.height} px · ${film.frames.length} frames`;
  find("#next").textContent = advice();
  const time = find("#time");
  time.max = film.frames.length - 1;
  time.value = store.row;
  const said = `frame ${frame()}, ${film.times[store.row].toFixed(3)} s`;
  time.setAttribute("aria-valuetext", said);
  find("#now").textContent = said;
  find("#play").textContent = playing ? "Stop" : "Play";
  drawPanel(act);
  drawTimeline();
  drawSoon();
  spotsSoon();
}

const actions = {
  move: moveCross,
  place: (free) => point(store.cross, free),
  choose: (index) => {
    const marker = store.state.markers.filter(({ coded }) => !coded)[index];
    if (marker) choose({ kind: "marker", name: marker.name });
  },
  step: (count) => goTo(store.row + count),
  spot: nextSpot,
  zoom: (factor) => zoomBy(factor),
  play,
  forget,
  whole: showWhole,
  track: () => act({ do: "track" }),
  undo: () => act({ do: "undo" }),
  redo: () => act({ do: "redo" }),
  save: () => act({ do: "save" }),
  convert: () => act({ do: "convert" }),
};

async function begin() {
  store.state = await stateNow();
  const { width, height } = store.state.film;
  store.cross = [width / 2, height / 2];
  for (const name of ["track", "undo", "redo", "save", "convert", "forget", "play", "whole"]) {
    find(`#${name}`).addEventListener("click", actions[name]);
  }
  find("#suggest").addEventListener("click", () => act({ do: "suggest" }, nextTool));
  find("#finish").addEventListener("click", finish);
  find("#polarity").addEventListener("change", (event) => act({ do: "polarity", polarity: event.target.value }));
  find("#back").addEventListener("click", () => actions.step(-1));
  find("#forward").addEventListener("click", () => actions.step(1));
  find("#in").addEventListener("click", () => zoomBy(1.5));
  find("#out").addEventListener("click", () => zoomBy(1 / 1.5));
  find("#time").addEventListener("input", (event) => goTo(Number(event.target.value)));
  preparePicture(point, (name, at, free) => {
    choose({ kind: "marker", name });
    placeMarker(name, at, free);
  });
  prepareKeys(actions);
  listen(draw);
  nextTool();
  changed();
  document.body.dataset.ready = "yes";
}

async function finish() {
  if (!store.state.saved && store.state.undo && !window.confirm("What was marked is not saved. Close?")) return;
  await done({ do: "finish" });
  document.body.replaceChildren("Closed. This tab can be closed too.");
}

begin();
