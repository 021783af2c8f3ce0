/** The nodes: states, figures, transitions; the plan, and the drift against the declaration. */
import { h } from "../dom.js";
import { count, duration, hertz, percent, usage } from "../format.js";
import { pathOf } from "../router.js";
import { searchField, matches, split, stateBadge, tabs } from "../widgets/parts.js";
import { createTable } from "../widgets/table.js";
import { createNodeDetail } from "./node_detail.js";
import { createPlan } from "./plan.js";

const COLUMNS = [
  { id: "name", label: "Node", text: (node) => node.name },
  {
    id: "state",
    label: "State",
    text: (node) => `${node.state}${change(node)}`,
    render: (node) => h("span", {}, stateBadge(node.state), wanted(node)),
  },
  { id: "since", label: "Since", number: true, level: 2, value: (node) => -(node.since_s ?? 0), text: since },
  { id: "sent", label: "Sent", number: true, level: 2, value: (node) => node.sent_hz, text: (node) => hertz(node.sent_hz) },
  { id: "received", label: "Received", number: true, level: 2, value: (node) => node.received_hz, text: (node) => hertz(node.received_hz) },
  { id: "busy", label: "Busy", number: true, level: 2, value: (node) => node.busy, text: (node) => percent(node.busy) },
  { id: "cpu", label: "CPU of process", number: true, level: 3, value: (node) => node.usage?.cpu_percent ?? null, text: (node) => usage(node.usage ?? {})[0] },
  { id: "memory", label: "Memory of process", number: true, level: 3, value: (node) => node.usage?.memory_mb ?? null, text: (node) => usage(node.usage ?? {})[1] },
  { id: "dropped", label: "Dropped", number: true, level: 3, value: (node) => node.queue_drops, text: (node) => count(node.queue_drops), tone: (node) => (node.queue_drops > 0 ? "warn" : "") },
  { id: "errors", label: "Errors", number: true, value: (node) => node.errors, text: (node) => count(node.errors), tone: (node) => (node.errors > 0 ? "bad" : "") },
  { id: "restarts", label: "Restarts", number: true, level: 3, value: (node) => node.restarts, text: (node) => count(node.restarts), tone: (node) => (node.restarts > 0 ? "warn" : "") },
  { id: "slowest", label: "Slowest callback", level: 4, text: (node) => node.slowest ?? "" },
];

/** Return what becomes of a node, or the state that it should have, in words; empty if it is as it should be. */
function change(node) {
  if (node.condition) return ` ${node.condition}`;
  return node.desired && node.desired !== node.state ? ` → ${node.desired}` : "";
}

function wanted(node) {
  return change(node) && h("span", { class: "desired" }, change(node));
}

function since(node) {
  return node.since_s ? duration(Date.now() / 1000 - node.since_s) : "–";
}

export function createView(app) {
  let searched = "";
  let name = "";
  const table = createTable({
    label: "Nodes",
    columns: COLUMNS,
    keyOf: (node) => node.name,
    hrefOf: (node) => pathOf("nodes", node.name),
    sortBy: "name",
    nothing: () => (searched ? "No node matches." : ["There are no nodes in the ROS graph.", "Start some with compose run or ros2 run."]),
  });
  const detail = createNodeDetail(app);
  const plan = createPlan(app);
  const links = h("div");
  const body = split({
    toolbar: h("div", { class: "toolbar" }, searchField("Search nodes ( / )", (text) => { searched = text; update(); })),
    list: table.element,
    detail: detail.element,
  });
  const place = h("div", { class: "fill" });
  const element = h("div", { class: "view" }, h("div", { class: "view-head" }, h("h2", { class: "view-title" }, "Nodes"), links), place);

  function update() {
    if (!app.nodes) return;
    table.update(app.nodes.nodes.filter((node) => matches(`${node.name} ${node.state}`, searched)));
    detail.update(app.nodes);
  }

  function show(route) {
    const tab = route.query.get("show") ?? "nodes";
    links.replaceChildren(tabs("Nodes", [
      ["nodes", "States", "/nodes"],
      ["plan", "Plan", "/nodes?show=plan"],
      ["drift", "Drift", "/nodes?show=drift"],
    ], tab));
    if (tab === "nodes") {
      name = route.name;
      place.replaceChildren(body);
      body.classList.toggle("open", name !== "");
      table.select(name);
      detail.show(name);
      update();
    } else {
      detail.hide();
      place.replaceChildren(plan.element);
      plan.show(tab);
    }
    addEventListener("nodeschange", update);
  }

  function hide() {
    detail.hide();
    removeEventListener("nodeschange", update);
  }

  return { element, show, hide };
}

