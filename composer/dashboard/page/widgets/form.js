/**
 * A form made from the fields of an interface type.
 *
 * `value()` returns the message, or null after the browser has shown what is invalid.
 */
import { button, h, newId, setText } from "../dom.js";
import { icon } from "../icons.js";

const MOST_ITEMS = 500;
const LIMITS = {
  int8: [-128, 127],
  uint8: [0, 255],
  int16: [-32_768, 32_767],
  uint16: [0, 65_535],
  int32: [-2_147_483_648, 2_147_483_647],
  uint32: [0, 4_294_967_295],
};

export function createForm(fields, { label, submit, extras = [] }) {
  const parts = fields.map((field) => [field.name, editorOf(field)]);
  const form = h(
    "form",
    { class: "fields", "aria-label": label, novalidate: true, autocomplete: "off" },
    parts.length > 0
      ? parts.map(([, part]) => part.element)
      : h("p", { class: "hint" }, "This type has no fields."),
    h("div", { class: "actions" }, extras, submit),
  );
  return {
    element: form,
    value() {
      return form.reportValidity() ? objectOf(parts) : null;
    },
    set(message) {
      setAll(parts, message);
    },
  };
}

function objectOf(parts) {
  return Object.fromEntries(parts.map(([name, part]) => [name, part.value()]));
}

function setAll(parts, message) {
  for (const [name, part] of parts) {
    if (message && name in message) part.set(message[name]);
  }
}

const EDITORS = {
  message: groupEditor,
  array: arrayEditor,
  boolean: booleanEditor,
  integer: numberEditor,
  number: numberEditor,
  time: timeEditor,
  bytes: bytesEditor,
  string: stringEditor,
};

function editorOf(field) {
  return (EDITORS[field.kind] ?? stringEditor)(field);
}

function groupEditor(field) {
  const parts = field.fields.map((inner) => [inner.name, editorOf(inner)]);
  const element = h(
    "fieldset",
    { class: "group-field" },
    h("legend", {}, nameOf(field), " ", h("span", { class: "type" }, field.type)),
    parts.map(([, part]) => part.element),
  );
  return { element, value: () => objectOf(parts), set: (message) => setAll(parts, message) };
}

function arrayEditor(field) {
  const isFixed = Number.isInteger(field.size);
  const limit = field.size ?? field.max_items ?? MOST_ITEMS;
  const items = h("div", { class: "items" });
  let editors = [];
  const add = button("Add item", () => append(), { class: "quiet" });

  function append(value) {
    const editor = editorOf({ ...field.element, name: "" });
    if (value !== undefined) editor.set(value);
    editor.remove = button(icon("close"), () => remove(editor), { class: "quiet" });
    editor.line = h("div", { class: "item" }, editor.element, isFixed ? null : editor.remove);
    editors.push(editor);
    items.append(editor.line);
    update();
  }

  function drop(editor) {
    editor.line.remove();
    editors = editors.filter((one) => one !== editor);
    update();
  }

  function remove(editor) {
    drop(editor);
    add.focus(); // the button that had it is gone
  }

  function update() {
    add.hidden = isFixed || editors.length >= limit;
    for (const [index, { line: item, remove: pressed }] of editors.entries()) {
      // The first name is that of the item, the others are those of its fields.
      setText(item.querySelector(".field-name"), `[${index}]`);
      pressed.setAttribute("aria-label", `Remove [${index}] of ${field.name}`);
    }
  }

  function set(values) {
    for (const editor of [...editors]) drop(editor);
    for (const value of values.slice(0, limit)) append(value);
  }

  const first = Array.isArray(field.default) ? field.default : [];
  set(first);
  while (isFixed && editors.length < field.size) append();
  const bound = isFixed ? `${field.size} items` : field.max_items ? `at most ${field.max_items} items` : "list";
  const element = h(
    "fieldset",
    { class: "group-field" },
    h("legend", {}, nameOf(field), " ", h("span", { class: "type" }, `${field.element.type ?? ""} · ${bound}`)),
    items,
    add,
  );
  return { element, value: () => editors.map((editor) => editor.value()), set };
}

function booleanEditor(field) {
  const input = h("input", { type: "checkbox", checked: Boolean(field.default), id: newId("field") });
  return {
    element: line(field, input),
    value: () => input.checked,
    set: (value) => (input.checked = Boolean(value)),
  };
}

function numberEditor(field) {
  const [least, most] = LIMITS[field.type] ?? [null, null];
  const minimum = field.minimum ?? least;
  const maximum = field.maximum ?? most;
  const isLong = field.kind === "integer" && least === null;
  const input = h("input", {
    type: isLong ? "text" : "number",
    inputmode: "decimal",
    pattern: isLong ? "-?[0-9]+" : null,
    step: field.kind === "integer" ? "1" : "any",
    min: minimum,
    max: maximum,
    required: true,
    value: String(field.default ?? 0),
    id: newId("field"),
  });
  return {
    element: line(field, input, rangeOf(field)),
    // 64-bit integers stay text: a number of JavaScript would round them.
    value: () => (isLong && !Number.isSafeInteger(Number(input.value)) ? input.value : Number(input.value)),
    set: (value) => (input.value = String(value)),
  };
}

function timeEditor(field) {
  const input = h("input", { type: "number", step: "any", value: "0", required: true, id: newId("field") });
  const seconds = ({ sec = 0, nanosec = 0 }) => sec + nanosec * 1e-9;
  return {
    element: line(field, input, "s"),
    value: () => Number(input.value),
    set: (value) => (input.value = String(typeof value === "object" ? seconds(value) : value)),
  };
}

function bytesEditor(field) {
  const input = h("input", {
    type: "text",
    pattern: "\\s*([0-9]+\\s*,?\\s*)*",
    value: (Array.isArray(field.default) ? field.default : []).join(", "),
    id: newId("field"),
  });
  return {
    element: line(field, input, "numbers 0 … 255"),
    value: () => input.value.split(/[\s,]+/).filter(Boolean).map(Number),
    set: (values) => (input.value = [...values].join(", ")),
  };
}

function stringEditor(field) {
  const input = h("input", {
    type: "text",
    maxlength: field.max_length,
    value: field.default ?? "",
    id: newId("field"),
    spellcheck: "false",
  });
  return { element: line(field, input), value: () => input.value, set: (value) => (input.value = String(value)) };
}

function nameOf({ name }) {
  return h("span", { class: "field-name" }, name);
}

function line(field, input, range = "") {
  const constants = (field.constants ?? []).map(({ name, value }) => `${name} = ${value}`);
  const notes = [field.comment, constants.join(", ")].filter(Boolean).join(" · ");
  const noteId = newId("note");
  if (notes || range) input.setAttribute("aria-describedby", noteId);
  return h(
    "div",
    { class: "field-line" },
    h("label", { for: input.id }, nameOf(field), " ", h("span", { class: "type" }, field.type)),
    input,
    (notes || range) && h("p", { class: "hint", id: noteId }, [range, notes].filter(Boolean).join(" · ")),
  );
}

/** Write a declared range: "0.1 … 2", "at most 5". */
export function rangeOf({ minimum = null, maximum = null, unit = "" }) {
  const end = unit ? ` ${unit}` : "";
  if (minimum !== null && maximum !== null) return `${minimum} … ${maximum}${end}`;
  if (minimum !== null) return `at least ${minimum}${end}`;
  if (maximum !== null) return `at most ${maximum}${end}`;
  return unit;
}
