/** Small drawings, in a square of 16 units, in the color of the text around them. */
import { s } from "./dom.js";

const PATHS = {
  graph: "M3.5 2.5h3v3h-3zM9.5 6.5h3v3h-3zM3.5 10.5h3v3h-3zM6.5 4H8v4h1.5M6.5 12H8V8",
  nodes: "M2.5 3.5h11M2.5 8h11M2.5 12.5h11M5 2v3M11 6.5v3M7 11v3",
  topics: "M2 8.5h2.5L6 4l3 8.5 2-6 1 2h2",
  services: "M2.5 5.5h9m-2.5-3 3 3-3 3M13.5 10.5h-9m2.5-3-3 3 3 3",
  parameters: "M2.5 4.5h6m3 0h2M2.5 11.5h2m3 0h6M8.5 3v3h3V3zM4.5 10v3h3v-3z",
  log: "M3 3.5h10M3 6.5h7M3 9.5h10M3 12.5h5",
  timing: "M8 2.5a5.5 5.5 0 1 0 0 11 5.5 5.5 0 0 0 0-11zM8 5v3.2l2.2 1.6",
  bags: "M2.5 8a5.5 5.5 0 1 0 11 0 5.5 5.5 0 0 0-11 0zM6 8a2 2 0 1 0 4 0 2 2 0 0 0-4 0z",
  pause: "M5.5 3.5v9M10.5 3.5v9",
  resume: "M5 3.5v9l7.5-4.5z",
  startup: "M5 3.5v9l7.5-4.5z",
  reset: "M4 8a4.2 4.2 0 1 1 1.3 3M4 12.5V11h1.5",
  shutdown: "M8 2.5v5M5 4.4a4.6 4.6 0 1 0 6 0",
  back: "M10 3.5 5.5 8l4.5 4.5",
  close: "M4 4l8 8M12 4l-8 8",
  plot: "M2.5 2.5v11h11M4.5 10.5l3-4 2.5 2.5 3-5",
};

export function icon(name) {
  return s(
    "svg",
    { class: "icon", viewBox: "0 0 16 16", "aria-hidden": "true" },
    s("path", { d: PATHS[name] }),
  );
}

/** A shape for each state: states differ by more than their color. */
const SHAPES = {
  active: "M6 1a5 5 0 1 0 0 10A5 5 0 0 0 6 1z",
  inactive: "M6 1a5 5 0 1 0 0 10A5 5 0 0 0 6 1zm0 1.5v7a3.5 3.5 0 0 1 0-7z",
  unconfigured: "M6 1a5 5 0 1 0 0 10A5 5 0 0 0 6 1zm0 1.5a3.5 3.5 0 1 1 0 7 3.5 3.5 0 0 1 0-7z",
  finalized: "M1.5 1.5h9v9h-9z",
  changing: "M6 .8 11.2 6 6 11.2.8 6zM6 3.2 3.2 6 6 8.8 8.8 6z",
  wrong: "M6 .8 11.6 11H.4z",
  plain: "M1 5h10v2H1z",
};

const CHANGING = ["configuring", "activating", "deactivating", "cleaningup", "shuttingdown"];

/** Return the kind of a state, which has a shape and a color. */
export function kindOfState(state) {
  if (state === "errorprocessing") return "wrong";
  if (CHANGING.includes(state)) return "changing";
  return state in SHAPES ? state : "plain";
}

/** Return how a state is written: "" is a node without a lifecycle, null one that did not respond. */
export function labelOfState(state) {
  if (state === "") return "no lifecycle";
  return state ?? "state unknown";
}

export function stateShape(state) {
  return s("path", { d: SHAPES[kindOfState(state)], "fill-rule": "evenodd" });
}
