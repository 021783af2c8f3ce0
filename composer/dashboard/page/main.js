/** Starts the page: connection, address, frame and views. */
import { createConnection } from "./connection.js";
import { h } from "./dom.js";
import { createFrame } from "./frame.js";
import { createRouter } from "./router.js";
import { createGraphView } from "./views/graph.js";
import { createLogView } from "./views/log.js";
import { createNodesView } from "./views/nodes.js";
import { createParametersView } from "./views/parameters.js";
import { createServicesView } from "./views/services.js";
import { createTimingView } from "./views/timing.js";
import { createTopicsView } from "./views/topics.js";

/** View -> how it is made; the address of an action is in the view of services. */
const VIEWS = {
  graph: createGraphView,
  nodes: createNodesView,
  topics: createTopicsView,
  services: createServicesView,
  actions: createServicesView,
  parameters: createParametersView,
  log: createLogView,
  timing: createTimingView,
};
/** How long a page may be hidden before it stops receiving. */
const HIDDEN_MS = 3000;

function main() {
  const place = document.getElementById("main");
  const made = new Map();
  let shown = null;
  let hiding = 0;

  const app = { hello: null, nodes: null };
  app.isReadOnly = () => app.hello?.read_only ?? false;
  const router = createRouter(show);
  app.go = router.go;
  const frame = createFrame(app);
  app.connection = createConnection(`ws://${location.host}/ws`, {
    onhello: (hello) => {
      app.hello = hello;
      frame.showHello(hello);
      dispatchEvent(new Event("hello"));
    },
    onstate: frame.showConnection,
  });
  frame.start(app.connection);

  function show(route) {
    const make = VIEWS[route.view];
    if (!make) {
      leave();
      place.replaceChildren(h("p", { class: "empty" }, `There is no view '${route.view}'.`));
      return;
    }
    if (!made.has(make)) made.set(make, make(app));
    const view = made.get(make);
    if (view !== shown) {
      leave();
      place.replaceChildren(view.element);
      shown = view;
    }
    frame.showView(route.view === "actions" ? "services" : route.view, route.name);
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
  frame.listenToKeys((view) => router.go(`/${view}`));
  show(router.read());
}

main();
