/**
 * The selection: its details in the panel, its connections highlighted, the rest dimmed.
 *
 * In a picture one thing can be reached with Tab; the arrow keys go to what lies in that direction,
 * Enter chooses.
 */
const DIRECTIONS = {
  ArrowLeft: { x: -1, y: 0 },
  ArrowRight: { x: 1, y: 0 },
  ArrowUp: { x: 0, y: -1 },
  ArrowDown: { x: 0, y: 1 },
};

function createSelection(currentPicture, viewportOf) {
  const panel = document.getElementById("details");
  const about = document.getElementById("about");
  const neighbors = document.getElementById("neighbors");
  const articles = new Map();
  for (const article of document.querySelectorAll(".listing [data-about]")) {
    articles.set(article.dataset.about, article);
  }
  let chosen = null;

  function choose(key) {
    unmark();
    chosen = key;
    const article = articles.get(key);
    about.replaceChildren(...(article ? [article.cloneNode(true)] : []));
    panel.hidden = false;
    panel.scrollTop = 0;
    mark();
    const thing = currentPicture().things.get(key);
    if (thing) viewportOf(currentPicture()).uncover(thing.element, panel);
  }

  function clear() {
    unmark();
    chosen = null;
    panel.hidden = true;
  }

  /** Show what is chosen in the picture that is shown now, if it is there. */
  function mark() {
    const picture = currentPicture();
    const thing = picture.things.get(chosen);
    const line = picture.lines.find((one) => one.key === chosen);
    neighbors.replaceChildren();
    if (!thing && !line) return;
    picture.svg.classList.add("choosing");
    const near = thing ? around(picture, thing) : { lines: [line], own: [], others: ends(line) };
    for (const part of near.lines.flatMap((one) => one.parts)) part.classList.add("near");
    for (const key of [...near.own, ...near.others]) {
      picture.things.get(key)?.element.classList.add("near");
    }
    for (const element of thing ? [thing.element] : line.parts) element.classList.add("chosen");
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
    const things = keys.map((key) => picture.things.get(key)).filter(Boolean);
    if (things.length === 0) return;
    const title = document.createElement("h3");
    title.textContent = "Connected to";
    neighbors.append(title, ...things.map((thing) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = thing.kind === "port" ? `${thing.words[1]} ${nameIn(thing.key)}` : labelOf(thing);
      button.addEventListener("click", () => goTo(thing));
      return button;
    }));
  }

  function goTo(thing) {
    viewportOf(currentPicture()).center(boxOf(thing));
    choose(thing.key);
  }

  document.getElementById("close").addEventListener("click", clear);
  return { choose, clear, goTo, mark, unmark, isOpen: () => !panel.hidden };
}

/** The lines at a thing (of a block: at its ports too), and what is at their other ends. */
function around(picture, thing) {
  const own = new Set([thing.key]);
  const prefix = `${nameIn(thing.key)}.`;
  for (const other of picture.things.values()) {
    if (other.kind === "port" && nameIn(other.key).startsWith(prefix)) own.add(other.key);
  }
  const lines = picture.lines.filter((line) => own.has(line.source) || own.has(line.target));
  const others = [...new Set(lines.flatMap(ends))].filter((key) => !own.has(key));
  return { lines, own: [...own], others };
}

/** Keys are `kind:name`. */
function nameIn(key) {
  return key.slice(key.indexOf(":") + 1);
}

function ends(line) {
  return [line.source, line.target];
}

function labelOf(thing) {
  return `${thing.kind === "port" ? thing.words[1] ?? "port" : thing.kind} ${thing.name}`;
}

/** Make the things of a picture reachable and choosable, by pointer and by keyboard. */
function listenToThings(picture, selection, viewport) {
  const things = [...picture.things.values()];
  for (const thing of things) {
    thing.element.setAttribute("role", "button");
    thing.element.setAttribute("aria-label", [labelOf(thing), ...thing.words.slice(1)].join(", "));
    thing.element.setAttribute("tabindex", "-1");
  }
  things[0]?.element.setAttribute("tabindex", "0");

  picture.svg.addEventListener("click", (event) => {
    const key = keyAt(event.target);
    if (key) selection.choose(key);
    else selection.clear();
  });

  picture.svg.addEventListener("keydown", (event) => {
    const thing = picture.things.get(event.target.dataset?.key);
    if (!thing) return;
    if (event.key === "Enter" || event.key === " ") selection.choose(thing.key);
    else if (DIRECTIONS[event.key]) moveFrom(thing, DIRECTIONS[event.key]);
    else return;
    event.preventDefault();
  });

  // Not on the SVG itself: Chromium makes that focusable, then.
  picture.view.addEventListener("focusin", (event) => {
    const thing = picture.things.get(event.target.dataset?.key);
    if (thing && thing.element.matches(":focus-visible")) viewport.reveal(thing.element, boxOf(thing));
  });

  function moveFrom(thing, direction) {
    const next = nearest(things, thing, direction);
    if (!next) return;
    thing.element.setAttribute("tabindex", "-1");
    next.element.setAttribute("tabindex", "0");
    next.element.focus();
  }
}

function keyAt(target) {
  const part = target.closest("[data-key], [data-edge], [data-label]");
  return part?.dataset.key ?? part?.dataset.edge ?? part?.dataset.label;
}

/** The next thing in a direction: the way there counts once, the way to the side twice. */
function nearest(things, from, direction) {
  const start = middle(boxOf(from));
  let best = null;
  for (const thing of things) {
    if (thing === from || thing.element.classList.contains("out")) continue;
    const there = middle(boxOf(thing));
    const x = there.x - start.x;
    const y = there.y - start.y;
    const ahead = x * direction.x + y * direction.y;
    const aside = Math.abs(x * direction.y) + Math.abs(y * direction.x);
    if (ahead <= 1 || aside > ahead * 3) continue;
    const distance = ahead + 2 * aside;
    if (!best || distance < best.distance) best = { thing, distance };
  }
  return best?.thing ?? null;
}

function middle(box) {
  return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}
