/** The details of something in the diagram, from its declaration and from what is measured. */
import { h } from "../dom.js";
import { count, duration, hertz } from "../format.js";
import { pathOf } from "../router.js";
import { facts, section, stateBadge } from "../widgets/parts.js";
import { qosText } from "../widgets/qos.js";

const LABELS = { rate_hz: "declared rate", timeout_ms: "timeout", qos: "QoS" };
const UNITS = { rate_hz: " Hz", timeout_ms: " ms" };
const LEFT_OUT = ["full_name", "qos_explicit", "ports", "timers", "parameters"];
const PAGES = { topic: "topics", service: "services", action: "actions" };

/** Return {element, update, end}: `update(live)` shows what is measured now. */
export function createArticle(app, key, thing) {
  const { details, problem, mark, node } = thing;
  const kind = kindOf(key);
  const isEdge = !["node", "topic", "service", "action", "state"].includes(kind);
  const current = h("div");
  const parameters = h("div");
  const declared = h("div");
  const element = h(
    "article",
    {},
    h("h2", {}, titleOf(key, details)),
    h("p", { class: "kind" }, kind.replaceAll("_", " ")),
    linksOf(key, thing, isEdge),
    problem && h("p", { class: mark === "wrong" ? "problem" : "note" }, problem),
    current,
    plainFacts(details),
    (details.ports ?? []).length > 0 && [h("h3", {}, "Ports"), details.ports.map(record)],
    (details.timers ?? []).length > 0 && [h("h3", {}, "Timers"), details.timers.map(record)],
    parameters,
    declared,
  );
  let subscription = null;
  if (kind === "node") {
    subscription = app.connection.subscribe("parameters", { node }, (data) => parameters.replaceChildren(...parameterList(data.parameters)));
    app.connection.request("node", { node }).then(
      ({ source }) => source?.text && declared.replaceChildren(sourceOf(source)),
      () => {}, // Not declared: there is nothing to add.
    );
  }
  return {
    element,
    update(live) {
      const state = kind === "node" ? live.nodes[node] : null;
      const edge = isEdge ? live.edges[key] ?? live.topics[details.name] : null;
      current.replaceChildren(...[state && nodeState(state), edge && measured(edge)].filter(Boolean));
    },
    end: () => subscription?.end(),
  };
}

function parameterList(parameters) {
  if (parameters.length === 0) return [];
  return [h("h3", {}, "Parameters"), facts(parameters.map(({ name, value, unit }) => [name, `${written(value)}${unit ? ` ${unit}` : ""}`]))];
}

/** The lines of YAML that declare a node. */
export function sourceOf({ file, line, text }) {
  return section(`Declared at ${file}:${line}`, h("pre", { class: "source", tabindex: "0" }, text));
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
      node.condition ? h("span", { class: "desired" }, ` ${node.condition}`) : null,
      node.since_s ? h("span", { class: "muted" }, ` for ${duration(Date.now() / 1000 - node.since_s)}`) : null,
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
