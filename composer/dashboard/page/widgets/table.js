/**
 * A table whose rows keep their elements when the data changes, so that nothing flickers.
 *
 * A column is {id, label, text(row), value(row), render(row), number, level}: `text` or `render` (a node)
 * fills a cell, `value` sorts, a `number` is aligned to the right, and `level` 2 to 4 are left out on
 * narrow screens. The first column is the link that `hrefOf` returns.
 */
import { button, empty, h, setText } from "../dom.js";

const SORTS = { ascending: 1, descending: -1 };

export function createTable({ label, columns, keyOf, hrefOf, sortBy = null, nothing }) {
  const head = h("tr", {}, columns.map(headerCell));
  const body = h("tbody");
  const table = h("table", { class: "data", "aria-label": label }, h("thead", {}, head), body);
  const message = h("div", {}, empty("Loading …"));
  const element = h("div", { class: "scroll", tabindex: "-1" }, table, message);
  const known = new Map();
  let rows = null;
  let sort = { id: sortBy, direction: firstDirection(columns.find(({ id }) => id === sortBy)) };
  let selected = "";

  function headerCell(column) {
    const cell = h("th", { scope: "col", class: classOf(column), data: { id: column.id } });
    cell.append(
      button(column.label, () => {
        const isSame = sort.id === column.id;
        const first = firstDirection(column);
        const other = first === "ascending" ? "descending" : "ascending";
        sort = { id: column.id, direction: isSame && sort.direction === first ? other : first };
        show();
      }),
    );
    return cell;
  }

  function rowOf(row) {
    const key = keyOf(row);
    let found = known.get(key);
    if (!found) {
      const cells = columns.map((column, index) => {
        const cell = h(index === 0 ? "th" : "td", { class: classOf(column) });
        if (index > 0) return { cell, content: cell };
        cell.scope = "row";
        const link = h(hrefOf ? "a" : "span", { href: hrefOf?.(row) });
        cell.append(link);
        return { cell, content: link };
      });
      const line = h("tr", { data: { key } }, cells.map(({ cell }) => cell));
      if (hrefOf) line.addEventListener("click", (event) => follow(event, cells[0].content));
      found = { line, cells, texts: [] };
      known.set(key, found);
    }
    fill(found, row);
    found.line.classList.toggle("selected", key === selected);
    if (key === selected) found.cells[0].content.setAttribute("aria-current", "true");
    else found.cells[0].content.removeAttribute("aria-current");
    return found.line;
  }

  function fill(found, row) {
    columns.forEach((column, index) => {
      const { content } = found.cells[index];
      const text = column.text ? column.text(row) : JSON.stringify(column.value(row));
      if (found.texts[index] === text) return;
      found.texts[index] = text;
      if (column.render) content.replaceChildren(column.render(row));
      else setText(content, text);
      if (column.tone) found.cells[index].cell.dataset.tone = column.tone(row) ?? "";
    });
  }

  function sorted() {
    const column = columns.find(({ id }) => id === sort.id);
    if (!column) return rows;
    const value = column.value ?? column.text;
    return [...rows].sort((one, other) => compare(value(one), value(other), SORTS[sort.direction]));
  }

  function show() {
    for (const cell of head.children) {
      if (cell.dataset.id === sort.id) cell.setAttribute("aria-sort", sort.direction);
      else cell.removeAttribute("aria-sort");
    }
    if (rows === null) return;
    const lines = sorted().map(rowOf);
    const keys = new Set(rows.map(keyOf));
    for (const key of known.keys()) if (!keys.has(key)) known.delete(key);
    if (lines.length !== body.children.length || lines.some((line, i) => line !== body.children[i])) {
      body.replaceChildren(...lines);
    }
    table.hidden = rows.length === 0;
    message.replaceChildren(...(rows.length === 0 ? [empty(...[nothing()].flat())] : []));
  }

  table.addEventListener("keydown", (event) => {
    const line = event.target.closest("tbody tr");
    const step = { ArrowDown: "nextElementSibling", ArrowUp: "previousElementSibling" }[event.key];
    const link = line?.[step]?.querySelector("th a");
    if (!link || event.target.tagName !== "A") return;
    link.focus();
    event.preventDefault();
  });

  table.hidden = true;
  show();
  return {
    element,
    update(newRows) {
      rows = newRows;
      show();
    },
    fail(text) {
      rows = null;
      table.hidden = true;
      message.replaceChildren(empty(text));
    },
    select(key) {
      selected = key;
      show();
    },
    /** The keys of the rows on the screen, for what is measured only while it is seen. */
    seen() {
      const frame = element.getBoundingClientRect();
      return [...body.children]
        .filter((line) => {
          const place = line.getBoundingClientRect();
          return place.height > 0 && place.bottom > frame.top && place.top < frame.bottom;
        })
        .map((line) => line.dataset.key);
    },
  };
}

/** Numbers are most interesting where they are large. */
function firstDirection(column) {
  return column?.number ? "descending" : "ascending";
}

function classOf({ number, level = 1 }) {
  return `${number ? "number " : ""}level-${level}`;
}

function follow(event, link) {
  if (event.target.closest("a, button, input, select")) return;
  if (getSelection()?.toString()) return;
  link.click();
}

/** What is missing comes last in both directions. */
function compare(one, other, sign) {
  const isMissing = (value) => value === null || value === undefined || Number.isNaN(value);
  if (isMissing(one) || isMissing(other)) return Number(isMissing(one)) - Number(isMissing(other));
  if (typeof one === "number") return sign * (one - other);
  return sign * String(one).localeCompare(String(other), "en", { numeric: true });
}
