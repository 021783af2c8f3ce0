/**
 * Leaves out of the diagram what is too small to read, and keeps names in a readable size.
 *
 * From afar, a box has only its name and its state. Names of nodes are shortened where others are next to
 * them. Names that have no room are shortened to their boxes, without states; those of frames are left out.
 * Names of outer frames come first, then those of nodes.
 */
import { setText } from "../dom.js";
import { isNode } from "../graph/filter.js";

/** From there on, everything is shown where it is drawn. */
const NEAR_PIXELS_PER_UNIT = 0.7;
/** Texts have at least these sizes in pixels then, but no more than this part beyond their room. */
const LEAST_NAME = 11;
const LEAST_SMALL = 10;
const MOST_ENLARGED = 1.25;
/** Their sizes as they are drawn, in SVG units. */
const DRAWN_NAME = 12;
const DRAWN_SMALL = 10;
/** Names have the same place within a step. */
const STEP = 1.04;
/** Sizes in pixels of the screen. */
const NODE = { font: 11, height: 17, padding: 5 };
/** Of a name in its own box, which has no room for more. */
const COMPACT = { font: 10, height: 13, padding: 1 };
const CHANNEL = { font: 10, height: 14, padding: 4 };
const FRAME = { font: 12, height: 15, padding: 0 };
const INNER_FRAME = { font: 10, height: 12, padding: 0 };
const MARK = 10;
const HEAD = 6;
const GAP = 1;
/** Less of a name says nothing, unless it has no other place than its box. */
const LEAST_LETTERS = 3;
const LEAST_COMPACT = 1;
/** The size of a state's shape and of an arrow head as they are drawn, in SVG units. */
const DRAWN_MARK = 12;
const DRAWN_HEAD = 8;

const measuring = document.createElement("canvas").getContext("2d");

/**
 * Return a function that shows the picture for a number of pixels per unit.
 *
 * `boxes` are those of items and frames in SVG units, by their elements.
 */
export function createZoomLevels(picture, boxes) {
  const { svg } = picture;
  const font = getComputedStyle(svg.querySelector("text") ?? svg).fontFamily;
  const frames = framesOf(picture, boxes);
  const items = [...picture.items.values()].filter((item) => item.kind !== "port").map((item) => itemOf(item, boxes.get(item.element)));
  const named = [
    ...frames.filter((frame) => frame.isOuter),
    ...items.filter(({ item }) => isNode(item)),
    ...items.filter(({ item }) => !isNode(item)),
    ...frames.filter((frame) => !frame.isOuter),
  ];
  let style = null;
  for (const entry of named) {
    entry.family = font;
    if (entry.style !== style) measuring.font = `${entry.style.font}px ${font}`;
    style = entry.style;
    entry.name = entry.text.textContent;
    entry.around = 2 * style.padding + (entry.hasMark ? MARK + 2 : 0);
    entry.width = measuring.measureText(entry.name).width + entry.around;
  }
  let shown = null;

  return (pixelsPerUnit) => {
    const { isFar, level, unit } = levelOf(pixelsPerUnit);
    if (level === shown) return;
    shown = level;
    showUnits(picture, pixelsPerUnit);
    if (isFar) showFar(named, unit, svg.viewBox.baseVal.width);
    else showNear(named);
  };
}

/** Set the size of a pixel, before anything is measured: all styles depend on it. */
export function showUnits({ svg, world }, pixelsPerUnit) {
  const { isFar, level, unit } = levelOf(pixelsPerUnit);
  svg.classList.toggle("far", isFar);
  world.style.setProperty("--unit", unit);
  const enlarged = (least, drawn) => (isFar ? 1 : Math.min(Math.max(least / drawn / STEP ** level, 1), MOST_ENLARGED));
  world.style.setProperty("--name", enlarged(LEAST_NAME, DRAWN_NAME));
  world.style.setProperty("--small", enlarged(LEAST_SMALL, DRAWN_SMALL));
  for (const head of svg.querySelectorAll("marker")) {
    head.setAttribute("markerWidth", Math.max(DRAWN_HEAD, HEAD * unit));
    head.setAttribute("markerHeight", Math.max(DRAWN_HEAD, HEAD * unit));
  }
}

/** Return whether a picture is far, its level, which is the same within a step, and the units of a pixel. */
function levelOf(pixelsPerUnit) {
  const isFar = pixelsPerUnit < NEAR_PIXELS_PER_UNIT;
  const level = Math.floor(Math.log(isFar ? pixelsPerUnit : Math.min(pixelsPerUnit, 1)) / Math.log(STEP));
  return { isFar, level, unit: isFar ? STEP ** -level : 1 };
}

function itemOf(item, box) {
  const shapes = [...item.element.querySelectorAll(".shape")];
  const [text, state] = item.element.querySelectorAll("text");
  const center = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
  const hasMark = item.kind === "node" && Boolean(state);
  return { item, shapes, text, box, center, style: isNode(item) ? NODE : CHANNEL, hasMark };
}

/** Return the mark of a state, which graph_overlay.js draws. */
function markOf({ item, hasMark }) {
  return hasMark ? item.element.querySelector(".mark") : null;
}

function framesOf(picture, boxes) {
  const found = picture.frames.map(({ element }) => ({
    text: element.querySelector("text"),
    element,
    box: boxes.get(element),
  }));
  for (const frame of found) {
    frame.isOuter = !found.some((other) => other !== frame && contains(other.box, frame.box));
    frame.style = frame.isOuter ? FRAME : INNER_FRAME;
  }
  return found.filter(({ text }) => text);
}

function showFar(named, unit, right) {
  // No name covers the box of a node, and that of a channel does not hide another one.
  const boxesOf = (wanted) => named.filter(({ item }) => item && wanted(item)).map(({ box }) => box);
  const taken = boxesOf(isNode);
  const nodes = named.filter(({ item }) => item && isNode(item));
  for (const entry of named) entry.label = labelOf(entry);
  for (const entry of nodes) entry.label = shortened(entry.label, roomOf(entry, nodes, unit), LEAST_LETTERS);
  const channels = new Map(boxesOf((item) => !isNode(item)).map((box) => [box, innerHalf(box)]));
  for (const entry of named) {
    const isFree = (wanted, gap) => !taken.some((other) => other !== entry.box && overlap(other, wanted, gap));
    const hidesChannel = (place) => [...channels].some(([box, inner]) => box !== entry.box && overlap(inner, place, 0));
    const hasRoom = (place) => isFree(place, GAP * unit) && !(entry.style === CHANNEL && hidesChannel(place));
    let place = placeOf(entry, unit, right);
    let isShown = hasRoom(place);
    if (entry.item && !isShown) {
      const room = entry.box.width / unit;
      entry.label = shortened(labelOf(entry, COMPACT), room, LEAST_COMPACT);
      place = placeOf(entry, unit, right);
      isShown = entry.label.width <= room && isFree(innerHalf(place), 0);
    }
    if (isShown) taken.push(place);
    if (!entry.item) {
      drawTitle(entry, isShown ? place : null, unit);
      continue;
    }
    drawItem(entry, isShown ? place : null, unit);
    entry.item.element.classList.toggle("covered", !isShown && !isFree(innerHalf(entry.box), 0) && !isNode(entry.item));
  }
}

/** Return the width in pixels that a node has next to the others, if each takes the same. */
function roomOf(entry, nodes, unit) {
  let room = entry.width;
  for (const other of nodes) {
    const isNextTo = Math.abs(other.center.y - entry.center.y) < (entry.style.height + GAP) * unit;
    if (other === entry || !isNextTo) continue;
    const apart = Math.abs(other.center.x - entry.center.x) / unit - GAP;
    room = Math.min(room, other.width < apart ? 2 * apart - other.width : apart);
  }
  return room;
}

/** Return the name of an entry in its style, or in the compact one, which has no mark. */
function labelOf({ name, width, around, style, family, hasMark }, compact = null) {
  if (!compact) return { name, width, around, style, font: `${style.font}px ${family}`, hasMark };
  const font = `${compact.font}px ${family}`;
  measuring.font = font;
  const taken = measuring.measureText(name).width + 2 * compact.padding;
  return { name, width: taken, around: 2 * compact.padding, style: compact, font, hasMark: false };
}

/** Return a label of at most this width; the whole one if less than these letters would be left. */
function shortened(label, room, least) {
  if (room >= label.width) return label;
  measuring.font = label.font;
  for (let letters = label.name.length - 1; letters >= least; letters -= 1) {
    const short = `${label.name.slice(0, letters)}…`;
    const taken = measuring.measureText(short).width + label.around;
    if (taken <= room) return { ...label, name: short, width: taken };
  }
  return label;
}

/** A name is in the middle of its box, within the picture; that of an outer frame is above it. */
function placeOf({ item, box, center, label, isOuter }, unit, right) {
  const size = { width: label.width * unit, height: label.style.height * unit };
  if (item) {
    const x = Math.max(Math.min(center.x - size.width / 2, right - size.width), 0);
    return { x, y: center.y - size.height / 2, ...size };
  }
  return { x: box.x + (isOuter ? 0 : 3 * unit), y: isOuter ? box.y - size.height - 2 * GAP * unit : box.y + unit, ...size };
}

function drawItem(entry, place, unit) {
  const { item, shapes, text, box, center, label } = entry;
  const { style, hasMark } = label;
  setText(text, label.name);
  item.element.classList.toggle("nameless", !place);
  item.element.classList.toggle("markless", !hasMark);
  const width = place ? Math.max(place.width / box.width, 1) : 1;
  const height = place ? Math.max(place.height / box.height, 1) : 1;
  const shift = place ? place.x + place.width / 2 - center.x : 0;
  for (const shape of shapes) shape.style.transform = `translate(${shift}px) scale(${width}, ${height})`;
  if (!place) return;
  const mark = hasMark ? markOf(entry) : null;
  const left = mark ? (MARK + 2) * unit : 0;
  text.style.fontSize = `${style.font * unit}px`;
  text.style.transform = `translate(${shift + left / 2}px, ${center.y - Number(text.getAttribute("y"))}px)`;
  if (mark) mark.style.transform = `translate(${place.x + style.padding * unit}px, ${center.y - (MARK * unit) / 2}px) scale(${(MARK * unit) / DRAWN_MARK})`;
}

function drawTitle({ element, text, style }, place, unit) {
  element.classList.toggle("nameless", !place);
  if (!place) return;
  text.style.fontSize = `${style.font * unit}px`;
  const x = place.x - Number(text.getAttribute("x"));
  const y = place.y + (style.height / 2) * unit - Number(text.getAttribute("y"));
  text.style.transform = `translate(${x}px, ${y}px)`;
}

function showNear(named) {
  for (const entry of named) {
    const { item, element, shapes = [], text } = entry;
    (element ?? item.element).classList.remove("nameless", "markless", "covered");
    if (item) setText(text, entry.name);
    for (const part of [...shapes, text, markOf(entry)]) {
      part?.style.removeProperty("transform");
      part?.style.removeProperty("font-size");
    }
  }
}

function innerHalf({ x, y, width, height }) {
  return { x: x + width / 4, y: y + height / 4, width: width / 2, height: height / 2 };
}

function contains(outer, inner) {
  return (
    outer.x <= inner.x && outer.x + outer.width >= inner.x + inner.width &&
    outer.y <= inner.y && outer.y + outer.height >= inner.y + inner.height
  );
}

function overlap(one, other, gap) {
  return (
    one.x < other.x + other.width + gap && other.x < one.x + one.width + gap &&
    one.y < other.y + other.height + gap && other.y < one.y + one.height + gap
  );
}
