/**
 * What one picture shows, read from its SVG.
 *
 * A thing is a vertex, a block or a port: {key, kind, namespace, name, element}.
 * A line joins two things: {key, kind, source, target, parts}, parts being its path and its label.
 */
function readPicture(view) {
  const svg = view.querySelector(".picture");
  const things = new Map();
  for (const element of svg.querySelectorAll("[data-key]")) {
    const { key, kind, namespace } = element.dataset;
    const words = [...element.querySelectorAll("text")].map((text) => text.textContent);
    things.set(key, { key, kind, namespace, name: words[0] ?? key, words, element });
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
  return { view, svg, world: svg.querySelector(".world"), things, lines, frames };
}

/** The place of a thing in the picture's own units, however far it is zoomed. */
function boxOf(thing) {
  return thing.element.querySelector(".shape").getBBox();
}
