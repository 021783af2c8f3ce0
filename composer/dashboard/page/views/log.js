/** The log: /rosout, filtered by the server, the newest at the bottom. */
import { button, empty, h } from "../dom.js";
import { timeOfDay } from "../format.js";
import { pathOf } from "../router.js";
import { dropNote, searchField, toggle } from "../widgets/parts.js";

const LEVELS = ["debug", "info", "warn", "error", "fatal"];
const MOST_LINES = 2000;
const HISTORY = 500;
const TYPING_MS = 250;
const NEAR_END = 40;

export function createView(app) {
  const level = h("select", { "aria-label": "Lowest level", onchange: () => filter("level", level.value) },
    LEVELS.map((name) => h("option", { value: name }, name === "fatal" ? "fatal" : `${name} and above`)));
  const node = searchField("Node", (text) => typed("node", text));
  const text = searchField("Search texts ( / )", (words) => typed("text", words));
  const pause = toggle("Pause", false, (on) => (on ? null : flush()));
  const count = h("span", { class: "muted" });
  const drops = dropNote();
  const list = h("ol", { class: "log", tabindex: "0", "aria-label": "Log lines" });
  const message = h("div", {}, empty("Loading …"));
  const toEnd = button("Jump to the newest", () => (list.scrollTop = list.scrollHeight), { class: "to-end", hidden: true });
  const element = h(
    "div",
    { class: "view" },
    h(
      "div",
      { class: "view-head" },
      h("h2", { class: "view-title" }, "Log"),
      h("div", { class: "toolbar" }, text, node, level, pause, button("Clear", clear), count, drops.element),
    ),
    h("div", { class: "log-frame" }, list, message, toEnd),
  );

  let subscription = null;
  let params = null;
  const received = new Set();
  let waiting = [];
  let isNew = true;
  let typing = 0;

  function receive({ lines }, { dropped }) {
    drops.show(dropped);
    waiting.push(...lines.filter(isUnknown));
    if (waiting.length > MOST_LINES) waiting = waiting.slice(-MOST_LINES);
    // New filters also apply while paused: they search in what is there.
    if (pause.getAttribute("aria-pressed") === "true" && !isNew) showCount();
    else flush();
    isNew = false;
  }

  /** After a lost connection, the last lines arrive again. */
  function isUnknown(line) {
    const record = JSON.stringify(line);
    if (received.has(record)) return false;
    received.add(record);
    if (received.size > MOST_LINES) received.delete(received.values().next().value);
    return true;
  }

  function flush() {
    const isAtEnd = list.scrollHeight - list.scrollTop - list.clientHeight < NEAR_END;
    list.append(...waiting.map(lineOf));
    waiting = [];
    while (list.children.length > MOST_LINES) list.firstElementChild.remove();
    message.hidden = list.children.length > 0;
    if (!message.hidden) message.replaceChildren(empty("No log lines.", isFiltered() ? "None matches the filters." : "Lines from now on appear here."));
    if (isAtEnd) list.scrollTop = list.scrollHeight;
    showCount();
  }

  function showCount() {
    count.textContent = waiting.length > 0 ? `${waiting.length} more while paused` : `${list.children.length} lines`;
  }

  function lineOf(line) {
    const place = line.file ? `${line.file}:${line.line}${line.function ? ` in ${line.function}` : ""}` : "";
    return h(
      "li",
      { data: { level: line.level }, title: place },
      h("time", {}, timeOfDay(line.at_s)),
      h("span", { class: "level" }, line.level),
      h("a", { class: "source", href: pathOf("nodes", line.node) }, line.node),
      h("span", { class: "text" }, line.text),
    );
  }

  function isFiltered() {
    return params.node !== "" || params.text !== "" || params.level !== "debug";
  }

  function typed(name, value) {
    clearTimeout(typing);
    typing = setTimeout(() => filter(name, value.trim()), TYPING_MS);
  }

  /** The filters are in the address. */
  function filter(name, value) {
    const { history: _, ...now } = { ...params, [name]: value };
    app.go(pathOf("log", "", { ...now, level: now.level === "info" ? "" : now.level }), { replace: true });
  }

  function clear() {
    waiting = [];
    list.replaceChildren();
    flush();
  }

  function show({ query }) {
    const wanted = { level: query.get("level") ?? "info", node: query.get("node") ?? "", text: query.get("text") ?? "", history: HISTORY };
    const isSame = JSON.stringify(wanted) === JSON.stringify(params);
    params = wanted;
    level.value = wanted.level;
    if (document.activeElement !== node) node.value = wanted.node;
    if (document.activeElement !== text) text.value = wanted.text;
    if (isSame && subscription) return;
    isNew = true;
    waiting = [];
    received.clear();
    list.replaceChildren();
    const before = subscription;
    subscription = app.connection.subscribe("log", params, receive, {
      onerror(error) {
        message.hidden = false;
        message.replaceChildren(empty("The log cannot be shown.", error.message));
      },
    });
    before?.end(); // only now: without a subscription, the server forgets the lines
  }

  function hide() {
    clearTimeout(typing);
    pause.setAttribute("aria-pressed", "false");
    subscription?.end();
    subscription = null;
  }

  list.addEventListener("scroll", () => {
    toEnd.hidden = list.scrollHeight - list.scrollTop - list.clientHeight < NEAR_END;
  });
  return { element, show, hide };
}
