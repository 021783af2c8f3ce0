/**
 * Makes elements. Text from the system only ever becomes text nodes and attribute values.
 */
const SVG = "http://www.w3.org/2000/svg";

/**
 * Return an HTML element. Functions named `on...` become listeners, `data` the data attributes, true
 * an empty attribute; null and false are left out, of attributes and of children.
 */
export function h(tag, attributes, ...children) {
  return fill(document.createElement(tag), attributes, children);
}

/** Return an SVG element, as `h` does. */
export function s(tag, attributes, ...children) {
  return fill(document.createElementNS(SVG, tag), attributes, children);
}

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "data") Object.assign(element.dataset, value);
    else if (name === "value" || name === "checked") element[name] = value;
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

/** Return a name that is broken after `/` and `_` where it has no room on one line. */
export function breakable(name) {
  return name.split(/(?<=[/_])/).flatMap((part, index) => (index === 0 ? [part] : [h("wbr"), part]));
}

/** Set the text of an element, unless it is the same: an update must not end a selection. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

let lastId = 0;

/** Return an id that no other element has. */
export function newId(prefix) {
  lastId += 1;
  return `${prefix}-${lastId}`;
}

export function button(label, onclick, attributes = {}) {
  return h("button", { type: "button", onclick, ...attributes }, label);
}

/** Replace the children of an element by a message about why there is nothing to show. */
export function empty(text, hint = "") {
  return h("div", { class: "empty" }, h("p", {}, text), hint && h("p", { class: "hint" }, hint));
}
