/**
 * Which kinds and which namespaces are shown, in all pictures.
 *
 * A node is shown when its namespace is; a topic, service or action when a node at one of its ends
 * is, or when it has none; a line when both its ends are.
 */
function createFilter(pictures) {
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

  /** A namespace stands for all that are in it, too. */
  function spread(changed) {
    if (changed.name !== "namespace") return;
    for (const choice of choices) {
      const inside = choice.name === "namespace" && isWithin(choice.value, changed.value);
      if (inside) choice.checked = changed.checked;
    }
  }

  for (const choice of choices) {
    choice.addEventListener("change", () => {
      spread(choice);
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

function applyTo(picture, hidden) {
  const shown = new Set();
  const reached = new Map();
  for (const line of picture.lines) {
    for (const [channel, other] of [[line.source, line.target], [line.target, line.source]]) {
      const node = picture.things.get(other);
      const wanted = isNode(node) && !hidden.namespaces.has(node.namespace);
      reached.set(channel, Boolean(reached.get(channel)) || wanted);
    }
  }
  for (const thing of picture.things.values()) {
    const kind = isNode(thing) ? "node" : thing.kind;
    const placed = isNode(thing)
      ? !hidden.namespaces.has(thing.namespace)
      : reached.get(thing.key) ?? true;
    const isShown = placed && !hidden.kinds.has(kind);
    if (isShown) shown.add(thing.key);
    thing.element.classList.toggle("out", !isShown);
  }
  for (const line of picture.lines) {
    const isShown =
      shown.has(line.source) && shown.has(line.target) && !hidden.kinds.has(line.kind);
    for (const part of line.parts) part.classList.toggle("out", !isShown);
  }
  const names = [...picture.things.values()].filter((thing) => shown.has(thing.key));
  for (const frame of picture.frames) {
    if (!frame.namespace.startsWith("/")) continue;
    const used = names.some((thing) => isWithin(thing.namespace, frame.namespace));
    frame.element.classList.toggle("out", !used);
  }
}

function isNode(thing) {
  return thing.kind === "node" || thing.kind === "port";
}

function isWithin(namespace, around) {
  return namespace === around || namespace.startsWith(around === "/" ? around : `${around}/`);
}
