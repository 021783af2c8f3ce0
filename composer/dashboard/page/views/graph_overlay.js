/**
 * What is measured, written into the diagram: states of nodes, rates of topics, dropped messages.
 *
 * The diagram has room for it, so nothing moves.
 */
import { s, setText } from "../dom.js";
import { hertz } from "../format.js";
import { kindOfState, labelOfState, stateShape } from "../icons.js";

/** Stand where a state and a rate are to be written: see pictures.py. */
const STATE_PLACEHOLDER = "unconfigured";
const RATE_PLACEHOLDER = "1110 Hz";
const PROCESS_PLACEHOLDER = / · pid 4194304 .*$/;
const SHAPE_SIZE = 12;
const INSET = 5;

/**
 * `executors` are the full names of the nodes in each frame of the deployment, by its key; `boxes` those
 * of all items, by their elements.
 */
export function createOverlay(picture, things, executors, boxes) {
  const nodes = new Map();
  const rates = new Map();
  const drops = new Map();
  const frames = picture.frames.filter(({ namespace }) => executors[namespace]).map(({ namespace, element }) => {
    const text = element.querySelector("text");
    return { element, text, label: text.textContent.replace(PROCESS_PLACEHOLDER, ""), nodes: executors[namespace] };
  });

  for (const item of picture.items.values()) {
    const texts = [...item.element.querySelectorAll("text")];
    if (item.kind === "node") nodes.set(item.key, nodeOf(item, texts));
    const rate = texts.find((text) => text.textContent === RATE_PLACEHOLDER);
    if (rate) rates.set(item.key, rate);
  }
  for (const line of picture.lines) {
    const texts = line.parts.flatMap((part) => [...part.querySelectorAll("text")]);
    const rate = texts.find((text) => text.textContent === RATE_PLACEHOLDER);
    if (rate) rates.set(line.key, rate);
  }
  for (const text of rates.values()) {
    const label = text.parentElement;
    const lines = [...label.querySelectorAll("text")];
    text.textContent = "";
    label.classList.add("unmeasured");
    label.classList.toggle("alone", lines.length === 1);
    label.style.setProperty("--kept", (lines.length - 0.8) / lines.length);
    for (const above of lines.slice(0, lines.indexOf(text))) above.classList.add("above");
  }

  function nodeOf(item, texts) {
    const box = boxes.get(item.element);
    const at = `translate(${box.x + INSET} ${box.y + INSET}) scale(.75)`;
    const mark = s("g", { class: "mark", transform: at });
    item.element.append(mark);
    return { item, mark, text: texts.find((text) => text.textContent === STATE_PLACEHOLDER), state: undefined };
  }

  function showState(entry, state) {
    if (entry.state === state) return;
    entry.state = state;
    entry.item.element.dataset.state = kindOfState(state);
    entry.mark.replaceChildren(stateShape(state));
    if (entry.text) setText(entry.text, labelOfState(state));
    entry.item.element.setAttribute("aria-label", `node ${entry.item.name}, ${labelOfState(state)}`);
  }

  /** Write the dropped messages over the middle of a line, above all boxes; only if there are any. */
  function showDrops(line, total) {
    const [path] = line.parts;
    path.classList.toggle("lossy", total > 0);
    if (total > 0 && !drops.has(line.key)) {
      const middle = path.getPointAtLength(path.getTotalLength() / 2);
      const text = s("text", { class: "edge-label drop-label", x: middle.x, y: middle.y - SHAPE_SIZE / 2 });
      picture.world.append(text);
      drops.set(line.key, text);
    }
    const label = drops.get(line.key);
    if (label) setText(label, total > 0 ? `${total} dropped` : "");
  }

  function showProcesses({ element, text, label, nodes }, live) {
    const found = processesOf(nodes.map((name) => live.nodes[name]).filter(Boolean));
    setText(text, [label, ...found.words].join(" · "));
    element.dataset.state = found.state;
  }

  /** A line of the view of ports goes from a publisher to a subscription: `publisher:… -> subscription:…`. */
  function rateOf(line, live) {
    const [key] = line.split(" -> ");
    if (live.edges[key]?.rate_hz !== undefined) return live.edges[key].rate_hz;
    const topic = things[key]?.channel;
    if (live.topics[topic]?.rate_hz !== undefined) return live.topics[topic].rate_hz;
    if (!key.startsWith("topic:")) return null;
    // Several publishers: each reports its own rate.
    const own = Object.entries(live.edges).filter(([edge]) => edge.startsWith("publisher:") && edge.endsWith(`.${topic}`));
    return own.length > 0 ? own.reduce((sum, [, { rate_hz: rate }]) => sum + (rate ?? 0), 0) : null;
  }

  return {
    show(live) {
      for (const [key, entry] of nodes) {
        const node = live.nodes[things[key]?.node];
        if (node) showState(entry, node.state);
      }
      for (const frame of frames) showProcesses(frame, live);
      for (const [key, text] of rates) {
        const rate = rateOf(key, live);
        setText(text, rate === null ? "" : hertz(rate));
        text.parentElement.classList.toggle("unmeasured", rate === null);
      }
      for (const line of picture.lines) {
        const edge = live.edges[line.key.split(" -> ").at(-1)];
        if (edge?.dropped_total !== undefined) showDrops(line, edge.dropped_total);
      }
    },
  };
}

/** Return what runs these nodes, in words, and its state: that of processes with external nodes is not known. */
function processesOf(nodes) {
  const pids = new Set(nodes.map(({ pid }) => pid).filter(Boolean));
  const restarts = nodes.reduce((sum, node) => sum + (node.restarts ?? 0), 0);
  const words = restarts === 0 ? [] : [restarts === 1 ? "1 restart" : `${restarts} restarts`];
  const isWrong = nodes.some((node) => node.held_down);
  if (pids.size > 0) {
    const running = pids.size === 1 ? `pid ${[...pids][0]}` : `${pids.size} running`;
    return { words: [running, ...words], state: isWrong ? "wrong" : "active" };
  }
  if (nodes.some(({ state }) => state === "active")) return { words, state: "unknown" };
  return { words: ["not running", ...words], state: isWrong ? "wrong" : "unconfigured" };
}
