/** Connects the parts of the page. */
import { createAppearance } from "./appearance.js";
import { createFilter } from "./filter.js";
import { readPicture } from "./picture.js";
import { createSearch } from "./search.js";
import { createSelection, listenToItems } from "./selection.js";
import { createTabs } from "./tabs.js";
import { createViewport } from "./viewport.js";

const ZOOM_STEP = 1.25;

function main() {
  const pictures = [...document.querySelectorAll(".view")].map(readPicture);
  const viewports = new Map(pictures.map((picture) => [picture, createViewport(picture)]));
  const placed = new Set();
  const currentPicture = () => tabs.current();
  const viewportOf = (picture) => viewports.get(picture);

  /** Fit a picture when it is first shown: a hidden picture has no size. */
  function placeOnce() {
    const picture = currentPicture();
    if (placed.has(picture)) return;
    placed.add(picture);
    viewportOf(picture).fit();
  }

  const tabs = createTabs(pictures, {
    before: () => selection.unmark(),
    after: () => {
      placeOnce();
      search.update();
      if (selection.isOpen()) selection.mark();
    },
  });
  const articles = new Map();
  for (const article of document.querySelectorAll(".listing [data-about]")) {
    articles.set(article.dataset.about, article);
  }
  const element = (id) => document.getElementById(id);
  const panel = {
    panel: element("details"),
    about: element("about"),
    neighbors: element("neighbors"),
    close: element("close"),
  };
  const selection = createSelection(panel, currentPicture, viewportOf, {
    articleOf: (key) => articles.get(key)?.cloneNode(true),
  });
  const search = createSearch({ input: element("search"), output: element("matches") }, currentPicture, {
    detailsOf: (key) => articles.get(key)?.textContent.toLowerCase() ?? "",
    goTo: selection.goTo,
  });
  createFilter(pictures);
  createAppearance(element("appearance"));
  for (const picture of pictures) listenToItems(picture, selection, viewportOf(picture));

  const commands = {
    in: () => viewportOf(currentPicture()).zoom(ZOOM_STEP),
    out: () => viewportOf(currentPicture()).zoom(1 / ZOOM_STEP),
    fit: () => viewportOf(currentPicture()).fit(),
  };
  for (const button of document.querySelectorAll("[data-zoom]")) {
    button.addEventListener("click", commands[button.dataset.zoom]);
  }
  listenToKeys(commands, { search, selection });
  placeOnce();
}

/** Handle + - 0 / and Escape, except while the user types in the search field. */
function listenToKeys(commands, { search, selection }) {
  const actions = {
    "+": commands.in,
    "=": commands.in,
    "-": commands.out,
    0: commands.fit,
    "/": search.focus,
    Escape: selection.clear,
  };
  document.addEventListener("keydown", (event) => {
    const typing = event.target instanceof HTMLInputElement && event.target.type === "search";
    const action = actions[event.key];
    if (typing || !action || event.ctrlKey || event.metaKey || event.altKey) return;
    action();
    event.preventDefault();
  });
}

main();
