// Frames of the film as images; some are kept, and the next ones are fetched ahead.

import { pictureAddress } from "./server.js";

const KEPT = 240;
const AHEAD = 10;
const images = new Map();

export function pictureOf(row, rows, ready) {
  const image = fetched(row, ready);
  for (let next = row + 1; next <= Math.min(row + AHEAD, rows - 1); next += 1) fetched(next, () => {});
  return image.complete && image.naturalWidth ? image : null;
}

function fetched(row, ready) {
  let image = images.get(row);
  if (image) {
    images.delete(row);
  } else {
    image = new Image();
    image.src = pictureAddress(row);
  }
  images.set(row, image);
  if (images.size > KEPT) images.delete(images.keys().next().value);
  if (!image.complete) image.addEventListener("load", ready, { once: true });
  return image;
}
