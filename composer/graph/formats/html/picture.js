/**
 * Reads the content of a picture from its SVG.
 *
 * An item is a vertex, a block or a port: {key, kind, namespace, name, words, element}.
 * A line connects two items: {key, kind, source, target, parts}; the parts are its path and label.
 */
export function readPicture(view) {
  const svg = view.querySelector(".picture");
  const items = new Map();
  for (const element of svg.querySelectorAll("[data-key]")) {
    const { key, kind, namespace } = element.dataset;
    const words = [...element.querySelectorAll("text")].map((text) => text.textContent);
    items.set(key, { key, kind, namespace, name: words[0] ?? key, words, element });
  }
  const labels = new Map();
  for (const element of svg.querySelectorAll("[data-label]")) {
    labels.set(element.dataset.label, element);
  }
  const lines = [...svg.querySelectorAll("[data-edge]")].map((path) => {
    const { edge, kind, source, target } = path.dataset;
    const parts = [path, labels.get(edge)].filter(Boolean);
    return { key: edge, kind, source, target, parts };
  });
  const frames = [...svg.querySelectorAll("[data-cluster]")].map((element) => ({
    namespace: element.dataset.cluster,
    element,
  }));
  return { view, svg, world: svg.querySelector(".world"), items, lines, frames };
}

/** Return the bounding box of an item in SVG units, which do not depend on the zoom. */
export function boxOf(item) {
  return item.element.querySelector(".shape").getBBox();
}
