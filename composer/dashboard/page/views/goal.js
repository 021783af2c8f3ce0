/** A goal of an action, from the request to its result. */
import { button, h, setText } from "../dom.js";
import { duration, number } from "../format.js";
import { createMessageTree } from "../widgets/message.js";
import { attempt, toast } from "../widgets/notices.js";

const ENDED = ["succeeded", "canceled", "aborted", "failed"];
const TONES = { succeeded: "good", canceled: "warn", aborted: "bad", failed: "bad" };
/** Fields of feedback that say how far a goal is: a share, or what is left of the first value. */
const SHARE = /(progress|percent|percentage|fraction|completion)/i;
const LEFT = /(remaining|left|to_go)/i;

export function createGoal(app, { action, type, goal }) {
  const status = h("span", { class: "goal-status", data: { tone: "none" } }, "sent");
  const elapsed = h("span", { class: "muted" });
  const cancel = button("Cancel", () => attempt(cancel, () => app.connection.request("cancel", { sub: subscription.sub() })));
  const progress = h("progress", { "aria-label": `Progress of the goal for ${action}`, max: "1" });
  const feedback = createMessageTree();
  const result = h("div");
  const element = h(
    "section",
    { class: "goal", "aria-label": "Goal" },
    h("header", {}, status, elapsed, cancel),
    progress,
    feedback.element,
    result,
  );
  const start = performance.now();
  const ticking = setInterval(() => setText(elapsed, duration((performance.now() - start) / 1000)), 1000);
  let first = null;

  function receive(data, { ended }) {
    showStatus(data.status);
    if (data.feedback) {
      feedback.show(data.feedback);
      showProgress(data.feedback);
    }
    if (data.result) {
      const tree = createMessageTree();
      tree.show(data.result);
      result.replaceChildren(h("h4", {}, "Result"), tree.element);
    }
    if (ended) end();
  }

  function showStatus(text) {
    setText(status, text);
    status.dataset.tone = TONES[text] ?? "none";
    if (ENDED.includes(text)) end();
  }

  function showProgress(value) {
    for (const [name, part] of Object.entries(value)) {
      if (typeof part !== "number") continue;
      if (SHARE.test(name)) progress.value = part > 1 ? part / 100 : part;
      else if (LEFT.test(name)) {
        first = Math.max(first ?? part, part);
        progress.value = first > 0 ? 1 - part / first : 1;
      } else continue;
      progress.title = `${name} ${number(part)}`;
      return;
    }
  }

  function end() {
    clearInterval(ticking);
    setText(elapsed, duration((performance.now() - start) / 1000));
    cancel.hidden = true;
    progress.hidden = true;
  }

  const subscription = app.connection.subscribe("goal", { action, type, goal }, receive, {
    once: true,
    onerror(error) {
      showStatus("failed");
      result.replaceChildren(h("p", { class: "problem" }, error.message));
      if (!element.isConnected) toast(`${action}: ${error.message}`, { tone: "bad" });
    },
  });
  return element;
}
