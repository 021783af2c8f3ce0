/** Small parts that several views share. */
import { button, h, s } from "../dom.js";
import { icon, kindOfState, labelOfState, stateShape } from "../icons.js";

/** A lifecycle state, by shape, color and text. */
export function stateBadge(state) {
  const shape = s("svg", { viewBox: "0 0 12 12", "aria-hidden": "true" }, stateShape(state));
  return h("span", { class: "state", data: { state: kindOfState(state) } }, shape, labelOfState(state));
}

/** A list with details next to it; on a narrow screen one of them at a time. */
export function split({ toolbar, list, detail }) {
  return h("div", { class: "split" }, h("div", { class: "list" }, toolbar, list), detail);
}

/** The head of details: back to the list, a title that can be copied, and what belongs next to it. */
export function detailHead(title, backTo, ...extras) {
  return h(
    "header",
    { class: "detail-head" },
    h("a", { class: "back", href: backTo, "aria-label": "Back to the list" }, icon("back")),
    h("h2", {}, title),
    extras,
  );
}

/** Pairs of words and values; values are texts or elements. Null values are left out. */
export function facts(pairs) {
  const shown = pairs.filter(([, value]) => value !== null && value !== undefined && value !== "");
  return h("dl", { class: "facts" }, shown.map(([word, value]) => [h("dt", {}, word), h("dd", {}, value)]));
}

export function section(title, ...content) {
  return h("section", { class: "block" }, h("h3", {}, title), content);
}

/** Tabs as links: each has an address. */
export function tabs(label, entries, current) {
  const link = ([id, text, href]) =>
    h("a", { href, "aria-current": id === current ? "page" : null }, text);
  return h("nav", { class: "tabs", "aria-label": label }, entries.map(link));
}

export function searchField(label, oninput, value = "") {
  return h("input", {
    type: "search",
    class: "search-field",
    placeholder: label,
    "aria-label": label,
    autocomplete: "off",
    spellcheck: "false",
    value,
    oninput: (event) => oninput(event.target.value),
  });
}

/** A button that is on or off. */
export function toggle(label, isOn, onchange, attributes = {}) {
  const pressed = button(
    label,
    () => {
      const next = pressed.getAttribute("aria-pressed") !== "true";
      pressed.setAttribute("aria-pressed", String(next));
      onchange(next);
    },
    { "aria-pressed": String(isOn), ...attributes },
  );
  return pressed;
}

/** Return whether a text contains every word of what is searched for. */
export function matches(text, searched) {
  const lower = text.toLowerCase();
  return searched.toLowerCase().split(/\s+/).every((word) => lower.includes(word));
}

/** "3 messages were not shown": what the server dropped for this page. */
export function dropNote() {
  const note = h("span", { class: "drops", hidden: true });
  return {
    element: note,
    show(dropped, why = "this page or the network was too slow") {
      note.hidden = !dropped;
      if (!dropped) return;
      note.textContent = `${dropped.toLocaleString("en-US")} not shown`;
      note.title = `${dropped} messages were not sent: ${why}`;
    },
  };
}
