/** Timing: chains against their budget, timers by lateness, and a histogram for each callback. */
import { h } from "../dom.js";
import { count, hertz, milliseconds, percent } from "../format.js";
import { pathOf } from "../router.js";
import { createHistogram } from "../widgets/histogram.js";
import { detailHead, facts, matches, searchField, split, tabs } from "../widgets/parts.js";
import { createTable } from "../widgets/table.js";

const keyOf = ({ node, kind, name }) => `${node} ${kind} ${name}`;
const ms = (id, label, timeOf, level = 1) => {
  const value = (row) => (row.count > 0 ? timeOf(row) : null); // none is known before the first call
  return { id, label, number: true, level, value, text: (row) => milliseconds(value(row)) };
};
const COLUMNS = [
  // Where the column of nodes is left out, the node is below the callback.
  {
    id: "name",
    label: "Callback",
    text: ({ kind, name }) => `${kind} ${name}`,
    render: ({ kind, name, node }) => h("span", {}, `${kind} ${name}`, h("span", { class: "below" }, node)),
  },
  { id: "node", label: "Node", level: 2, text: ({ node }) => node },
  { id: "calls", label: "Calls", number: true, level: 2, value: ({ calls_hz: hz }) => hz, text: ({ calls_hz: hz }) => hertz(hz) },
  { id: "busy", label: "Busy", number: true, level: 3, value: ({ busy }) => busy, text: ({ busy }) => percent(busy) },
  ms("mean", "Mean", (row) => row.mean_ms, 3),
  ms("p99", "p99", (row) => row.p99_ms),
  ms("max", "Max", (row) => row.longest_ms, 2),
  ms("late", "Late p99", (row) => (row.kind === "timer" ? row.late_p99_ms : null)),
  { id: "over", label: "Over budget", number: true, level: 3, value: ({ overruns }) => overruns, text: ({ overruns }) => count(overruns), tone: ({ overruns }) => (overruns > 0 ? "bad" : "") },
  { id: "dropped", label: "Dropped", number: true, level: 3, value: ({ dropped }) => dropped, text: ({ dropped }) => count(dropped), tone: ({ dropped }) => (dropped > 0 ? "warn" : "") },
];

export function createView(app) {
  const common = { columns: COLUMNS, keyOf, hrefOf: (row) => pathOf("timing", "", { show: tab === "callbacks" ? "" : tab, of: keyOf(row) }) };
  const tables = {
    callbacks: createTable({ ...common, label: "Callbacks", sortBy: "p99", nothing: () => nothing("callbacks") }),
    timers: createTable({ ...common, label: "Timers by lateness", sortBy: "late", nothing: () => nothing("timers") }),
  };
  const links = h("div");
  const chains = h("div", { class: "chains" });
  const list = h("div", { class: "fill" });
  const detail = h("aside", { class: "detail", "aria-label": "Histogram", hidden: true });
  const body = split({
    toolbar: h("div", { class: "toolbar" }, searchField("Search callbacks ( / )", (text) => { searched = text; update(); })),
    list,
    detail,
  });
  const element = h("div", { class: "view" }, h("div", { class: "view-head" }, h("h2", { class: "view-title" }, "Timing"), links), chains, body);

  let callbacks = null;
  let searched = "";
  let tab = "callbacks";
  let chosen = "";
  let subscription = null;
  let histogram = null;

  function nothing(what) {
    if (searched) return "None matches.";
    return [`There are no ${what} to show.`, "Timings come from systems started with compose run; not with --no-tracing."];
  }

  function receive({ systems }) {
    callbacks = systems.flatMap((system) => system.callbacks);
    showChains(systems.flatMap((system) => system.chains));
    update();
  }

  function update() {
    if (!callbacks) return;
    const shown = callbacks.filter((row) => matches(keyOf(row), searched));
    tables.callbacks.update(shown);
    tables.timers.update(shown.filter(({ kind }) => kind === "timer"));
    const row = callbacks.find((one) => keyOf(one) === chosen);
    if (row) histogram?.update(row);
  }

  /** A bar for each chain: mean and 99th percentile within the budget. */
  function showChains(all) {
    chains.replaceChildren(...all.map((chain) => {
      const longest = Math.max(chain.latency_ms, chain.p99_ms) * 1.1;
      const at = (part, className) => {
        const bar = h("span", { class: className });
        bar.style.width = `${(100 * part) / longest}%`;
        return bar;
      };
      const isLate = chain.late > 0;
      return h(
        "section",
        { class: "chain", data: { tone: isLate ? "bad" : "good" } },
        h("h3", {}, chain.chain),
        h("div", { class: "budget", "aria-hidden": "true" }, at(chain.p99_ms, "p99"), at(chain.mean_ms, "mean"), at(chain.latency_ms, "limit")),
        h("p", {}, `mean ${milliseconds(chain.mean_ms)} · p99 ${milliseconds(chain.p99_ms)} · max ${milliseconds(chain.longest_ms)} · budget ${milliseconds(chain.latency_ms)}`),
        h("p", { class: isLate ? "problem" : "muted" }, `${count(chain.late)} of ${count(chain.count)} over the budget`),
      );
    }));
  }

  function show(route) {
    tab = route.query.get("show") === "timers" ? "timers" : "callbacks";
    chosen = route.query.get("of") ?? "";
    links.replaceChildren(tabs("Timing", [["callbacks", "Callbacks", "/timing"], ["timers", "Timers", "/timing?show=timers"]], tab));
    list.replaceChildren(tables[tab].element);
    tables[tab].select(chosen);
    detail.hidden = chosen === "";
    body.classList.toggle("open", chosen !== "");
    if (chosen) showDetail();
    update();
    subscription ??= app.connection.subscribe("timing", {}, receive, { onerror: (error) => tables[tab].fail(error.message) });
  }

  function showDetail() {
    const [node, ...rest] = chosen.split(" ");
    const figures = h("div");
    const drawing = createHistogram();
    detail.replaceChildren(
      detailHead(rest.join(" "), pathOf("timing", "", { show: tab === "callbacks" ? "" : tab })),
      h("p", { class: "links" }, h("a", { href: pathOf("nodes", node) }, node)),
      drawing.element,
      figures,
    );
    histogram = {
      update(row) {
        drawing.update(row.histogram ?? []);
        figures.replaceChildren(facts([
          ["calls", `${count(row.count)}, ${hertz(row.calls_hz)}`],
          ["busy", percent(row.busy)],
          ...(row.count > 0 ? [["mean", milliseconds(row.mean_ms)], ["p99", milliseconds(row.p99_ms)], ["max", milliseconds(row.longest_ms)]] : []),
          ["late, p99", row.kind === "timer" ? milliseconds(row.late_p99_ms) : null],
          ["late, max", row.kind === "timer" ? milliseconds(row.late_longest_ms) : null],
          ["over budget", count(row.overruns)],
          ["dropped", count(row.dropped)],
        ]));
      },
    };
  }

  function hide() {
    subscription?.end();
    subscription = null;
    histogram = null;
  }

  return { element, show, hide };
}

