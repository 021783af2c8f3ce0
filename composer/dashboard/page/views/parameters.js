/** The parameters of a node: edit them, and read why a value was refused. */
import { breakable, button, empty, h, setText } from "../dom.js";
import { pathOf } from "../router.js";
import { rangeOf } from "../widgets/form.js";
import { dropNote, detailHead, matches, searchField, split, stateBadge } from "../widgets/parts.js";
import { createTable } from "../widgets/table.js";

const LISTS = /_array$/;

export function createView(app) {
  const table = createTable({
    label: "Nodes",
    columns: [
      { id: "name", label: "Node", text: (node) => node.name },
      { id: "state", label: "State", text: (node) => String(node.state), render: (node) => stateBadge(node.state) },
    ],
    keyOf: (node) => node.name,
    hrefOf: (node) => pathOf("parameters", node.name),
    sortBy: "name",
    nothing: () => (searchedNode ? "No node matches." : "There are no nodes."),
  });
  const detail = h("aside", { class: "detail wide", "aria-label": "Parameters", hidden: true });
  const body = split({
    toolbar: h("div", { class: "toolbar" }, searchField("Search nodes ( / )", (text) => { searchedNode = text; update(); })),
    list: table.element,
    detail,
  });
  const element = h("div", { class: "view" }, h("div", { class: "view-head" }, h("h2", { class: "view-title" }, "Parameters")), body);
  const note = dropNote();

  let searchedNode = "";
  let searched = "";
  let name = null;
  let lines = new Map();
  let subscription = null;
  let list = null;

  function update() {
    if (app.nodes) table.update(app.nodes.nodes.filter((node) => matches(node.name, searchedNode)));
  }

  function receive({ node, parameters }) {
    if (node !== name) return;
    const known = new Set(parameters.map((parameter) => parameter.name));
    for (const [key, line] of lines) {
      if (known.has(key)) continue;
      line.element.remove();
      lines.delete(key);
    }
    if (parameters.length === 0) list.replaceChildren(empty(`${node} has no parameters.`));
    else if (lines.size === 0) list.replaceChildren();
    for (const parameter of parameters) {
      const line = lines.get(parameter.name) ?? createLine(app, name, parameter);
      if (!lines.has(parameter.name)) {
        lines.set(parameter.name, line);
        list.append(line.element);
      }
      line.update(parameter);
    }
    filter();
  }

  function filter() {
    for (const [key, line] of lines) line.element.hidden = !matches(`${key} ${line.words()}`, searched);
  }

  function show(route) {
    addEventListener("nodeschange", update);
    update();
    if (route.name === name && subscription) return;
    subscription?.end();
    subscription = null;
    name = route.name;
    detail.hidden = name === "";
    body.classList.toggle("open", name !== "");
    table.select(name);
    if (name === "") return;
    lines = new Map();
    list = h("div", { class: "parameters" }, empty("Loading …"));
    detail.replaceChildren(
      detailHead(name, "/parameters"),
      h("p", { class: "links" }, h("a", { href: pathOf("nodes", name) }, "Control and timing")),
      h("div", { class: "toolbar" }, searchField("Search parameters", (text) => { searched = text; filter(); }, searched), note.element),
      list,
    );
    subscription = app.connection.subscribe("parameters", { node: name }, receive, {
      onerror: (error) => lines.size === 0 && list.replaceChildren(empty("The parameters cannot be read.", error.message)),
    });
  }

  function hide() {
    removeEventListener("nodeschange", update);
    subscription?.end();
    subscription = null;
  }

  return { element, show, hide };
}

/** A parameter: what is typed is kept when the value changes elsewhere, until it is set or undone. */
function createLine(app, node, first) {
  let parameter = first;
  let isEdited = false;
  const isFixed = first.read_only || app.isReadOnly();
  const editor = createEditor(first, isFixed, edited);
  const set = button("Set", apply, { class: "primary", type: "submit", hidden: true });
  const undo = button("Undo", () => reset(), { class: "quiet", hidden: true });
  const message = h("p", { class: "outcome", role: "status" });
  const hint = h("p", { class: "hint" });
  const declared = h("p", { class: "declared" });
  const element = h(
    "form",
    { class: "parameter", data: { name: first.name }, novalidate: true, autocomplete: "off" },
    h("label", { for: editor.input.id }, breakable(first.name), " ", h("span", { class: "type" }, first.type)),
    h("div", { class: "value" }, editor.element, first.unit && h("span", { class: "unit" }, first.unit), set, undo),
    hint,
    declared,
    message,
  );
  element.addEventListener("submit", (event) => {
    event.preventDefault();
    if (isEdited) apply();
  });
  element.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && isEdited) reset();
  });

  function edited(isImmediate) {
    isEdited = true;
    set.hidden = undo.hidden = false;
    show("", "");
    if (isImmediate) apply();
  }

  function reset() {
    isEdited = false;
    set.hidden = undo.hidden = true;
    editor.set(parameter.value);
    show("", "");
  }

  function show(text, tone) {
    setText(message, text);
    message.dataset.tone = tone;
    editor.input.setAttribute("aria-invalid", String(tone === "bad"));
  }

  async function apply() {
    let value;
    try {
      value = editor.value();
    } catch (error) {
      show(error.message, "bad");
      return;
    }
    set.disabled = true;
    try {
      const found = await app.connection.request("set_parameter", { node, name: parameter.name, value });
      parameter = { ...parameter, value: found.value };
      reset();
      show("Set", "good");
    } catch (error) {
      show([error.message, error.hint].filter(Boolean).join(": "), "bad");
    } finally {
      set.disabled = false;
    }
  }

  return {
    element,
    words: () => `${parameter.description ?? ""} ${parameter.unit ?? ""}`,
    update(now) {
      parameter = now;
      if (!isEdited) editor.set(now.value);
      const range = rangeOf(now);
      setText(hint, [range !== now.unit ? range : "", now.step ? `steps of ${now.step}` : "", now.read_only ? "read-only" : "", now.description?.replace(` [${now.unit}]`, ""), now.constraints].filter(Boolean).join(" · "));
      const differs = now.declared !== null && now.declared !== undefined && JSON.stringify(now.declared) !== JSON.stringify(now.value);
      setText(declared, differs ? `declared ${textOf(now.declared)}${now.declared_at ? ` at ${now.declared_at}` : ""}` : "");
    },
  };
}

let lastId = 0;

/** Return {element, input, value, set}. `value` raises an Error that says what is wrong. */
function createEditor(parameter, isFixed, edited) {
  lastId += 1;
  const id = `parameter-${lastId}`;
  if (parameter.type === "bool") {
    const input = h("input", { type: "checkbox", id, disabled: isFixed, onchange: () => edited(true) });
    return { element: input, input, value: () => input.checked, set: (value) => (input.checked = value) };
  }
  if (parameter.choices && !LISTS.test(parameter.type)) return choiceEditor(parameter.choices, id, isFixed, edited);
  const input = h("input", { type: "text", id, disabled: isFixed, spellcheck: "false", oninput: () => edited(false) });
  const isNumber = parameter.type === "double" || parameter.type === "integer";
  if (isNumber) input.inputMode = "decimal";
  const value = () => parsed(parameter.type, input.value);
  const set = (now) => (input.value = textOf(now));
  const slider = isNumber && sliderOf(parameter, isFixed, (now) => {
    set(now);
    edited(false);
  }, edited);
  if (!slider) return { element: input, input, value, set };
  input.addEventListener("input", () => (slider.value = input.value));
  return {
    element: h("span", { class: "ranged" }, input, slider),
    input,
    value,
    set(now) {
      set(now);
      slider.value = String(now);
    },
  };
}

/** A list of the declared choices, and of the value if it is none of them. */
function choiceEditor(choices, id, isFixed, edited) {
  const values = new Map();
  const input = h("select", { id, disabled: isFixed, onchange: () => edited(true) });
  function add(value) {
    const text = textOf(value);
    values.set(text, value);
    input.append(h("option", { value: text }, text));
  }
  choices.forEach(add);
  return {
    element: input,
    input,
    value: () => values.get(input.value),
    set(now) {
      if (!values.has(textOf(now))) add(now);
      input.value = textOf(now);
    },
  };
}

function sliderOf({ name, type, minimum, maximum, step }, isFixed, onmove, edited) {
  if (typeof minimum !== "number" || typeof maximum !== "number") return null;
  const slider = h("input", {
    type: "range",
    min: minimum,
    max: maximum,
    step: step || (type === "integer" ? 1 : "any"),
    disabled: isFixed,
    "aria-label": `${name}, as a slider`,
    oninput: () => onmove(rounded(Number(slider.value))),
    onchange: () => edited(true),
  });
  return slider;
}

/** A slider has fewer positions than digits. */
function rounded(value) {
  return Number(value.toPrecision(3));
}

/** The type is checked here, the range by the node: it says why it refuses a value. */
function parsed(type, text) {
  if (type === "string") return text;
  if (type === "double" || type === "integer") return numberOf(type, text.trim());
  if (!LISTS.test(type)) return text;
  let found;
  try {
    found = JSON.parse(text.trim() || "[]");
  } catch {
    found = null;
  }
  if (!Array.isArray(found)) throw new Error(`a list is expected, such as ${type === "string_array" ? '["a", "b"]' : "[1, 2]"}`);
  return found;
}

function numberOf(type, text) {
  const isRight = type === "integer" ? /^[+-]?\d+$/ : /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;
  if (/^[+-]?\.(nan|inf)$/i.test(text) && type === "double") return text;
  if (!isRight.test(text)) throw new Error(type === "integer" ? "a whole number is expected" : "a number is expected");
  const found = Number(text);
  return type === "integer" && !Number.isSafeInteger(found) ? text : found;
}

/** Every digit: what is edited must be the value. */
function textOf(value) {
  if (value === null || value === undefined) return "";
  return typeof value === "object" ? JSON.stringify(value) : String(value);
}
