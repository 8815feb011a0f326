// What is drawn over a frame: spots, trails, markers, ruler, points of lip and rim, the cross.

import { colour, frame, firstRow, markerAt, store } from "./store.js";
import { toScreen } from "./view.js";

const TRAIL = 25;
const DASHES = { predicted: [4, 3], seen: [], fixed: [], lost: [2, 3] };

export function drawOverlay(pen) {
  pen.lineWidth = 1.5;
  pen.font = "12px system-ui, sans-serif";
  for (const spot of store.spots) drawSpot(pen, spot);
  for (const marker of store.state.markers) {
    if (store.state.tracks) drawTrail(pen, marker.name);
    drawMarker(pen, marker.name);
  }
  drawRulers(pen);
  drawPoints(pen);
  drawCross(pen);
}

function ring(pen, [x, y], radius) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.stroke();
}

function drawSpot(pen, { x, y, radius }) {
  const reach = Math.max(radius * store.view.scale * 2.2, 14);
  for (const [width, style] of [[3.5, "rgba(0, 0, 0, .6)"], [1.5, "#fff"]]) {
    pen.lineWidth = width;
    pen.strokeStyle = style;
    pen.setLineDash([5, 4]);
    ring(pen, toScreen([x, y]), reach);
  }
  pen.setLineDash([]);
  pen.lineWidth = 1.5;
}

function drawTrail(pen, name) {
  pen.strokeStyle = colour(name);
  pen.globalAlpha = 0.75;
  pen.beginPath();
  let open = false;
  for (let row = Math.max(store.row - TRAIL, 0); row <= store.row; row += 1) {
    const place = markerAt(name, row);
    if (!place) {
      open = false;
      continue;
    }
    const [x, y] = toScreen(place.at);
    if (open) pen.lineTo(x, y);
    else pen.moveTo(x, y);
    open = true;
  }
  pen.stroke();
  pen.globalAlpha = 1;
}

function drawMarker(pen, name) {
  const dragged = store.drag?.name === name ? { at: store.drag.at, status: "fixed" } : null;
  const place = dragged ?? markerAt(name);
  if (!place) return;
  const [x, y] = toScreen(place.at);
  const chosen = store.tool?.kind === "marker" && store.tool.name === name;
  for (const [width, style] of [[chosen ? 5 : 4, "rgba(0, 0, 0, .75)"], [chosen ? 2.5 : 1.6, colour(name)]]) {
    pen.lineWidth = width;
    pen.strokeStyle = style;
    pen.setLineDash(DASHES[place.status]);
    if (place.status === "fixed") pen.strokeRect(x - 8, y - 8, 16, 16);
    else ring(pen, [x, y], 9);
    pen.setLineDash([]);
    pen.beginPath();
    pen.moveTo(x - 3, y);
    pen.lineTo(x + 3, y);
    pen.moveTo(x, y - 3);
    pen.lineTo(x, y + 3);
    pen.stroke();
  }
  pen.lineWidth = 1.5;
  label(pen, name, x + 13, y - 9, colour(name));
}

function label(pen, text, x, y, style) {
  pen.lineWidth = 3;
  pen.strokeStyle = "rgba(0, 0, 0, .8)";
  pen.strokeText(text, x, y);
  pen.fillStyle = style;
  pen.fillText(text, x, y);
  pen.lineWidth = 1.5;
}

function drawRulers(pen) {
  const now = frame();
  for (const [body, length] of Object.entries(store.state.lengths)) {
    if (length.ruler?.frame === now) {
      drawLine(pen, length.ruler.ends, `${length.ruler.length_mm} mm (${body})`);
    }
  }
  if (store.ruler.length) drawLine(pen, [store.ruler[0], store.ruler[1] ?? store.cross], "ruler");
}

function drawLine(pen, ends, text) {
  const [[x1, y1], [x2, y2]] = ends.map(toScreen);
  pen.strokeStyle = "#fff";
  pen.beginPath();
  pen.moveTo(x1, y1);
  pen.lineTo(x2, y2);
  pen.stroke();
  ring(pen, [x1, y1], 3);
  ring(pen, [x2, y2], 3);
  label(pen, text, (x1 + x2) / 2 + 6, (y1 + y2) / 2 - 6, "#fff");
}

function drawPoints(pen) {
  if (store.row === firstRow()) {
    for (const [name, at] of Object.entries(store.state.style)) if (at) diamond(pen, at, name);
  }
  for (const [lip, touch] of Object.entries(store.state.touches)) {
    if (touch?.frame === frame()) diamond(pen, touch.at, `${lip} lip touched`);
  }
}

function diamond(pen, at, text) {
  const [x, y] = toScreen(at);
  pen.strokeStyle = "#fff";
  pen.beginPath();
  pen.moveTo(x - 6, y);
  pen.lineTo(x, y - 6);
  pen.lineTo(x + 6, y);
  pen.lineTo(x, y + 6);
  pen.closePath();
  pen.stroke();
  label(pen, text, x + 10, y + 4, "#fff");
}

function drawCross(pen) {
  const [x, y] = toScreen(store.cross);
  pen.strokeStyle = "rgba(255, 255, 255, .85)";
  pen.lineWidth = 1;
  pen.beginPath();
  for (const [from, to] of [[-16, -5], [5, 16]]) {
    pen.moveTo(x + from, y);
    pen.lineTo(x + to, y);
    pen.moveTo(x, y + from);
    pen.lineTo(x, y + to);
  }
  pen.stroke();
}
