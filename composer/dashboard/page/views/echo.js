/** The messages of a topic as a tree, with a filter of fields and the last messages to step through. */
import { button, empty, h, setText } from "../dom.js";
import { timeOfDay } from "../format.js";
import { createMessageTree } from "../widgets/message.js";
import { dropNote, searchField, toggle } from "../widgets/parts.js";

const MOST_KEPT = 200;
const RATES_HZ = [1, 5, 10, 30];

export function createEcho(app, topic, { onplot, isPlotted }) {
  const tree = createMessageTree({ onplot, isPlotted });
  const waiting = empty("Waiting for a message …", "It may be that no publisher is active.");
  const problem = h("p", { class: "problem", role: "alert", hidden: true });
  const status = h("output", { class: "status" });
  const drops = dropNote();
  const kept = [];
  let at = -1;
  let received = 0;
  let scheduled = 0;

  const pause = toggle("Pause", false, (on) => {
    at = on ? kept.length - 1 : -1;
    show();
  });
  const older = button("Older", () => step(-1), { "aria-label": "Older message" });
  const newer = button("Newer", () => step(1), { "aria-label": "Newer message" });
  const rate = h("select", { "aria-label": "Messages per second shown", onchange: () => subscription.update(params()) },
    RATES_HZ.map((hz) => h("option", { value: String(hz) }, `${hz} Hz`)));
  rate.value = "10";

  const element = h(
    "div",
    { class: "echo" },
    h("div", { class: "toolbar" }, searchField("Filter fields", tree.filter), pause, older, newer, rate),
    h("p", { class: "line" }, status, drops.element),
    problem,
    waiting,
    tree.element,
  );

  function params() {
    return { topic: topic.name, max_hz: Number(rate.value), max_items: 64 };
  }

  function receive(data, { dropped }) {
    received += data.messages.length;
    kept.push(...data.messages);
    const excess = kept.length - MOST_KEPT;
    if (excess > 0) {
      kept.splice(0, excess);
      if (at >= 0) at = Math.max(0, at - excess);
    }
    problem.hidden = true;
    drops.show(dropped, "only as many as chosen are shown in a second");
    if (!scheduled) scheduled = requestAnimationFrame(show);
  }

  /** -1 is the last message, whichever that is. */
  function step(by) {
    if (kept.length === 0) return;
    if (at < 0) pause.click();
    at = Math.min(Math.max(at + by, 0), kept.length - 1);
    show();
  }

  function show() {
    scheduled = 0;
    older.disabled = kept.length === 0 || at === 0;
    newer.disabled = at < 0 || at >= kept.length - 1;
    const message = kept.at(at < 0 ? -1 : at);
    waiting.hidden = Boolean(message);
    if (!message) return;
    tree.show(message.value);
    const where = at < 0 ? `${received} received` : `paused at ${at + 1} of ${kept.length}`;
    setText(status, `${timeOfDay(message.at_s)}   ${where}`);
  }

  show();
  const subscription = app.connection.subscribe("echo", params(), receive, {
    onerror(error) {
      problem.hidden = false;
      problem.textContent = error.message;
    },
  });
  return { element, end: subscription.end };
}
