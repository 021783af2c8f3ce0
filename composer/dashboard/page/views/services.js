/** Services and actions: a form made from the type, the response, and goals with their feedback. */
import { button, empty, h } from "../dom.js";
import { milliseconds } from "../format.js";
import { pathOf } from "../router.js";
import { createForm } from "../widgets/form.js";
import { createMessageTree } from "../widgets/message.js";
import { attempt } from "../widgets/notices.js";
import { detailHead, matches, searchField, section, split, toggle } from "../widgets/parts.js";
import { createTable } from "../widgets/table.js";
import { createGoal } from "./goal.js";

const TIMEOUT_S = 5;
const LONGEST_S = 55;
const COLUMNS = [
  { id: "name", label: "Name", text: ({ name }) => name },
  { id: "kind", label: "Kind", level: 2, text: ({ kind }) => kind },
  { id: "type", label: "Type", level: 2, text: ({ types }) => types.join(", ") },
  { id: "servers", label: "Server", level: 3, text: ({ servers }) => servers.join(", ") || "none", tone: ({ servers }) => (servers.length === 0 ? "warn" : "") },
];

export function createView(app) {
  const table = createTable({
    label: "Services and actions",
    columns: COLUMNS,
    keyOf: ({ kind, name }) => `${kind} ${name}`,
    hrefOf: ({ kind, name }) => pathOf(`${kind}s`, name),
    sortBy: "name",
    nothing: () => (searched ? "None matches." : ["There are no services or actions.", "Those of parameters, lifecycles and managers are hidden."]),
  });
  const detail = h("aside", { class: "detail", "aria-label": "Call", hidden: true });
  const body = split({
    toolbar: h(
      "div",
      { class: "toolbar" },
      searchField("Search services and actions ( / )", (text) => { searched = text; update(); }),
      toggle("Show hidden", false, (on) => { withHidden = on; request(); }, { title: "Show services of parameters, lifecycles, managers and tools" }),
    ),
    list: table.element,
    detail,
  });
  const element = h("div", { class: "view" }, h("div", { class: "view-head" }, h("h2", { class: "view-title" }, "Services and actions")), body);

  let entries = null;
  let searched = "";
  let withHidden = false;
  let chosen = "";
  let shown = "";
  let subscription = null;
  let requested = "";
  /** Goals go on while other views are shown. */
  const goals = new Map();

  /** Subscribe to the list, in which the chosen one is even if it is hidden. */
  function request() {
    const params = { hidden: withHidden, chosen: nameOf(chosen) };
    const now = JSON.stringify(params);
    if (!subscription) subscription = app.connection.subscribe("services", params, receive, { onerror: (error) => table.fail(error.message) });
    else if (now !== requested) subscription.update(params);
    requested = now;
  }

  function receive({ services, actions }) {
    entries = [
      ...services.map((one) => ({ ...one, kind: "service" })),
      ...actions.map((one) => ({ ...one, kind: "action" })),
    ];
    update();
    showDetail();
  }

  function update() {
    if (entries) table.update(entries.filter(({ name, types }) => matches(`${name} ${types.join(" ")}`, searched)));
  }

  function showDetail() {
    detail.hidden = chosen === "";
    body.classList.toggle("open", chosen !== "");
    table.select(chosen);
    const entry = entries?.find(({ kind, name }) => `${kind} ${name}` === chosen);
    const now = `${chosen} ${Boolean(entries)} ${Boolean(entry)} ${app.isReadOnly()}`;
    if (now === shown || chosen === "") return;
    shown = now;
    const name = nameOf(chosen);
    if (!entry) {
      detail.replaceChildren(detailHead(name, "/services"), empty(entries ? `There is no ${chosen}.` : "Loading …"));
      return;
    }
    const content = h("div", {}, empty("Loading the type …"));
    detail.replaceChildren(
      detailHead(name, "/services"),
      h("p", { class: "type" }, entry.types.join(", ")),
      h("p", { class: "links" }, entry.servers.map((node) => h("a", { href: pathOf("nodes", node) }, node))),
      content,
    );
    if (app.isReadOnly()) content.replaceChildren(empty("The dashboard is read-only."));
    else load(entry, content);
  }

  async function load(entry, content) {
    const [type] = entry.types;
    try {
      const { parts } = await app.connection.request("form", { type });
      const part = entry.kind === "service" ? servicePart(entry, type, parts.request) : actionPart(entry, type, parts.goal);
      content.replaceChildren(...part);
    } catch (error) {
      content.replaceChildren(empty("There is no form for this type.", error.message));
    }
  }

  function servicePart(entry, type, fields) {
    const timeout = h("input", { type: "number", min: "0.1", max: String(LONGEST_S), step: "any", value: String(TIMEOUT_S), class: "narrow", "aria-label": "Timeout in s" });
    const response = h("div", { role: "status", "aria-live": "polite" });
    const call = button("Call", () => attempt(call, run), { class: "primary", type: "submit" });
    const form = createForm(fields, { label: `Request for ${entry.name}`, submit: call, extras: [h("span", { class: "muted" }, "Timeout"), timeout, "s"] });
    form.element.addEventListener("submit", (event) => event.preventDefault());

    async function run() {
      const request = form.value();
      if (!request || !timeout.reportValidity()) return;
      response.replaceChildren(h("p", { class: "hint" }, "Waiting for the response …"));
      try {
        const found = await app.connection.request("call", { service: entry.name, type, request, timeout_s: Number(timeout.value) });
        const tree = createMessageTree();
        tree.show(found.response);
        response.replaceChildren(section(`Response after ${milliseconds(found.took_s * 1000)}`, tree.element));
      } catch (error) {
        response.replaceChildren(h("p", { class: "problem" }, error.message, error.hint && ` (${error.hint})`));
      }
    }
    return [form.element, response];
  }

  function actionPart(entry, type, fields) {
    const list = goals.get(entry.name) ?? h("div", { class: "goals" });
    goals.set(entry.name, list);
    const send = button("Send goal", () => attempt(send, async () => {
      const goal = form.value();
      if (goal) list.prepend(createGoal(app, { action: entry.name, type, goal }));
    }), { class: "primary", type: "submit" });
    const form = createForm(fields, { label: `Goal for ${entry.name}`, submit: send });
    form.element.addEventListener("submit", (event) => event.preventDefault());
    return [form.element, list];
  }

  function show(route) {
    chosen = route.name ? `${route.view === "actions" ? "action" : "service"} ${route.name}` : "";
    request();
    showDetail();
  }

  function hide() {
    subscription?.end();
    subscription = null;
  }

  return { element, show, hide };
}

/** "service /plan_trajectory" -> "/plan_trajectory". */
function nameOf(chosen) {
  return chosen.slice(chosen.indexOf(" ") + 1);
}
