// The column beside the picture: lights, markers, lengths, points, and what was written.

import { choose, colour, frame, markerAt, store } from "./store.js";

const find = (selector) => document.querySelector(selector);

export function element(name, properties = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (key.startsWith("aria-") || key === "role") made.setAttribute(key, value);
    else made[key] = value;
  }
  made.append(...children);
  return made;
}

export function drawPanel(act) {
  drawLights();
  drawMarkers();
  drawLengths(act);
  drawPoints(act);
  drawResult();
  const { state, tool } = store;
  find("#undo").disabled = !state.undo;
  find("#redo").disabled = !state.redo;
  find("#convert").disabled = !state.tracks || state.needs_length !== null;
  find("#polarity").value = state.polarity;
  const marker = state.markers.find(({ name }) => tool?.kind === "marker" && name === tool.name);
  find("#forget").disabled = !marker || !(String(frame()) in marker.placed);
}

function drawLights() {
  find("#lights").replaceChildren(...store.state.lights.map((light) => {
    const mark = element("i", { "aria-hidden": "true" });
    const colourName = element("span", { className: "unseen", textContent: `${light.colour}: ` });
    const about = element("strong", {}, colourName, light.about);
    return element("li", { className: light.colour }, mark, about, element("span", { textContent: light.sentence }));
  }));
}

// A button of a group of which one is chosen; the focus stays where it was.
function choice(key, text, said, tool, style) {
  const chosen = store.tool?.kind === tool.kind && ["name", "lip", "body"].every((part) => store.tool[part] === tool[part]);
  const swatch = element("b");
  swatch.style.background = style;
  const button = element("button", { type: "button", className: "choice", role: "radio", "aria-checked": String(chosen) }, swatch, text, element("em", { textContent: said }));
  button.dataset.key = key;
  button.addEventListener("click", () => choose(chosen ? null : tool));
  return button;
}

function refilled(holder, children) {
  const key = holder.contains(document.activeElement) ? document.activeElement.dataset.key : null;
  holder.replaceChildren(...children);
  if (key) [...holder.querySelectorAll("[data-key]")].find((one) => one.dataset.key === key)?.focus();
}

function drawMarkers() {
  refilled(find("#markers"), store.state.markers.filter((marker) => !marker.coded).map((marker, index) => {
    const here = markerAt(marker.name);
    const track = store.state.tracks?.[marker.name];
    const placed = Object.keys(marker.placed).length > 0;
    let said = marker.optional && !placed ? "optional" : "not placed";
    if (here) said = here.status;
    else if (track) said = "lost here";
    else if (placed) said = "placed";
    return choice(`marker-${marker.name}`, `${index + 1} ${marker.name}`, said, { kind: "marker", name: marker.name }, colour(marker.name));
  }));
}

function drawLengths(act) {
  if (find("#lengths").contains(document.activeElement) && document.activeElement.tagName === "INPUT") return;
  refilled(find("#lengths"), Object.entries(store.state.lengths).map(([body, length]) => {
    const input = element("input", { type: "text", inputMode: "decimal", value: length.mm ?? "", autocomplete: "off" });
    input.dataset.body = body;
    input.addEventListener("focus", () => showKeypad(input, act));
    input.addEventListener("keydown", (event) => {
      if (event.key === "Enter") setLength(input, act);
    });
    const label = element("label", {}, `${length.pair.join(" – ")} `, measure(input, " mm"));
    const set = element("button", { type: "button", textContent: "Set" });
    set.dataset.key = `set-${body}`;
    set.addEventListener("click", () => setLength(input, act));
    const chosen = store.tool?.kind === "ruler" && store.tool.body === body;
    const ruler = element("button", { type: "button", textContent: chosen ? "Ruler: click its two ends" : "By a ruler in the picture", "aria-pressed": String(chosen) });
    ruler.dataset.key = `ruler-${body}`;
    ruler.addEventListener("click", () => choose(chosen ? null : { kind: "ruler", body }));
    const row = element("div", { className: "length row" }, label, set, ruler);
    if (chosen && store.ruler.length === 2) row.append(rulerLength(body, act));
    if (length.sigma_mm) row.append(element("small", { textContent: `± ${length.sigma_mm} mm by the ruler` }));
    return row;
  }));
  if (!store.ruler.length && !find("#lengths").contains(document.activeElement)) find("#keypad").hidden = true;
}

function measure(input, unit) {
  return element("span", { className: "measure" }, input, unit);
}

function rulerLength(body, act) {
  const input = element("input", { type: "text", inputMode: "decimal", autocomplete: "off" });
  input.dataset.ruler = body;
  input.addEventListener("focus", () => showKeypad(input, act));
  input.addEventListener("keydown", (event) => {
    if (event.key === "Enter") setLength(input, act);
  });
  const set = element("button", { type: "button", textContent: "Set the ruler's length" });
  set.addEventListener("click", () => setLength(input, act));
  return element("span", { className: "row" }, element("label", {}, "the ruler is ", measure(input, " mm long")), set);
}

function setLength(input, act) {
  const mm = Number(input.value.replace(",", "."));
  input.blur();
  find("#keypad").hidden = true;
  if (input.dataset.ruler) {
    const [[x1, y1], [x2, y2]] = store.ruler;
    choose(null);
    act({ do: "ruler", body: input.dataset.ruler, frame: frame(), x1, y1, x2, y2, mm });
  } else if (input.value.trim() === "") {
    act({ do: "no length", body: input.dataset.body });
  } else {
    act({ do: "length", body: input.dataset.body, mm });
  }
}

// Digits for a hand that holds a mouse only.
function showKeypad(input, act) {
  const keypad = find("#keypad");
  const keys = [..."123456789", ".", "0", "⌫"].map((text) => {
    const key = element("button", { type: "button", textContent: text, "aria-label": text === "⌫" ? "delete" : text });
    key.addEventListener("mousedown", (event) => event.preventDefault());
    key.addEventListener("click", () => {
      input.value = text === "⌫" ? input.value.slice(0, -1) : input.value + text;
    });
    return key;
  });
  const set = element("button", { type: "button", textContent: "Set" });
  set.addEventListener("mousedown", (event) => event.preventDefault());
  set.addEventListener("click", () => setLength(input, act));
  keypad.replaceChildren(...keys, set);
  keypad.hidden = false;
}

function drawPoints(act) {
  const { style, touches } = store.state;
  const rows = [["lower", "lower lip: first contact, in this frame"], ["upper", "upper lip: first contact, in this frame"]].map(([lip, text]) => {
    const touch = touches[lip];
    return choice(`touch-${lip}`, text, touch ? `frame ${touch.frame}` : "", { kind: "touch", lip }, "#fff");
  });
  const texts = { upper_lip: "foremost point of the upper lip", rim_lower: "lower end of the rim", rim_upper: "upper end of the rim" };
  for (const [name, at] of Object.entries(style)) {
    rows.push(choice(`style-${name}`, texts[name], at ? "placed" : "", { kind: "style", name }, "#fff"));
  }
  refilled(find("#points"), rows);
}

function drawResult() {
  const { state } = store;
  const parts = [];
  if (state.saved) parts.push(element("p", {}, `Saved: ${state.files.join(", ")} in `, element("code", { textContent: state.out })));
  if (state.converted) {
    parts.push(element("p", { id: "motion" }, "Motion: ", element("code", { textContent: state.converted.motion })));
    parts.push(element("ul", {}, ...state.converted.warnings.map((text) => element("li", { textContent: text }))));
  }
  find("#result").replaceChildren(...parts);
}
