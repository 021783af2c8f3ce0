import { boxOf } from "./picture.js";

/**
 * The selection: the panel shows its details, its connections are highlighted, the rest is dimmed.
 *
 * Tab moves the focus to one item of the picture, the arrow keys move it to the next item in that
 * direction, and Enter selects the item. `articleOf` returns a new element with the details of a key,
 * or nothing; `changed` is called with the selected key, or null.
 */
const DIRECTIONS = {
  ArrowLeft: { x: -1, y: 0 },
  ArrowRight: { x: 1, y: 0 },
  ArrowUp: { x: 0, y: -1 },
  ArrowDown: { x: 0, y: 1 },
};

export function createSelection(
  { panel, about, neighbors, close },
  currentPicture,
  viewportOf,
  { articleOf, changed = () => {} },
) {
  let chosen = null;

  function choose(key) {
    unmark();
    chosen = key;
    const article = articleOf(key);
    about.replaceChildren(...(article ? [article] : []));
    panel.hidden = false;
    panel.scrollTop = 0;
    mark();
    const item = currentPicture().items.get(key);
    if (item) viewportOf(currentPicture()).uncover(item.element, panel);
    changed(key);
  }

  function clear() {
    unmark();
    chosen = null;
    panel.hidden = true;
    changed(null);
  }

  /** Highlight the selected item in the visible picture, if that contains it. */
  function mark() {
    const picture = currentPicture();
    const item = picture.items.get(chosen);
    const line = picture.lines.find((one) => one.key === chosen);
    neighbors.replaceChildren();
    if (!item && !line) return;
    picture.svg.classList.add("choosing");
    const near = item ? around(picture, item) : { lines: [line], own: [], others: ends(line) };
    for (const part of near.lines.flatMap((one) => one.parts)) part.classList.add("near");
    for (const key of [...near.own, ...near.others]) {
      picture.items.get(key)?.element.classList.add("near");
    }
    for (const element of item ? [item.element] : line.parts) element.classList.add("chosen");
    list(picture, near.others);
  }

  function unmark() {
    const picture = currentPicture();
    picture.svg.classList.remove("choosing");
    for (const element of picture.svg.querySelectorAll(".chosen, .near")) {
      element.classList.remove("chosen", "near");
    }
  }

  function list(picture, keys) {
    const items = keys.map((key) => picture.items.get(key)).filter(Boolean);
    if (items.length === 0) return;
    const title = document.createElement("h3");
    title.textContent = "Connected to";
    neighbors.append(title, ...items.map((item) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = item.kind === "port" ? `${item.words[1]} ${nameIn(item.key)}` : labelOf(item);
      button.addEventListener("click", () => goTo(item));
      return button;
    }));
  }

  function goTo(item) {
    viewportOf(currentPicture()).center(boxOf(item));
    choose(item.key);
  }

  close.addEventListener("click", clear);
  return { choose, clear, goTo, mark, unmark, isOpen: () => !panel.hidden };
}

/** Return the lines of an item and of its ports, and the items at their other ends. */
function around(picture, item) {
  const own = new Set([item.key]);
  const prefix = `${nameIn(item.key)}.`;
  for (const other of picture.items.values()) {
    if (other.kind === "port" && nameIn(other.key).startsWith(prefix)) own.add(other.key);
  }
  const lines = picture.lines.filter((line) => own.has(line.source) || own.has(line.target));
  const others = [...new Set(lines.flatMap(ends))].filter((key) => !own.has(key));
  return { lines, own: [...own], others };
}

/** Return the name in a key, which is `kind:name`. */
function nameIn(key) {
  return key.slice(key.indexOf(":") + 1);
}

function ends(line) {
  return [line.source, line.target];
}

function labelOf(item) {
  return `${item.kind === "port" ? item.words[1] ?? "port" : item.kind} ${item.name}`;
}

/** Let the user select the items of a picture with the pointer and the keyboard. */
export function listenToItems(picture, selection, viewport) {
  const items = [...picture.items.values()];
  for (const item of items) {
    item.element.setAttribute("role", "button");
    item.element.setAttribute("aria-label", [labelOf(item), ...item.words.slice(1)].join(", "));
    item.element.setAttribute("tabindex", "-1");
  }
  items[0]?.element.setAttribute("tabindex", "0");

  picture.svg.addEventListener("click", (event) => {
    const key = keyAt(event.target);
    if (key) selection.choose(key);
    else selection.clear();
  });

  picture.svg.addEventListener("keydown", (event) => {
    const item = picture.items.get(event.target.dataset?.key);
    if (!item) return;
    if (event.key === "Enter" || event.key === " ") selection.choose(item.key);
    else if (DIRECTIONS[event.key]) moveFrom(item, DIRECTIONS[event.key]);
    else return;
    event.preventDefault();
  });

  // Not on the SVG itself: Chromium would make it focusable.
  picture.view.addEventListener("focusin", (event) => {
    const item = picture.items.get(event.target.dataset?.key);
    if (item && item.element.matches(":focus-visible")) viewport.reveal(item.element, boxOf(item));
  });

  function moveFrom(item, direction) {
    const next = nearest(items, item, direction);
    if (!next) return;
    item.element.setAttribute("tabindex", "-1");
    next.element.setAttribute("tabindex", "0");
    next.element.focus();
  }
}

function keyAt(target) {
  const part = target.closest("[data-key], [data-edge], [data-label]");
  return part?.dataset.key ?? part?.dataset.edge ?? part?.dataset.label;
}

/** Return the nearest item in a direction. Sideways distance counts twice. */
function nearest(items, from, direction) {
  const start = middle(boxOf(from));
  let best = null;
  for (const item of items) {
    if (item === from || item.element.classList.contains("out")) continue;
    const there = middle(boxOf(item));
    const x = there.x - start.x;
    const y = there.y - start.y;
    const ahead = x * direction.x + y * direction.y;
    const aside = Math.abs(x * direction.y) + Math.abs(y * direction.x);
    if (ahead <= 1 || aside > ahead * 3) continue;
    const distance = ahead + 2 * aside;
    if (!best || distance < best.distance) best = { item, distance };
  }
  return best?.item ?? null;
}

function middle(box) {
  return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}
