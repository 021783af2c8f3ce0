/** Bags: record the ROS graph, and play what was recorded into it. */
import { button, h, setText } from "../dom.js";
import { bytes, count, duration } from "../format.js";
import { searchField, matches } from "../widgets/parts.js";
import { attempt, toast } from "../widgets/notices.js";
import { createTable } from "../widgets/table.js";

export function createView(app) {
  const record = h("button", { type: "button", class: "primary", onclick: () => attempt(record, toggleRecording) });
  const stop = button("Stop the replay", () => attempt(stop, () => request("replay", { on: false })), { hidden: true });
  const status = h("p", { class: "muted", role: "status" });
  const problem = h("pre", { class: "problem", role: "alert", hidden: true });
  const table = createTable({
    label: "Bags",
    columns: [
      { id: "name", label: "Bag", text: (bag) => bag.name },
      { id: "start", label: "Start", value: (bag) => bag.start_s ?? 0, render: startOf, number: true, level: 2 },
      { id: "duration", label: "Length", value: (bag) => bag.duration_s ?? -1, render: (bag) => (bag.is_complete ? duration(bag.duration_s) : "not complete"), number: true },
      { id: "messages", label: "Messages", value: (bag) => bag.messages ?? -1, render: (bag) => count(bag.messages), number: true, level: 2 },
      { id: "size", label: "Size", value: (bag) => bag.bytes, render: (bag) => bytes(bag.bytes), number: true, level: 2 },
      { id: "play", label: "Replay", text: (bag) => bag.name, render: playButton },
    ],
    keyOf: (bag) => bag.name,
    sortBy: null,
    nothing: () => (searched ? "No bag matches." : [`There are no bags in ${state?.folder}.`, "Record one here, or with 'compose run --record'."]),
  });
  const element = h(
    "div",
    { class: "view" },
    h(
      "div",
      { class: "view-head" },
      h("h2", { class: "view-title" }, "Bags"),
      h("div", { class: "toolbar" }, record, stop, searchField("Search bags ( / )", (text) => { searched = text; update(); }), status),
    ),
    problem,
    h("div", { class: "fill list" }, table.element),
  );

  let searched = "";
  let state = null;
  let subscription = null;

  async function request(op, args) {
    const { message } = await app.connection.request(op, args);
    if (!args.on) toast(message || "The replay has ended.");
  }

  function toggleRecording() {
    return request("record", { on: !state?.record });
  }

  function playButton(bag) {
    if (app.isReadOnly()) return "";
    const play = button("Play", () => attempt(play, () => request("replay", { on: true, bag: bag.name })), { "aria-label": `Play ${bag.name}` });
    return play;
  }

  function receive(data) {
    state = data;
    update();
  }

  function update() {
    record.hidden = app.isReadOnly();
    stop.hidden = app.isReadOnly() || !state?.replay;
    setText(record, state?.record ? "Stop recording" : "Record");
    if (!state) return;
    const texts = [["record", "recording"], ["replay", "playing"]]
      .filter(([verb]) => state[verb])
      .map(([verb, text]) => `${text} ${state[verb].bag}, ${duration(state[verb].for_s)}`);
    setText(status, texts.join(" · "));
    problem.hidden = Object.keys(state.problems).length === 0;
    setText(problem, Object.entries(state.problems).map(([verb, text]) => `${verb} failed: ${text}`).join("\n"));
    table.update(state.bags.filter((bag) => bag.name !== state.record?.bag && matches(bag.name, searched)));
  }

  function show() {
    update();
    subscription ??= app.connection.subscribe("bags", {}, receive, { onerror: (error) => table.fail(error.message) });
  }

  function hide() {
    subscription?.end();
    subscription = null;
  }

  return { element, show, hide };
}

function startOf(bag) {
  return bag.start_s ? new Date(bag.start_s * 1000).toLocaleString() : "";
}
