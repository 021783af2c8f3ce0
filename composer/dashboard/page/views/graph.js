/** The graph: the diagram of `compose graph`, with the states and rates of the running system. */
import { applyTo } from "../graph/filter.js";
import { readPicture } from "../graph/picture.js";
import { createSearch } from "../graph/search.js";
import { createSelection, listenToItems } from "../graph/selection.js";
import { createViewport } from "../graph/viewport.js";
import { button, empty, h, s } from "../dom.js";
import { icon } from "../icons.js";
import { pathOf } from "../router.js";
import { dropNote, searchField, tabs } from "../widgets/parts.js";
import { createArticle } from "./graph_details.js";
import { createFilterMenu } from "./graph_filter.js";
import { createOverlay } from "./graph_overlay.js";
import { createZoomLevels, showUnits } from "./graph_zoom.js";

const ZOOM_STEP = 1.25;
/** Until then, an empty graph may be one that is not discovered yet. */
const DISCOVERY_MS = 4000;
const MIN_SIDE = 128;
const VIEWS = [
  ["nodes", "Nodes"],
  ["connections", "Ports"],
  ["lifecycle", "Bring-up", true],
  ["deployment", "Deployment", true],
];

export function createView(app) {
  const links = h("div");
  const input = searchField("Search ( / )", () => {});
  const output = h("output", { class: "matches", "aria-live": "polite" });
  const filter = createFilterMenu(() => picture && applyTo(picture, filter.hidden()));
  const note = dropNote();
  const canvas = h("section", { class: "canvas", role: "group", "aria-label": "Diagram" }, empty("Loading the graph …"));
  const about = h("div", { class: "about" });
  const neighbors = h("nav", { class: "neighbors", "aria-label": "Connected to" });
  const close = button(icon("close"), () => {}, { class: "quiet close", "aria-label": "Close details" });
  const panel = h("aside", { class: "detail floating", "aria-label": "Details", tabindex: "-1", hidden: true }, close, about, neighbors);
  const zoom = (label, title, action) => button(label, action, { title, "aria-label": label === "Fit" ? null : title });
  const element = h(
    "div",
    { class: "view graph" },
    h(
      "div",
      { class: "view-head" },
      h("h2", { class: "view-title" }, "Graph"),
      links,
      h("div", { class: "search", role: "search" }, input, output),
      filter.element,
      h("div", { class: "buttons", role: "group", "aria-label": "Zoom" },
        zoom("−", "Zoom out ( - )", () => viewport?.zoom(1 / ZOOM_STEP)),
        zoom("+", "Zoom in ( + )", () => viewport?.zoom(ZOOM_STEP)),
        zoom("Fit", "Show everything ( 0 )", () => viewport?.fit())),
      note.element,
    ),
    h("div", { class: "stage" }, canvas, panel),
  );

  let picture = null;
  let viewport = null;
  let overlay = null;
  let article = null;
  let things = {};
  let live = { nodes: {}, edges: {}, topics: {} };
  let view = "";
  let wanted = null;
  let ends = [];
  let diagram = null;
  let place = {};
  let shownAt = 0;

  const current = () => picture;
  const selection = createSelection({ panel, about, neighbors, close }, current, () => viewport, {
    articleOf: describe,
    changed: remember,
  });
  const search = createSearch({ input, output }, current, {
    detailsOf: (key) => `${JSON.stringify(things[key]?.details ?? "")} ${live.nodes[things[key]?.node]?.state ?? ""}`.toLowerCase(),
    goTo: selection.goTo,
  });

  function describe(key) {
    article?.end();
    article = things[key] ? createArticle(app, key, things[key]) : null;
    article?.update(live);
    return article?.element;
  }

  function draw(data) {
    const parsed = new DOMParser().parseFromString(`<svg xmlns="http://www.w3.org/2000/svg">${data.svg}</svg>`, "image/svg+xml");
    if (parsed.querySelector("parsererror")) {
      canvas.replaceChildren(empty("The diagram cannot be drawn.", "The server sent an invalid picture."));
      return;
    }
    things = data.things;
    if (Object.keys(things).length === 0) {
      picture = null;
      const isEarly = performance.now() - shownAt < DISCOVERY_MS;
      canvas.replaceChildren(isEarly ? empty("Discovering nodes …") : empty("There are no nodes in the ROS graph.", "Start some with compose run or ros2 run."));
      if (isEarly) setTimeout(() => picture || !ends.length || draw(data), DISCOVERY_MS);
      return;
    }
    const world = s("g", { class: "world" });
    world.append(...parsed.documentElement.childNodes);
    const pixels = Math.min(canvas.clientWidth / data.width, canvas.clientHeight / data.height) || 1;
    const svg = s("svg", { class: "picture", viewBox: `0 0 ${data.width} ${data.height}`, role: "group", "aria-label": `${data.title}: ${data.view}` }, world);
    canvas.replaceChildren(svg);
    picture = readPicture(canvas);
    showUnits(picture, pixels);
    // Measured at once: each change makes the next measurement take a layout.
    const boxes = boxesOf(picture);
    viewport = createViewport(picture, createZoomLevels(picture, boxes));
    overlay = createOverlay(picture, things, data.executors, boxes);
    viewport.fit(pixels);
    listenToItems(picture, selection, viewport);
    overlay.show(live);
    filter.update(picture);
    applyTo(picture, filter.hidden());
    search.update();
    select(wanted);
  }

  function receiveRates(data, { dropped }) {
    note.show(dropped);
    update(data);
  }

  /** Take the states from the frame, which receives them for all views. */
  function showStates() {
    const known = (app.nodes?.nodes ?? []).filter(({ system, state }) => system || state !== "");
    update({ nodes: Object.fromEntries(known.map((node) => [node.name, node])) });
  }

  function update(data) {
    live = { ...live, ...data };
    overlay?.show(live);
    article?.update(live);
  }

  function fail(error) {
    canvas.replaceChildren(empty("The graph cannot be shown.", error.message));
    picture = null;
  }

  /** The bring-up and the executors are in the file of a system. */
  function showLinks() {
    const possible = VIEWS.filter(([id, , isDeclared]) => !isDeclared || app.hello?.file || id === view);
    links.replaceChildren(tabs("Diagram", possible.map(([id, label]) => [id, label, pathOf("graph", "", { view: id === "nodes" ? "" : id })]), view));
  }

  addEventListener("hello", showLinks);

  function select(key) {
    if (!picture) return;
    const item = picture.items.get(key);
    if (item) selection.goTo(item);
    else if (key && things[key]) selection.choose(key);
    else if (selection.isOpen()) selection.clear();
  }

  /** Keep the selection in the address. */
  function remember(key) {
    if (key === null) {
      article?.end();
      article = null;
    }
    if (key === wanted) return;
    wanted = key;
    const name = key?.startsWith("node:") ? key.slice("node:".length) : "";
    app.go(pathOf("graph", name, { view: view === "nodes" ? "" : view, about: name ? "" : key ?? "" }), { replace: true });
  }

  function show({ name, query }) {
    const next = query.get("view") ?? "nodes";
    const key = name ? `node:${name}` : query.get("about");
    if (next === view && ends.length > 0) {
      if (key === wanted) return;
      wanted = key;
      select(key);
      return;
    }
    hide();
    shownAt = performance.now();
    view = next;
    wanted = key;
    showLinks();
    canvas.replaceChildren(empty("Loading the graph …"));
    place = placeNow();
    diagram = app.connection.subscribe("graph", { view, ...place }, draw, { onerror: fail });
    ends = [
      diagram,
      app.connection.subscribe("graph.live", {}, receiveRates),
    ];
    showStates();
    addEventListener("nodeschange", showStates);
    document.addEventListener("keydown", onkey);
  }

  /** Return the size of the diagram on the screen, in steps, so that small changes move nothing. */
  function placeNow() {
    const step = (side) => Math.round(2 ** (Math.round(Math.log2(Math.max(side, MIN_SIDE)) * 4) / 4));
    return { width: step(canvas.clientWidth), height: step(canvas.clientHeight) };
  }

  const resized = new ResizeObserver(() => {
    if (ends.length === 0 || canvas.clientWidth === 0) return;
    viewport?.rescale();
    const now = placeNow();
    if (now.width === place.width && now.height === place.height) return;
    place = now;
    diagram.update({ view, ...place });
  });
  resized.observe(canvas);

  function hide() {
    article?.end();
    article = null;
    for (const subscription of ends) subscription.end();
    ends = [];
    removeEventListener("nodeschange", showStates);
    document.removeEventListener("keydown", onkey);
    if (picture && selection.isOpen()) {
      selection.unmark();
      panel.hidden = true;
    }
    picture = null;
    viewport = null;
    live = { nodes: {}, edges: {}, topics: {} };
  }

  function onkey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.("input, select, dialog")) return;
    const actions = {
      "+": () => viewport?.zoom(ZOOM_STEP),
      "=": () => viewport?.zoom(ZOOM_STEP),
      "-": () => viewport?.zoom(1 / ZOOM_STEP),
      0: () => viewport?.fit(),
      Escape: () => picture && selection.clear(),
    };
    if (!actions[event.key]) return;
    actions[event.key]();
    event.preventDefault();
  }

  return { element, show, hide };
}

/** Return the boxes of items and frames in SVG units, by their elements. */
function boxesOf({ items, frames }) {
  const measured = [...[...items.values()].map(({ element }) => [element, ".shape"]), ...frames.map(({ element }) => [element, ".frame"])];
  return new Map(measured.map(([element, shape]) => [element, element.querySelector(shape).getBBox()]));
}
