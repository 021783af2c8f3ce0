/** Starts the page: connection, address, frame and views. */
import { createConnection } from "./connection.js";
import { h } from "./dom.js";
import { keepFocus } from "./focus.js";
import { createFrame, VIEWS } from "./frame.js";
import { takeKey } from "./key.js";
import { createRouter } from "./router.js";

/** Addresses that the view of another name shows. */
const SHARED = { actions: "services" };
/** How long a page may be hidden before it stops receiving. */
const HIDDEN_MS = 3000;
/** How long after the page the other views are loaded. */
const LOAD_OTHERS_MS = 2000;

function main() {
  const place = document.getElementById("main");
  const made = new Map();
  let shown = null;
  let wanted = null;
  let hiding = 0;

  const app = { hello: null, nodes: null };
  app.isReadOnly = () => app.hello?.read_only ?? false;
  const router = createRouter(show);
  app.go = router.go;
  // First, so that it opens while the frame is made; it calls nothing before that.
  app.connection = createConnection(takeKey(), {
    onhello: (hello) => {
      app.hello = hello;
      frame.showHello(hello);
      dispatchEvent(new Event("hello"));
    },
    onstate: (state) => frame.showConnection(state),
  });
  const frame = createFrame(app);
  frame.start(app.connection);

  async function show(route) {
    wanted = route;
    const view = SHARED[route.view] ?? route.view;
    if (!VIEWS.some(([id]) => id === view)) {
      leave();
      place.replaceChildren(h("p", { class: "empty" }, `There is no view '${route.view}'.`));
      place.removeAttribute("aria-busy");
      return;
    }
    frame.showView(view, route.name);
    // The view before stays until the module of the next one is loaded.
    place.setAttribute("aria-busy", "true");
    try {
      const module = await load(view);
      if (route === wanted) display(module, route);
    } finally {
      if (route === wanted) place.removeAttribute("aria-busy");
    }
  }

  function display(module, route) {
    if (!made.has(module)) made.set(module, module.createView(app));
    const view = made.get(module);
    if (view !== shown) {
      leave();
      place.replaceChildren(view.element);
      shown = view;
    }
    view.show(route);
  }

  function leave() {
    shown?.hide();
    shown = null;
  }

  document.addEventListener("visibilitychange", () => {
    clearTimeout(hiding);
    if (document.hidden) hiding = setTimeout(() => app.connection.suspend(true), HIDDEN_MS);
    else app.connection.suspend(false);
  });
  keepFocus();
  frame.listenToKeys((view) => router.go(`/${view}`));
  show(router.read());
  addEventListener("load", () => setTimeout(loadOthers, LOAD_OTHERS_MS));
}

/** A view has the name of its module, which is loaded when it is first shown. */
function load(view) {
  return import(`./views/${view}.js`);
}

/** Other views are then shown at once. */
function loadOthers() {
  for (const [view] of VIEWS) load(view).catch(() => {});
}

main();
