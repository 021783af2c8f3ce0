/** The topics: figures of those on the screen, and for one of them echo, plot, image and publish. */
import { button, empty, h } from "../dom.js";
import { bandwidth, count, hertz } from "../format.js";
import { pathOf } from "../router.js";
import { detailHead, facts, section, searchField, matches, split, tabs, toggle } from "../widgets/parts.js";
import { createPlot, nameOf } from "../widgets/plot.js";
import { qosText, sharedQosText } from "../widgets/qos.js";
import { createTable } from "../widgets/table.js";
import { createEcho } from "./echo.js";
import { createImage } from "./image.js";
import { createPublish } from "./publish.js";

const MOST_MEASURED = 40;
const MEASURE_AGAIN_MS = 1000;
const MOST_SERIES = 16;

export function createView(app) {
  const figures = new Map();
  const figure = (topic, name) => figures.get(topic.name)?.[name];
  const columns = [
    { id: "name", label: "Topic", text: (topic) => topic.name },
    { id: "type", label: "Type", level: 2, text: (topic) => topic.types.join(", "), tone: (topic) => (topic.types.length > 1 ? "bad" : "") },
    { id: "rate", label: "Rate", number: true, value: (topic) => figure(topic, "rate_hz") ?? null, text: (topic) => hertz(figure(topic, "rate_hz")) },
    { id: "bandwidth", label: "Bandwidth", number: true, level: 2, value: (topic) => figure(topic, "bytes_per_s") ?? null, text: (topic) => bandwidth(figure(topic, "bytes_per_s")) },
    { id: "lost", label: "Lost", number: true, level: 3, value: (topic) => figure(topic, "lost") ?? null, text: (topic) => count(figure(topic, "lost")), tone: (topic) => (figure(topic, "lost") > 0 ? "warn" : "") },
    { id: "publishers", label: "Pub", number: true, level: 3, value: (topic) => topic.publishers.length, text: (topic) => count(topic.publishers.length) },
    { id: "subscriptions", label: "Sub", number: true, level: 3, value: (topic) => topic.subscriptions.length, text: (topic) => count(topic.subscriptions.length) },
    { id: "qos", label: "QoS", level: 3, text: (topic) => sharedQosText([...topic.publishers, ...topic.subscriptions]) },
  ];
  const table = createTable({
    label: "Topics",
    columns,
    keyOf: (topic) => topic.name,
    hrefOf: (topic) => pathOf("topics", topic.name, { tab: tab === "echo" || tab === "plot" ? tab : "" , series: tab === "plot" ? seriesText() : "" }),
    sortBy: "name",
    nothing: () => (searched ? "No topic matches." : "There are no topics."),
  });
  const detail = h("aside", { class: "detail", "aria-label": "Details of the topic", hidden: true });
  const body = split({
    toolbar: h(
      "div",
      { class: "toolbar" },
      searchField("Search topics ( / )", (text) => { searched = text; update(); }),
      toggle("Show hidden", false, (on) => { withHidden = on; measure(true); }, { title: "Show topics of services, actions, managers and tools" }),
    ),
    list: table.element,
    detail,
  });
  const element = h("div", { class: "view" }, h("div", { class: "view-head" }, h("h2", { class: "view-title" }, "Topics")), body);

  let topics = null;
  let searched = "";
  let withHidden = false;
  let name = "";
  let tab = "echo";
  let series = [];
  let subscription = null;
  let measured = "";
  let again = 0;
  let part = null;
  let shownPart = "";

  const seriesText = () => series.map(nameOf).join(" ");

  function receive(data) {
    if (data.topics) topics = data.topics;
    figures.clear();
    for (const [topic, one] of Object.entries(data.figures ?? {})) figures.set(topic, one);
    update();
    measure(false);
    if (name && (shownPart === "" || tab === "info")) showPart();
  }

  function update() {
    if (!topics) return;
    table.update(topics.filter((topic) => matches(`${topic.name} ${topic.types.join(" ")}`, searched)));
  }

  /** Let the server measure the topics on the screen, and no others. */
  function measure(isForced) {
    const seen = table.seen().slice(0, MOST_MEASURED);
    if (name && !seen.includes(name)) seen.push(name);
    const params = { measure: seen.slice(-MOST_MEASURED), hidden: withHidden, chosen: name };
    const now = JSON.stringify(params);
    if (now === measured && !isForced) return;
    measured = now;
    subscription?.update(params);
  }

  function link(id) {
    return pathOf("topics", name, { tab: id === "echo" ? "" : id, series: id === "plot" ? seriesText() : "" });
  }

  function showDetail() {
    detail.hidden = name === "";
    body.classList.toggle("open", name !== "");
    table.select(name);
    part?.end();
    part = null;
    shownPart = "";
    if (name) showPart();
  }

  function showPart() {
    const topic = topics?.find((one) => one.name === name);
    if (!topic) {
      const text = topics ? `There is no topic ${name}.` : "Loading …";
      if (detail.textContent !== name + text) detail.replaceChildren(detailHead(name, "/topics"), empty(text));
      shownPart = "";
      return;
    }
    const now = `${name} ${tab}`;
    const entries = [["echo", "Echo"], ["plot", "Plot"], topic.image && ["image", "Image"], !app.isReadOnly() && ["publish", "Publish"], ["info", "QoS"]]
      .filter(Boolean).map(([id, label]) => [id, label, link(id)]);
    if (now !== shownPart) {
      part?.end();
      part = make(topic);
      shownPart = now;
    } else if (tab === "info") {
      part.update(topic);
      return;
    }
    detail.replaceChildren(detailHead(name, "/topics"), h("p", { class: "type" }, topic.types.join(", ")), tabs("Topic", entries, tab), part.element);
  }

  function make(topic) {
    if (!topic.installed) return { element: empty(`The type ${topic.types[0]} is not installed.`, "Install its package, and start the dashboard again."), end() {} };
    if (tab === "plot") return plotPart();
    if (tab === "image") return createImage(app, topic);
    if (tab === "publish") return createPublish(app, topic);
    if (tab === "info") return infoPart(topic);
    return createEcho(app, topic, {
      isPlotted: (field) => series.some((one) => one.topic === topic.name && one.field === field),
      onplot: (field) => {
        toggleSeries({ topic: topic.name, field });
        app.go(link("plot"));
      },
    });
  }

  function toggleSeries(wanted) {
    const without = series.filter((one) => nameOf(one) !== nameOf(wanted));
    series = without.length < series.length ? without : [...without, wanted].slice(-MOST_SERIES);
  }

  function plotPart() {
    const plot = createPlot(app.connection, {
      onremove: (one) => {
        toggleSeries(one);
        app.go(link("plot"), { replace: true });
      },
    });
    const fields = h("select", {
      "aria-label": "Field to add",
      // The arrow keys change the field, so only the button adds it.
      onchange: () => { add.disabled = fields.value === ""; },
    }, h("option", { value: "" }, "Add a field …"));
    const add = button("Add", () => {
      const wanted = { topic: name, field: fields.value };
      if (series.some((one) => nameOf(one) === nameOf(wanted))) return;
      toggleSeries(wanted);
      app.go(link("plot"), { replace: true });
    }, { disabled: true });
    const type = topics.find((topic) => topic.name === name).types[0];
    app.connection.request("fields", { type }).then(
      ({ numeric }) => fields.append(...numeric.map((field) => h("option", { value: field }, field))),
      (error) => fields.replaceChildren(h("option", {}, error.message)),
    );
    const hint = empty("Choose a field to plot.", "Fields of several topics can be in one plot: add each from its topic.");
    const update = () => {
      plot.setSeries(series);
      hint.hidden = series.length > 0;
      plot.element.hidden = series.length === 0;
    };
    const box = h("div", { class: "plotting" }, h("div", { class: "toolbar" }, fields, add), hint, plot.element);
    queueMicrotask(update);
    return { element: box, end: plot.end, update };
  }

  function infoPart(topic) {
    const box = h("div");
    const ends = (title, list) => section(`${title} (${list.length})`, list.map((end) => h(
      "div",
      { class: "record" },
      h("h4", {}, h("a", { href: pathOf("nodes", end.node) }, end.node)),
      facts([["type", end.type], ["QoS", qosText(end.qos ?? {})]]),
    )));
    let shown = "";
    // Only what has changed is replaced, or a link would lose its focus every second.
    const update = (now) => {
      const wanted = JSON.stringify([now.publishers, now.subscriptions]);
      if (wanted === shown) return;
      shown = wanted;
      box.replaceChildren(ends("Publishers", now.publishers), ends("Subscriptions", now.subscriptions));
    };
    update(topic);
    return { element: box, end() {}, update };
  }

  function show(route) {
    const wanted = (route.query.get("series") ?? "").split(" ").filter(Boolean).map((text) => {
      const at = text.indexOf(":");
      return { topic: text.slice(0, at), field: text.slice(at + 1) };
    });
    if (wanted.length > 0) series = wanted;
    const isSame = route.name === name && (route.query.get("tab") ?? "echo") === tab;
    if (isSame && tab === "plot" && route.query.get("series") === null) series = [];
    name = route.name;
    tab = route.query.get("tab") ?? "echo";
    if (!subscription) {
      measured = JSON.stringify({ measure: name ? [name] : [], hidden: withHidden, chosen: name });
      subscription = app.connection.subscribe("topics", JSON.parse(measured), receive, { onerror: (error) => table.fail(error.message) });
      again = setInterval(() => measure(false), MEASURE_AGAIN_MS);
    }
    if (isSame && part) part.update?.(topics?.find((topic) => topic.name === name));
    else showDetail();
    measure(false);
  }

  function hide() {
    subscription?.end();
    subscription = null;
    clearInterval(again);
    part?.end();
    part = null;
    shownPart = "";
    name = "";
  }

  return { element, show, hide };
}
