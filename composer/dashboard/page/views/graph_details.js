/** The details of something in the diagram, from its declaration and from what is measured. */
import { h } from "../dom.js";
import { count, duration, hertz } from "../format.js";
import { pathOf } from "../router.js";
import { facts, stateBadge } from "../widgets/parts.js";
import { qosText } from "../widgets/qos.js";

const LABELS = { rate_hz: "declared rate", timeout_ms: "timeout", qos: "QoS" };
const UNITS = { rate_hz: " Hz", timeout_ms: " ms" };
const LEFT_OUT = ["full_name", "qos_explicit", "ports", "timers", "parameters"];
const PAGES = { topic: "topics", service: "services", action: "actions" };

export function articleOf(app, key, thing, live) {
  if (!thing) return null;
  const { details, wrong, node } = thing;
  const isEdge = !["node", "topic", "service", "action", "state"].includes(kindOf(key));
  const current = !isEdge && kindOf(key) === "node" ? live.nodes[node] : null;
  return h(
    "article",
    {},
    h("h2", {}, titleOf(key, details)),
    h("p", { class: "kind" }, kindOf(key).replaceAll("_", " ")),
    linksOf(key, thing, isEdge),
    wrong && h("p", { class: "problem" }, wrong),
    current && nodeState(current),
    isEdge && measured(live.edges[key] ?? live.topics[details.name]),
    plainFacts(details),
    (details.ports ?? []).length > 0 && [h("h3", {}, "Ports"), details.ports.map(record)],
    (details.timers ?? []).length > 0 && [h("h3", {}, "Timers"), details.timers.map(record)],
    Object.keys(details.parameters ?? {}).length > 0 && [
      h("h3", {}, "Parameters"),
      facts(Object.entries(details.parameters).map(([name, value]) => [name, written(value)])),
    ],
  );
}

function kindOf(key) {
  return key.includes(" -> ") ? "connection" : key.slice(0, key.indexOf(":"));
}

function titleOf(key, details) {
  if (key.includes(" -> ")) return key.split(" -> ").map((end) => end.slice(end.indexOf(":") + 1)).join(" → ");
  return details.full_name ?? details.name ?? key.slice(key.indexOf(":") + 1);
}

function linksOf(key, { node, channel }, isEdge) {
  const links = [];
  if (node) {
    links.push(h("a", { href: pathOf("nodes", node) }, isEdge ? node : "Control and timing"));
    if (!isEdge) {
      links.push(h("a", { href: pathOf("parameters", node) }, "Parameters"));
      links.push(h("a", { href: pathOf("log", "", { node }) }, "Log"));
    }
  }
  const page = PAGES[kindOf(key)];
  if (page) links.push(h("a", { href: pathOf(page, channel) }, page === "topics" ? "Echo, plot, publish" : "Call"));
  return links.length > 0 && h("p", { class: "links" }, links);
}

function nodeState(node) {
  return h(
    "div",
    {},
    h(
      "p",
      { class: "node-state" },
      stateBadge(node.state),
      node.since_s ? h("span", { class: "faint" }, ` for ${duration(Date.now() / 1000 - node.since_s)}`) : null,
    ),
    node.last_error && h("p", { class: "problem" }, h("strong", {}, "Last error: "), node.last_error),
    node.held_down && h("p", { class: "note" }, node.held_down),
    facts([
      ["restarts", node.restarts === undefined ? null : count(node.restarts)],
      ["errors", node.errors === undefined ? null : count(node.errors)],
    ]),
  );
}

function measured(edge) {
  if (!edge) return null;
  return facts([
    ["measured rate", hertz(edge.rate_hz)],
    ["dropped", edge.dropped_total === undefined ? null : `${count(edge.dropped_total)} messages`],
    ["lost", edge.lost ? `${count(edge.lost)} messages` : null],
  ]);
}

function plainFacts(details) {
  return facts(
    Object.entries(details)
      .filter(([name]) => !LEFT_OUT.includes(name))
      .map(([name, value]) => [LABELS[name] ?? name.replaceAll("_", " "), valueOf(name, value)]),
  );
}

function valueOf(name, value) {
  if (name === "qos") return qosText(value);
  if (Array.isArray(value)) return value.length === 0 ? null : h("ul", {}, value.map((item) => h("li", {}, written(item))));
  return `${written(value)}${UNITS[name] ?? ""}`;
}

function record(item) {
  const { name, kind, port, ...rest } = item;
  return h(
    "div",
    { class: "record" },
    h("h4", {}, port ?? name, " ", h("span", {}, kind ?? "")),
    plainFacts(port && port !== name ? { name, ...rest } : rest),
  );
}

function written(value) {
  return typeof value === "object" ? JSON.stringify(value) : String(value);
}
