/** What is around every view: the bar with the state of the system, the views, the connection. */
import { createAppearance } from "./graph/appearance.js";
import { button, h, setText } from "./dom.js";
import { duration, usage } from "./format.js";
import { icon } from "./icons.js";
import { attempt, confirmed, toast } from "./widgets/notices.js";

/** The views, in the order of the keys 1 to 9: name, label, and a short label for phones. */
export const VIEWS = [
  ["graph", "Graph", "Graph"],
  ["nodes", "Nodes", "Nodes"],
  ["topics", "Topics", "Topics"],
  ["services", "Services & actions", "Calls"],
  ["parameters", "Parameters", "Params"],
  ["log", "Log", "Log"],
  ["timing", "Timing", "Timing"],
  ["bags", "Bags", "Bags"],
];
const COMMANDS = {
  startup: { label: "Start up" },
  pause: { label: "Pause" },
  resume: { label: "Resume" },
  reset: { label: "Reset", ask: "Reset", hint: "All nodes are cleaned up, down to unconfigured." },
  shutdown: { label: "Shut down", ask: "Shut down", hint: "The process of the system ends." },
};
/** Activity of a system -> the commands that make sense then; others are transient. */
const POSSIBLE = {
  running: ["pause", "reset", "shutdown"],
  paused: ["resume", "reset", "shutdown"],
};
const OTHERWISE = ["startup", "reset", "shutdown"];
const THEME = "composer-theme";

export function createFrame(app) {
  const bar = document.getElementById("bar");
  const rail = document.getElementById("rail");
  const banner = document.getElementById("banner");
  const title = h("h1", {}, "…");
  const activity = h("p", { class: "activity" });
  const load = h("span");
  const up = h("span", { class: "up" });
  const figures = h("p", { class: "figures" }, load, up);
  const commands = h("div", { class: "commands" });
  const theme = h("button", { type: "button", class: "quiet", id: "appearance", title: "Light or dark" }, "Theme: auto");
  const readOnly = h("span", { class: "badge" }, "read-only");
  const links = new Map();
  let shown = [];

  bar.append(title, readOnly, activity, figures, commands, theme);
  for (const [index, [view, label, short]] of VIEWS.entries()) {
    const link = h(
      "a",
      { href: `/${view}`, title: `${label} (${index + 1})` },
      icon(view),
      h("span", { class: "long" }, label),
      h("span", { class: "short", "aria-hidden": "true" }, short),
    );
    links.set(view, link);
    rail.append(link);
  }
  createAppearance(theme, {
    start: stored(),
    changed: (appearance) => {
      store(appearance);
      dispatchEvent(new Event("themechange"));
    },
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => dispatchEvent(new Event("themechange")));

  function showHello(hello) {
    setText(title, hello.title);
    bar.classList.toggle("read-only", hello.read_only);
    showTitle();
  }

  function showTitle() {
    document.title = [...shown, app.hello?.title].filter(Boolean).join(" · ");
  }

  function showView(view, name) {
    for (const [other, link] of links) {
      if (other === view) link.setAttribute("aria-current", "page");
      else link.removeAttribute("aria-current");
    }
    const label = VIEWS.find(([id]) => id === view)[1];
    shown = [name, label];
    showTitle();
  }

  function showConnection({ state, retryInMs }) {
    document.body.dataset.connection = state;
    banner.hidden = state === "open";
    if (state === "waiting") {
      banner.textContent = `Not connected. What is shown is out of date. Trying again in ${Math.ceil(retryInMs / 1000)} s …`;
    } else if (state === "refused") {
      banner.textContent = "This page is no longer authorized: open the address that the dashboard printed when it started.";
    }
  }

  /** The first system is that of the dashboard; a graph without one has only nodes. */
  function showNodes(data) {
    app.nodes = data;
    const [system] = data.systems;
    const active = data.nodes.filter((node) => node.state === "active").length;
    if (!system) {
      setText(activity, data.nodes.length === 1 ? "1 node" : `${data.nodes.length} nodes`);
      activity.dataset.activity = "none";
      setText(load, "");
      setText(up, "");
      commands.replaceChildren();
      return;
    }
    const managed = data.nodes.filter((node) => node.system === system.name).length;
    activity.dataset.activity = system.answers ? system.activity : "silent";
    setText(activity, system.answers ? `${system.activity} · ${active} of ${managed} active` : "not responding");
    activity.title = system.message;
    const { process } = system;
    const [cpu, memory] = usage(process ?? {});
    setText(load, process ? `CPU ${cpu}   memory ${memory}` : `on ${system.host}`);
    setText(up, process ? `   up ${duration(process.up_s)}` : "");
    figures.title = process?.processes > 1 ? `${process.processes} processes on ${system.host}` : `process ${system.pid} on ${system.host}`;
    showCommands(system);
  }

  function showCommands(system) {
    const wanted = app.isReadOnly() ? [] : system.commands.filter((name) => (POSSIBLE[system.activity] ?? OTHERWISE).includes(name));
    if (commands.dataset.shown === wanted.join()) return;
    commands.dataset.shown = wanted.join();
    commands.replaceChildren(...wanted.map((name) => {
      const { label, ask, hint } = COMMANDS[name];
      const pressed = button([icon(name), h("span", {}, label)], () => attempt(pressed, async () => {
        if (ask && !(await confirmed(`${ask} ${system.name}?`, { verb: label, hint }))) return;
        const { message } = await app.connection.request("command", { system: system.name, command: name });
        toast(message || `${label}: done`);
      }), { "aria-label": `${label} the system`, title: `${label} the system`, data: { command: name } });
      return pressed;
    }));
  }

  /** 1 ... 8 show a view, / goes to its search field. */
  function listenToKeys(go) {
    document.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.target.closest?.("input, textarea, select, dialog")) return;
      const view = VIEWS[Number(event.key) - 1];
      if (view) go(view[0]);
      else if (event.key === "/") document.querySelector("#main input[type=search]")?.select();
      else return;
      event.preventDefault();
    });
  }

  function start(connection) {
    connection.subscribe("nodes", {}, (data) => {
      showNodes(data);
      dispatchEvent(new Event("nodeschange"));
    });
  }

  return { showHello, showView, showConnection, listenToKeys, start };
}

function stored() {
  try {
    return localStorage.getItem(THEME) ?? "auto";
  } catch {
    return "auto";
  }
}

function store(appearance) {
  try {
    localStorage.setItem(THEME, appearance);
  } catch {
    // Storage may be forbidden: the choice then ends with the page.
  }
}
