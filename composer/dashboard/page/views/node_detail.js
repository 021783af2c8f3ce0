/** The details of one node: what it does, what it did wrong, and what can be done with it. */
import { button, empty, h } from "../dom.js";
import { count, duration, hertz, milliseconds, percent, usage } from "../format.js";
import { pathOf } from "../router.js";
import { asked, attempt, confirmed, toast } from "../widgets/notices.js";
import { detailHead, facts, section, stateBadge } from "../widgets/parts.js";
import { qosText } from "../widgets/qos.js";
import { sourceOf } from "./graph_details.js";

const TRANSITIONS = ["configure", "activate", "deactivate", "cleanup", "shutdown"];
const LOWERING = ["deactivate", "cleanup", "shutdown"];
const VIEWS = { publisher: "topics", subscription: "topics", service: "services", client: "services", "action server": "actions", "action client": "actions" };

/** The name of the process, in a system with several of them, and its id. */
function processOf({ process, host, pid }) {
  return pid && [process, `${pid} on ${host}`].filter(Boolean).join(", ");
}

function usageOf(node, ownHost) {
  if (node.pid && node.host !== ownHost) return [["CPU and memory", "not measured on other computers"]];
  if (!node.usage) return [];
  const [cpu, memory] = usage(node.usage);
  return [["CPU of process", cpu], ["memory of process", memory]];
}

export function createNodeDetail(app) {
  const element = h("aside", { class: "detail", "aria-label": "Details of the node", hidden: true });
  const state = h("div");
  const actions = h("div", { class: "actions" });
  const figures = h("div");
  const callbacks = h("div");
  // It stays when its content is replaced, so that it keeps its focus.
  const timings = h("div", { class: "scroll-x", tabindex: "0", role: "region", "aria-label": "Callbacks" });
  const declared = h("div");
  let name = "";
  let timing = null;
  let shownActions = "";

  function show(wanted) {
    if (wanted === name) return;
    hide();
    name = wanted;
    element.hidden = name === "";
    if (name === "") return;
    element.replaceChildren(
      detailHead(name, "/nodes"),
      h(
        "p",
        { class: "links" },
        h("a", { href: pathOf("graph", name) }, "Graph"),
        h("a", { href: pathOf("parameters", name) }, "Parameters"),
        h("a", { href: pathOf("log", "", { node: name }) }, "Log"),
      ),
      state,
      actions,
      figures,
      callbacks,
      declared,
    );
    for (const part of [state, actions, figures, callbacks, declared]) part.replaceChildren();
    timing = app.connection.subscribe("timing", {}, showTiming);
    showDeclared(name);
  }

  function hide() {
    timing?.end();
    timing = null;
    name = "";
    shownActions = "";
    element.hidden = true;
  }

  function update({ host, nodes }) {
    if (name === "") return;
    const node = nodes.find((one) => one.name === name);
    if (!node) {
      state.replaceChildren(empty(`${name} is not in the ROS graph.`));
      actions.replaceChildren();
      figures.replaceChildren();
      shownActions = "";
      return;
    }
    state.replaceChildren(h(
      "p",
      { class: "node-state" },
      stateBadge(node.state),
      node.condition ? h("span", { class: "desired" }, ` ${node.condition}`) : null,
      node.since_s ? h("span", { class: "muted" }, ` for ${duration(Date.now() / 1000 - node.since_s)}`) : null,
      node.desired && node.desired !== node.state ? h("span", { class: "desired" }, ` should be ${node.desired}`) : null,
    ));
    showActions(node);
    const events = Object.entries(node.qos_events ?? {}).map(([event, times]) => `${event}: ${times}`).join(", ");
    const waits = Object.entries(node.depends_on ?? {}).map(([other, needed]) => `${other} (${needed})`).join(", ");
    figures.replaceChildren(
      node.last_error ? h("p", { class: "problem" }, h("strong", {}, "Last error: "), node.last_error) : "",
      node.held_down ? h("p", { class: "note" }, node.held_down) : "",
      facts([
        ["system", node.system],
        ["depends on", waits],
        ["sent", node.system ? hertz(node.sent_hz) : null],
        ["received", node.system ? hertz(node.received_hz) : null],
        ["busy", node.system ? percent(node.busy) : null],
        ["process", processOf(node)],
        ...usageOf(node, host),
        ["errors", node.system ? count(node.errors) : null],
        ["restarts", node.system ? count(node.restarts) : null],
        ["over budget", node.overruns ? count(node.overruns) : null],
        ["dropped", node.queue_drops ? `${count(node.queue_drops)} messages` : null],
        ["QoS events", events],
        ["declared at", node.declared_at],
      ]),
    );
  }

  function showActions(node) {
    const wanted = `${node.system} ${node.transitions?.join()} ${app.isReadOnly()}`;
    if (wanted === shownActions) return;
    shownActions = wanted;
    if (app.isReadOnly() || node.state === "") {
      actions.replaceChildren();
      return;
    }
    const legal = node.transitions ?? [];
    const buttons = TRANSITIONS.filter((transition) => legal.includes(transition)).map((transition) =>
      acting(transition, "transition", { transition }, transition === "shutdown"));
    if (node.system) buttons.push(acting("restart", "restart", {}, false));
    actions.replaceChildren(...buttons);
  }

  function acting(label, op, args, isFinal) {
    const node = name;
    const text = `${label[0].toUpperCase()}${label.slice(1)}`;
    const pressed = button(text, () => attempt(pressed, async () => {
      const dependents = LOWERING.includes(label) ? activeDependents(node) : [];
      const answer = await answerTo(`${text} ${node}?`, text, node, dependents, isFinal);
      if (answer === null) return;
      const extra = answer === "all" ? { dependents: true } : {};
      const { outcomes } = await app.connection.request(op, { node, ...args, ...extra });
      toast((outcomes ?? []).map(({ node: moved, before, after }) => `${moved}: ${before} → ${after}`).join("\n") || `${text}: done`);
    }), { data: { transition: label } });
    return pressed;
  }

  async function answerTo(question, text, node, dependents, isFinal) {
    const final = isFinal ? finalOf(node) : "";
    if (dependents.length > 0) {
      const hint = [`Active nodes depend on it: ${dependents.join(", ")}.`, final].filter(Boolean).join(" ");
      return asked(question, { hint, answers: [["Only this node", "one"], ["With dependents", "all"]] });
    }
    if (!isFinal || (await confirmed(question, { verb: text, hint: final }))) return "one";
    return null;
  }

  function finalOf(node) {
    const { system } = app.nodes.nodes.find((one) => one.name === node);
    return system ? "Only a restart makes it usable again." : "A node that is shut down cannot be used again.";
  }

  /** The active nodes that wait for this one, directly or through others. */
  function activeDependents(node) {
    const found = new Set([node]);
    for (const known of found) {
      for (const other of app.nodes.nodes) {
        if (other.state === "active" && known in (other.depends_on ?? {})) found.add(other.name);
      }
    }
    found.delete(node);
    return [...found];
  }

  /** No time is known before the first call. */
  function timesOf({ calls_hz: hz, count: calls, mean_ms: mean, p99_ms: p99, longest_ms: longest }) {
    return [hertz(hz), ...[mean, p99, longest].map((time) => milliseconds(calls > 0 ? time : null))];
  }

  function showTiming({ systems }) {
    const own = systems.flatMap((system) => system.callbacks).filter((callback) => callback.node === name);
    if (own.length === 0) return;
    const row = (callback) => h(
      "tr",
      {},
      h("th", { scope: "row" }, `${callback.kind} ${callback.name}`),
      timesOf(callback).map((text) => h("td", { class: "number" }, text)),
    );
    timings.replaceChildren(h(
      "table",
      { class: "small" },
      h("thead", {}, h("tr", {}, ["Callback", "Calls", "Mean", "p99", "Max"].map((text, index) => h("th", { scope: "col", class: index ? "number" : null }, text)))),
      h("tbody", {}, own.map(row)),
    ));
    if (!timings.isConnected) callbacks.replaceChildren(section("Callbacks", timings));
  }

  async function showDeclared(node) {
    try {
      const found = await app.connection.request("node", { node });
      if (node !== name) return;
      const endpoint = ({ kind, name: channel, type, qos }) => h(
        "li",
        {},
        h("span", { class: "type" }, kind),
        " ",
        VIEWS[kind] ? h("a", { href: pathOf(VIEWS[kind], channel) }, channel) : channel,
        h("span", { class: "type" }, ` ${type}`),
        qos ? h("span", { class: "qos" }, qosText(qos)) : null,
      );
      const { source } = found;
      const tools = found.endpoints.filter((end) => end.for_tools);
      const own = found.endpoints.filter((end) => !end.for_tools);
      declared.replaceChildren(
        own.length > 0 ? section("Ports", h("ul", { class: "endpoints" }, own.map(endpoint))) : "",
        tools.length > 0 ? h("details", { class: "block" }, h("summary", { class: "plain" }, `${tools.length} ports for tools`), h("ul", { class: "endpoints" }, tools.map(endpoint))) : "",
        source?.text ? sourceOf(source) : "",
      );
    } catch (error) {
      if (node === name) declared.replaceChildren(h("p", { class: "hint" }, error.message));
    }
  }

  return { element, show, hide, update };
}

