// Between places in the picture (px of the film) and on the screen (CSS px of the canvas).

import { store } from "./store.js";

export const MOST_ZOOM = 24;

export function toScreen([x, y]) {
  const { scale, x: left, y: top } = store.view;
  return [(x - left) * scale, (y - top) * scale];
}

export function toPicture([x, y]) {
  const { scale, x: left, y: top } = store.view;
  return [x / scale + left, y / scale + top];
}

// The whole picture, in the middle of the canvas. Pixel centres are at whole numbers.
export function fitted(canvas) {
  const { width, height } = store.state.film;
  const scale = Math.min(canvas.clientWidth / width, canvas.clientHeight / height);
  const x = (width - canvas.clientWidth / scale) / 2 - 0.5;
  const y = (height - canvas.clientHeight / scale) / 2 - 0.5;
  return { scale, x, y, whole: true };
}

export function zoomed(canvas, factor, at) {
  const least = fitted(canvas).scale;
  const scale = Math.min(Math.max(store.view.scale * factor, least), MOST_ZOOM);
  if (scale <= least * 1.0001) return fitted(canvas);
  const [x, y] = toScreen(at);
  return { scale, x: at[0] - x / scale, y: at[1] - y / scale, whole: false };
}

export function moved(dx, dy) {
  const { scale, x, y } = store.view;
  return { scale, x: x - dx / scale, y: y - dy / scale, whole: false };
}

export function inPicture([x, y]) {
  const { width, height } = store.state.film;
  return [Math.min(Math.max(x, 0), width - 1), Math.min(Math.max(y, 0), height - 1)];
}
