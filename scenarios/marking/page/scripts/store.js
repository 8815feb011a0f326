// What the page knows: the server's state, and what only this page needs (frame, tool, cross, zoom).

export const STATUS = { s: "seen", p: "predicted", l: "lost", f: "fixed" };
const COLOURS = ["#ffd23f", "#4cc9f0", "#ff7aa8", "#9be564", "#ff9f45", "#c3a6ff", "#5eead4", "#f4f4f5"];

export const store = {
  state: null,
  row: 0,
  tool: null,
  cross: [0, 0],
  view: { scale: 1, x: 0, y: 0 },
  spots: [],
  ruler: [],
  drag: null,
  listeners: [],
};

export function listen(listener) {
  store.listeners.push(listener);
}

export function changed() {
  for (const listener of store.listeners) listener(store);
}

export function frame() {
  return store.state.film.frames[store.row];
}

export function firstRow() {
  return store.state.film.frames.indexOf(store.state.film.first);
}

export function colour(name) {
  const index = store.state.markers.findIndex((marker) => marker.name === name);
  return COLOURS[index % COLOURS.length];
}

export function goTo(row) {
  const last = store.state.film.frames.length - 1;
  const kept = Math.min(Math.max(Math.round(row), 0), last);
  if (kept === store.row) return;
  store.row = kept;
  store.spots = [];
  changed();
}

export function choose(tool) {
  store.tool = tool;
  store.ruler = [];
  const marker = store.state.markers.find(({ name }) => tool?.kind === "marker" && name === tool.name);
  if (tool?.kind === "style" || (marker && unplaced(marker))) store.row = firstRow();
  changed();
}

// A marker in a frame: from the tracks, else as it was placed there; null where it is lost.
export function markerAt(name, row = store.row) {
  const track = store.state.tracks?.[name];
  if (track) {
    const x = track.x[row];
    return x === null ? null : { at: [x, track.y[row]], status: STATUS[track.status[row]] };
  }
  const marker = store.state.markers.find((one) => one.name === name);
  const placed = marker.placed[String(store.state.film.frames[row])];
  return placed ? { at: [placed[0], placed[1]], status: placed[2] ? "seen" : "fixed" } : null;
}

export function unplaced(marker) {
  return !marker.coded && !(String(store.state.film.first) in marker.placed);
}

// After a marker is placed in the first frame, the next one that is needed is chosen.
export function nextTool() {
  const needed = store.state.markers.find((marker) => unplaced(marker) && !marker.optional);
  if (needed) choose({ kind: "marker", name: needed.name });
}

// What to do next, in words.
export function advice() {
  const state = store.state;
  const needed = state.markers.find((marker) => unplaced(marker) && !marker.optional);
  if (needed) return `Click on ${needed.name} in the picture.`;
  if (state.needs_length) return `Give the distance between ${state.lengths[state.needs_length].pair.join(" and ")}.`;
  if (!state.tracks) return "Track the markers.";
  if (!state.saved) return "Check the tracks, then save and convert.";
  return state.converted ? "Done." : "Saved.";
}
