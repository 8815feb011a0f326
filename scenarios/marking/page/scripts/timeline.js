// One lane for each marker: where it is seen, predicted, lost, fixed by hand; a click goes there.

import { goTo, store } from "./store.js";

const holder = document.querySelector("#timeline");
const STYLES = { s: "#0b7a5c", p: "#c77700", l: "#c2273b", f: "#1b4fa8" };
const HEIGHT = 13;

export function drawTimeline() {
  const { tracks, film } = store.state;
  const names = tracks ? Object.keys(tracks) : [];
  if (holder.children.length !== names.length || [...holder.children].some((lane, k) => lane.dataset.name !== names[k])) {
    holder.replaceChildren(...names.map(lane));
  }
  names.forEach((name, k) => {
    const canvas = holder.children[k].querySelector("canvas");
    canvas.setAttribute("aria-label", counted(name, tracks[name].status));
    drawLane(canvas, tracks[name].status, film.frames.length);
  });
}

function lane(name) {
  const row = document.createElement("div");
  row.className = "lane";
  row.dataset.name = name;
  const title = document.createElement("span");
  title.textContent = name;
  const canvas = document.createElement("canvas");
  canvas.setAttribute("role", "img");
  canvas.addEventListener("pointerdown", (event) => {
    const box = canvas.getBoundingClientRect();
    goTo(((event.clientX - box.left) / box.width) * store.state.film.frames.length - 0.5);
  });
  row.append(title, canvas);
  return row;
}

function counted(name, status) {
  const count = (letter) => status.split(letter).length - 1;
  return `${name}: ${count("s")} frames seen, ${count("p")} predicted, ${count("l")} lost, ${count("f")} fixed by hand`;
}

function drawLane(canvas, status, frames) {
  const width = canvas.clientWidth;
  canvas.width = width;
  canvas.height = HEIGHT;
  const pen = canvas.getContext("2d");
  const step = width / frames;
  for (let row = 0; row < frames; row += 1) {
    const letter = status[row];
    const [x, w] = [row * step, Math.max(step, 1)];
    pen.fillStyle = STYLES[letter];
    if (letter === "s") pen.fillRect(x, 2, w + 0.5, HEIGHT - 4);
    if (letter === "p") pen.fillRect(x, 2, Math.max(w * 0.6, 1), HEIGHT - 4);
    if (letter === "l") {
      pen.fillRect(x, 1, w + 0.5, 2);
      pen.fillRect(x, HEIGHT - 3, w + 0.5, 2);
    }
  }
  pen.fillStyle = STYLES.f;
  for (let row = 0; row < frames; row += 1) {
    if (status[row] !== "f") continue;
    pen.beginPath();
    pen.arc((row + 0.5) * step, HEIGHT / 2, 5, 0, 2 * Math.PI);
    pen.fill();
  }
  pen.fillStyle = "#000";
  pen.fillRect((store.row + 0.5) * step - 1, 0, 2, HEIGHT);
}
