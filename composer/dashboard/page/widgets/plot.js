/**
 * A plot of numeric fields over time, with pause and export.
 *
 * A series is {topic, field}; its points come from the channel `plot`.
 */
import { button, h } from "../dom.js";
import { number, timeOfDay } from "../format.js";
import uPlot from "../vendor/uplot/uPlot.esm.js";
import { dropNote, toggle } from "./parts.js";

const MOST_POINTS = 60_000;
const WINDOWS_S = [10, 30, 60, 300];
const HEIGHT = 300;

export function nameOf({ topic, field }) {
  return `${topic}:${field}`;
}

/** Return {element, setSeries, end}. `onremove(series)` is called by the button in the legend. */
export function createPlot(connection, { onremove }) {
  const frame = h("div", { class: "plot" });
  const legend = h("ul", { class: "legend" });
  const problem = h("p", { class: "problem", role: "alert", hidden: true });
  const drops = dropNote();
  const points = new Map();
  let series = [];
  let windowS = WINDOWS_S[1];
  let isPaused = false;
  let chart = null;
  let subscription = null;
  let scheduled = 0;

  const choice = h(
    "select",
    { "aria-label": "Time shown", onchange: () => { windowS = Number(choice.value); draw(); } },
    WINDOWS_S.map((seconds) => h("option", { value: String(seconds) }, `${seconds} s`)),
  );
  choice.value = String(windowS);
  const pause = toggle("Pause", false, (on) => { isPaused = on; if (!on) draw(); });
  const element = h(
    "div",
    { class: "plot-panel" },
    h(
      "div",
      { class: "toolbar" },
      choice,
      pause,
      button("Clear", () => { points.clear(); draw(); }),
      button("Export CSV", exportCsv),
      drops.element,
    ),
    problem,
    frame,
    legend,
  );

  function setSeries(wanted) {
    if (wanted.map(nameOf).join() === series.map(nameOf).join() && subscription) return;
    series = wanted;
    problem.hidden = true;
    const params = { series };
    if (series.length === 0) {
      subscription?.end();
      subscription = null;
    } else if (subscription) subscription.update(params);
    else subscription = connection.subscribe("plot", params, receive, { onerror: fail });
    build();
  }

  function fail(error) {
    problem.hidden = false;
    problem.textContent = error.message;
  }

  function receive(data, { dropped }) {
    drops.show(dropped);
    for (const { topic, field, at_s: times, values } of data.series) {
      const name = nameOf({ topic, field });
      const kept = points.get(name) ?? { times: [], values: [] };
      kept.times.push(...times);
      kept.values.push(...values.map((value) => (typeof value === "number" ? value : null)));
      const excess = kept.times.length - MOST_POINTS;
      if (excess > 0) {
        kept.times.splice(0, excess);
        kept.values.splice(0, excess);
      }
      points.set(name, kept);
    }
    if (!isPaused && !scheduled) scheduled = requestAnimationFrame(draw);
  }

  function build() {
    chart?.destroy();
    chart = null;
    frame.replaceChildren();
    legend.replaceChildren(...series.map(entry));
    if (series.length === 0) return;
    chart = new uPlot(options(), data(), frame);
  }

  function draw() {
    scheduled = 0;
    if (!chart) return;
    chart.setData(data(), false);
    const last = Math.max(...series.map((one) => points.get(nameOf(one))?.times.at(-1) ?? 0));
    if (last > 0) chart.setScale("x", { min: last - windowS, max: last });
    for (const [index, one] of series.entries()) {
      const value = points.get(nameOf(one))?.values.at(-1);
      legend.children[index].querySelector("output").textContent = value === undefined ? "–" : number(value);
    }
  }

  /** Join the series on their times: each has its own. */
  function data() {
    const tables = series.map((one) => {
      const kept = points.get(nameOf(one));
      return kept ? [kept.times, kept.values] : [[], []];
    });
    return tables.length === 1 ? tables[0] : uPlot.join(tables);
  }

  function entry(one, index) {
    const swatch = h("span", { class: "swatch" });
    swatch.style.background = `var(${seriesColor(index)})`;
    return h(
      "li",
      {},
      swatch,
      h("span", { class: "path" }, nameOf(one)),
      h("output", { "aria-label": `Last value of ${nameOf(one)}` }, "–"),
      button("Remove", () => onremove(one), { class: "quiet", "aria-label": `Remove ${nameOf(one)}` }),
    );
  }

  function options() {
    const grid = colorOf("--grid");
    const axis = {
      stroke: colorOf("--faint"),
      grid: { stroke: grid, width: 1 },
      ticks: { stroke: grid, width: 1 },
      font: "12px system-ui, sans-serif",
    };
    return {
      width: frame.clientWidth || 600,
      height: HEIGHT,
      legend: { show: false },
      cursor: { drag: { x: true, y: false } },
      axes: [
        { ...axis, values: (_, splits) => splits.map((time) => timeOfDay(time).slice(0, -4)), space: 80 },
        { ...axis, size: 64 },
      ],
      series: [
        {},
        ...series.map((one, index) => ({
          label: nameOf(one),
          stroke: colorOf(seriesColor(index)),
          width: 1.5,
          spanGaps: true,
          points: { show: false },
        })),
      ],
    };
  }

  function exportCsv() {
    const joined = series.length === 1 ? data() : uPlot.join(series.map((one) => {
      const kept = points.get(nameOf(one)) ?? { times: [], values: [] };
      return [kept.times, kept.values];
    }));
    const rows = [["time_s", ...series.map(nameOf)].map(quoted)];
    for (let row = 0; row < joined[0].length; row += 1) {
      rows.push(joined.map((column) => column[row] ?? ""));
    }
    const text = `${rows.map((row) => row.join(",")).join("\r\n")}\r\n`;
    const link = h("a", { download: "plot.csv", href: URL.createObjectURL(new Blob([text], { type: "text/csv" })) });
    link.click();
    URL.revokeObjectURL(link.href);
  }

  function end() {
    subscription?.end();
    subscription = null;
    resized.disconnect();
    removeEventListener("themechange", build);
    chart?.destroy();
    chart = null;
  }

  const resized = new ResizeObserver(() => {
    if (chart && frame.clientWidth > 0) chart.setSize({ width: frame.clientWidth, height: HEIGHT });
  });
  resized.observe(frame);
  // The colors of a canvas do not follow those of the page.
  addEventListener("themechange", build);

  return { element, setSeries, end };
}

function seriesColor(index) {
  return `--series-${(index % 8) + 1}`;
}

/** Return a color of the page as a canvas needs it. */
function colorOf(name) {
  const probe = h("span");
  probe.style.color = `var(${name})`;
  document.body.append(probe);
  const { color } = getComputedStyle(probe);
  probe.remove();
  return color;
}

/** A cell of a CSV file (RFC 4180). */
function quoted(text) {
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}
