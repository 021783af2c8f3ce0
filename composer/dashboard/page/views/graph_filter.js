/** The menu that hides kinds of things and namespaces. */
import { button, h } from "../dom.js";
import { isNode, isWithin } from "../graph/filter.js";

const KINDS = ["node", "topic", "service", "action"];

export function createFilterMenu(onchange) {
  const menu = h("div", { class: "menu" });
  const element = h("details", { class: "filter" }, h("summary", {}, "Filter"), menu);
  const cleared = { kind: new Set(), namespace: new Set() };
  let picture = null;
  let shown = "";

  function choice(group, value, depth = 0) {
    const input = h("input", {
      type: "checkbox",
      name: group,
      value,
      checked: !cleared[group].has(value),
      onchange: () => set(group, value, input.checked),
    });
    const label = h("label", {}, input, " ", group === "kind" ? `${value}s` : value);
    label.style.paddingLeft = `${depth * 16}px`;
    return label;
  }

  /** A namespace takes those in it along. */
  function set(group, value, isOn) {
    for (const input of menu.querySelectorAll(`input[name=${group}]`)) {
      if (input.value !== value && !(group === "namespace" && isWithin(input.value, value))) continue;
      input.checked = isOn;
      if (isOn) cleared[group].delete(input.value);
      else cleared[group].add(input.value);
    }
    changed();
  }

  function changed() {
    element.classList.toggle("active", cleared.kind.size + cleared.namespace.size > 0);
    onchange();
  }

  function showAll() {
    cleared.kind.clear();
    cleared.namespace.clear();
    for (const input of menu.querySelectorAll("input")) input.checked = true;
    changed();
  }

  document.addEventListener("click", (event) => {
    if (!element.contains(event.target)) element.open = false;
  });
  element.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    element.open = false;
    element.querySelector("summary").focus();
    event.stopPropagation();
  });

  function fill() {
    if (!picture || !element.open) return;
    const items = [...picture.items.values()];
    const kinds = KINDS.filter((kind) => items.some((item) => item.kind === kind));
    const namespaces = ancestors(items.filter(isNode).map((item) => item.namespace));
    const now = JSON.stringify([kinds, namespaces]);
    if (now === shown) return;
    shown = now;
    menu.replaceChildren(
      h("fieldset", {}, h("legend", {}, "Kind"), kinds.map((kind) => choice("kind", kind))),
      h("fieldset", {}, h("legend", {}, "Namespace"), namespaces.map((name) => choice("namespace", name, name.split("/").filter(Boolean).length))),
      button("Show everything", showAll),
    );
  }

  element.addEventListener("toggle", fill);

  return {
    element,
    hidden: () => ({ kinds: cleared.kind, namespaces: cleared.namespace }),
    /** Offer what is in a picture, once the menu is open. */
    update(current) {
      picture = current;
      fill();
    },
  };
}

/** Return the namespaces with those around them, in their natural order. */
function ancestors(namespaces) {
  const found = new Set(["/"]);
  for (const name of namespaces) {
    const levels = name.split("/");
    for (let depth = 2; depth <= levels.length; depth += 1) found.add(levels.slice(0, depth).join("/"));
  }
  found.delete("");
  return [...found].sort((one, other) => one.localeCompare(other, "en", { numeric: true }));
}
