// The frame with what is drawn over it, the loupe, and pointing: click, drag a point, pan, zoom.

import { drawOverlay } from "./overlay.js";
import { pictureOf } from "./pictures.js";
import { changed, choose, markerAt, store } from "./store.js";
import { fitted, inPicture, moved, toPicture, toScreen, zoomed } from "./view.js";

const GRASP_PX = 13;
const STILL_PX = 4;
const LOUPE_ZOOM = 8;
const canvas = document.querySelector("#picture");
const loupe = document.querySelector("#loupe");
const pointed = document.querySelector("#pointed");
let waiting = false;

export function preparePicture(point, drop) {
  new ResizeObserver(() => {
    if (store.view.whole !== false) store.view = fitted(canvas);
    changed();
  }).observe(canvas);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomBy(Math.exp(-event.deltaY / 400), toPicture(place(event)));
  }, { passive: false });
  canvas.addEventListener("pointermove", (event) => {
    if (store.drag || event.buttons) return;
    store.cross = inPicture(toPicture(place(event)));
    drawSoon();
  });
  canvas.addEventListener("pointerdown", (event) => press(event, point, drop));
}

export function zoomBy(factor, at = store.cross) {
  store.view = zoomed(canvas, factor, at);
  changed();
}

export function showWhole() {
  store.view = fitted(canvas);
  changed();
}

export function drawSoon() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    draw();
  });
}

function place(event) {
  const box = canvas.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
}

// The marker whose point is under the pointer; the chosen one first.
function grasped(at) {
  const near = store.state.markers
    .filter((marker) => !marker.coded)
    .map(({ name }) => ({ name, here: markerAt(name) }))
    .filter(({ here }) => here)
    .map(({ name, here }) => {
      const [x, y] = toScreen(here.at);
      return { name, start: here.at, away: Math.hypot(x - at[0], y - at[1]) };
    })
    .filter(({ away }) => away < GRASP_PX)
    .sort((one, other) => one.away - other.away);
  return near.find(({ name }) => store.tool?.name === name) ?? near[0] ?? null;
}

function press(event, point, drop) {
  if (event.button !== 0) return;
  canvas.focus();
  canvas.setPointerCapture(event.pointerId);
  const start = place(event);
  const held = store.tool?.kind === "marker" || !store.tool ? grasped(start) : null;
  let last = start;
  let travelled = false;
  const move = (next) => {
    const now = place(next);
    travelled ||= Math.hypot(now[0] - start[0], now[1] - start[1]) > STILL_PX;
    if (held && travelled) {
      store.cross = inPicture(toPicture(now));
      store.drag = { name: held.name, at: store.cross };
    } else if (travelled) {
      store.view = moved(now[0] - last[0], now[1] - last[1]);
    }
    last = now;
    drawSoon();
  };
  const release = (next) => {
    canvas.removeEventListener("pointermove", move);
    canvas.removeEventListener("pointerup", release);
    canvas.removeEventListener("pointercancel", release);
    store.drag = null;
    const at = inPicture(toPicture(place(next)));
    if (next.type === "pointercancel") changed();
    else if (held && travelled) drop(held.name, at, next.altKey);
    else if (held) choose({ kind: "marker", name: held.name });
    else if (!travelled) point(at, next.altKey);
  };
  canvas.addEventListener("pointermove", move);
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
}

function draw() {
  const { film } = store.state;
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  const image = pictureOf(store.row, film.frames.length, drawSoon);
  if (image) {
    const [x, y] = toScreen([-0.5, -0.5]);
    pen.imageSmoothingEnabled = store.view.scale < 3;
    pen.drawImage(image, x, y, film.width * store.view.scale, film.height * store.view.scale);
    canvas.dataset.row = store.row;
  }
  drawOverlay(pen);
  drawLoupe(image);
  const { scale, x, y } = store.view;
  Object.assign(canvas.dataset, { scale, left: x, top: y });
  pointed.textContent = `x ${store.cross[0].toFixed(1)}, y ${store.cross[1].toFixed(1)} px`;
}

function drawLoupe(image) {
  const pen = loupe.getContext("2d");
  const size = loupe.width;
  pen.fillStyle = "#000";
  pen.fillRect(0, 0, size, size);
  if (image) {
    const span = size / LOUPE_ZOOM;
    const [x, y] = store.cross;
    pen.imageSmoothingEnabled = false;
    pen.drawImage(image, x + 0.5 - span / 2, y + 0.5 - span / 2, span, span, 0, 0, size, size);
  }
  pen.strokeStyle = "rgba(255, 60, 60, .9)";
  pen.beginPath();
  for (const [from, to] of [[0.3, 0.47], [0.53, 0.7]]) {
    pen.moveTo(size * from, size / 2);
    pen.lineTo(size * to, size / 2);
    pen.moveTo(size / 2, size * from);
    pen.lineTo(size / 2, size * to);
  }
  pen.stroke();
  const [x, y] = toScreen(store.cross);
  const under = x > canvas.clientWidth - 230 && y < 230;
  loupe.classList.toggle("left", under);
}
