/**
 * A message as a tree, updated in place.
 *
 * `filter` shows the fields whose path contains it; `onplot(path)` adds a button to every number.
 */
import { button, h, setText } from "../dom.js";
import { number } from "../format.js";
import { icon } from "../icons.js";

const MOST_ITEMS = 200;

export function createMessageTree({ onplot = null, isPlotted = () => false } = {}) {
  const element = h("div", { class: "message" });
  const leaves = new Map();
  let shape = null;
  let filter = "";
  let last;

  function show(value) {
    last = value;
    const lines = [...flatten(value, "", 0)].filter((line) => isShown(line));
    const newShape = lines.map(({ path, kind }) => `${path}:${kind}`).join("\n");
    if (newShape !== shape) {
      shape = newShape;
      leaves.clear();
      element.replaceChildren(...(lines.length > 0 ? lines.map(build) : [nothing()]));
    }
    for (const { path, text } of lines) {
      const leaf = leaves.get(path);
      if (leaf) setText(leaf, text);
    }
  }

  function isShown({ path, isLeaf, inside }) {
    if (filter === "") return true;
    return isLeaf ? path.toLowerCase().includes(filter) : inside.some((one) => one.toLowerCase().includes(filter));
  }

  function nothing() {
    return h("p", { class: "hint" }, filter === "" ? "The message has no fields." : "No field matches.");
  }

  function build({ path, name, depth, kind, isLeaf }) {
    const line = h("div", { class: "field", data: { path, kind } });
    line.style.paddingLeft = `${depth * 14}px`;
    line.append(h("span", { class: "name" }, name));
    if (!isLeaf) return line;
    const value = h("span", { class: "value" });
    leaves.set(path, value);
    line.append(value);
    if (onplot && kind === "number") {
      line.append(
        button(icon("plot"), () => onplot(path), {
          class: "quiet plot-field",
          "aria-label": `Plot ${path}`,
          title: `Plot ${path}`,
          "aria-pressed": String(isPlotted(path)),
        }),
      );
    }
    return line;
  }

  return {
    element,
    show,
    filter(text) {
      filter = text.trim().toLowerCase();
      shape = null;
      if (last !== undefined) show(last);
    },
  };
}

/** Yield the lines of a value: its fields, and before those of a field the line of its name. */
function* flatten(value, path, depth) {
  const entries = Array.isArray(value)
    ? value.slice(0, MOST_ITEMS).map((item, index) => [`[${index}]`, `${path}[${index}]`, item])
    : Object.entries(value ?? {}).map(([name, item]) => [name, path ? `${path}.${name}` : name, item]);
  for (const [name, itemPath, item] of entries) {
    if (isSimple(item)) {
      yield { path: itemPath, name, depth, kind: kindOf(item), isLeaf: true, text: textOf(item) };
      continue;
    }
    const inside = [...flatten(item, itemPath, depth + 1)];
    yield {
      path: itemPath,
      name: Array.isArray(item) ? `${name} (${item.length})` : name,
      depth,
      kind: "group",
      isLeaf: false,
      inside: inside.filter((line) => line.isLeaf).map((line) => line.path),
      text: "",
    };
    yield* inside;
  }
}

/** A value of one line. So is a short list of numbers. */
function isSimple(value) {
  if (value === null || typeof value !== "object") return true;
  const items = Object.values(value);
  if (items.length === 0) return true;
  return Array.isArray(value) && items.length > 9 && items.every((item) => typeof item !== "object");
}

function kindOf(value) {
  if (typeof value === "number" || typeof value === "boolean") return "number";
  return typeof value === "string" ? "string" : "list";
}

function textOf(value) {
  if (typeof value === "number") return number(value);
  if (typeof value === "string") return value === "" ? '""' : value;
  if (Array.isArray(value)) return `[${value.map((item) => (typeof item === "number" ? number(item) : String(item))).join(", ")}]`;
  return JSON.stringify(value);
}
