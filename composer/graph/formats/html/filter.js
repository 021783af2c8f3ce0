/**
 * Filters all pictures by kind and namespace.
 *
 * A node is visible if its namespace is selected. A topic, service or action is visible if a node
 * connected to it is, or if it has no connection. A line is visible if both of its ends are.
 */
export function createFilter(pictures) {
  const menu = document.querySelector(".filter");
  const choices = [...menu.querySelectorAll("input[type=checkbox]")];

  function off(group) {
    const cleared = choices.filter((choice) => choice.name === group && !choice.checked);
    return new Set(cleared.map((choice) => choice.value));
  }

  function apply() {
    const hidden = { kinds: off("kind"), namespaces: off("namespace") };
    menu.classList.toggle("active", choices.some((choice) => !choice.checked));
    for (const picture of pictures) applyTo(picture, hidden);
  }

  /** Apply a change of a namespace to all namespaces in it. */
  function applyToNested(changed) {
    if (changed.name !== "namespace") return;
    for (const choice of choices) {
      const inside = choice.name === "namespace" && isWithin(choice.value, changed.value);
      if (inside) choice.checked = changed.checked;
    }
  }

  for (const choice of choices) {
    choice.addEventListener("change", () => {
      applyToNested(choice);
      apply();
    });
  }
  document.getElementById("everything").addEventListener("click", () => {
    for (const choice of choices) choice.checked = true;
    apply();
  });
  document.addEventListener("click", (event) => {
    if (!menu.contains(event.target)) menu.open = false;
  });
  menu.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    menu.open = false;
    menu.querySelector("summary").focus();
    event.stopPropagation();
  });
}

/** Show what is in a picture unless its kind or namespace is hidden: {kinds, namespaces}. */
export function applyTo(picture, hidden) {
  const shown = new Set();
  const reached = new Map();
  for (const line of picture.lines) {
    for (const [channel, other] of [[line.source, line.target], [line.target, line.source]]) {
      const node = picture.items.get(other);
      const wanted = isNode(node) && !hidden.namespaces.has(node.namespace);
      reached.set(channel, Boolean(reached.get(channel)) || wanted);
    }
  }
  for (const item of picture.items.values()) {
    const kind = isNode(item) ? "node" : item.kind;
    const placed = isNode(item)
      ? !hidden.namespaces.has(item.namespace)
      : reached.get(item.key) ?? true;
    const isShown = placed && !hidden.kinds.has(kind);
    if (isShown) shown.add(item.key);
    item.element.classList.toggle("out", !isShown);
  }
  for (const line of picture.lines) {
    const isShown =
      shown.has(line.source) && shown.has(line.target) && !hidden.kinds.has(line.kind);
    for (const part of line.parts) part.classList.toggle("out", !isShown);
  }
  const names = [...picture.items.values()].filter((item) => shown.has(item.key));
  for (const frame of picture.frames) {
    if (!frame.namespace.startsWith("/")) continue;
    const used = names.some((item) => isWithin(item.namespace, frame.namespace));
    frame.element.classList.toggle("out", !used);
  }
}

export function isNode(item) {
  return item.kind === "node" || item.kind === "port";
}

export function isWithin(namespace, around) {
  return namespace === around || namespace.startsWith(around === "/" ? around : `${around}/`);
}
