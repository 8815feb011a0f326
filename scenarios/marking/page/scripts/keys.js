// Everything by keyboard: what each key does, and the list that the page shows.

const LIST = [
  ["1 … 9", "choose a marker"],
  ["Tab", "from the picture to every button"],
  ["arrows", "move the cross by a pixel (in the picture; with Shift by ten)"],
  ["Enter", "place what is chosen at the cross (with Alt exactly there)"],
  ["N, P", "move the cross to the next, previous spot"],
  ["+ −", "zoom at the cross; 0: the whole picture"],
  [", .", "a frame back, on; with Shift ten"],
  ["Space", "play or stop"],
  ["T", "track the markers"],
  ["Backspace", "take back what was set in this frame"],
  ["U, R", "undo, redo"],
  ["S, C", "save; save and convert"],
];

export function prepareKeys(actions) {
  const list = document.querySelector("#keys");
  for (const [key, text] of LIST) {
    const term = document.createElement("dt");
    term.append(Object.assign(document.createElement("kbd"), { textContent: key }));
    list.append(term, Object.assign(document.createElement("dd"), { textContent: text }));
  }
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || typing(event)) return;
    const action = actionOf(event, actions);
    if (!action) return;
    event.preventDefault();
    action();
  });
}

// Whether a key belongs to a field or a button that has the focus.
function typing(event) {
  const { target } = event;
  if (target.matches("input[type=text], select")) return true;
  if (target.matches("input[type=range]")) return event.key.startsWith("Arrow");
  return target.matches("button, summary, input") && ["Enter", " "].includes(event.key);
}

function actionOf(event, actions) {
  const far = event.shiftKey ? 10 : 1;
  const inPicture = event.target.id === "picture";
  const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  if (inPicture && event.key in moves) {
    const [x, y] = moves[event.key];
    return () => actions.move(x * far, y * far);
  }
  if (inPicture && event.key === "Enter") return () => actions.place(event.altKey);
  if (/^[1-9]$/.test(event.key)) return () => actions.choose(Number(event.key) - 1);
  const single = {
    ",": () => actions.step(-1), ";": () => actions.step(-10), "<": () => actions.step(-10),
    ".": () => actions.step(1), ":": () => actions.step(10), ">": () => actions.step(10),
    " ": actions.play, n: () => actions.spot(1), p: () => actions.spot(-1),
    "+": () => actions.zoom(1.5), "=": () => actions.zoom(1.5), "-": () => actions.zoom(1 / 1.5),
    0: actions.whole, t: actions.track, u: actions.undo, r: actions.redo,
    s: actions.save, c: actions.convert, Backspace: actions.forget, Delete: actions.forget,
  };
  return single[event.key.length === 1 ? event.key.toLowerCase() : event.key] ?? null;
}
