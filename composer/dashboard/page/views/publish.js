/** Publishes messages from a form: once, or repeatedly until it is stopped or left. */
import { button, empty, h, setText } from "../dom.js";
import { createForm } from "../widgets/form.js";
import { attempt, toast } from "../widgets/notices.js";

export function createPublish(app, topic) {
  const element = h("div", { class: "publish" }, empty("Loading the type …"));
  const [type] = topic.types;
  let repeating = null;

  async function load() {
    try {
      const { parts } = await app.connection.request("form", { type });
      build(parts.message);
    } catch (error) {
      element.replaceChildren(empty("There is no form for this type.", error.message));
    }
  }

  function build(fields) {
    const status = h("output", { class: "status" });
    const rate = h("input", { type: "number", min: "0.1", max: "100", step: "any", value: "1", class: "narrow", "aria-label": "Rate in Hz" });
    const once = button("Publish", () => attempt(once, publishOnce), { class: "primary", type: "submit" });
    const repeat = button("Repeat", () => (repeating ? stop() : start()));
    const form = createForm(fields, { label: `Message for ${topic.name}`, submit: once, extras: [rate, "Hz", repeat] });
    form.element.addEventListener("submit", (event) => event.preventDefault());
    element.replaceChildren(form.element, h("p", { class: "line" }, status));

    async function publishOnce() {
      const message = form.value();
      if (!message) return;
      const { subscriptions } = await app.connection.request("publish", { topic: topic.name, type, message });
      toast(`Published on ${topic.name} to ${counted(subscriptions)}`);
    }

    function start() {
      const message = form.value();
      if (!message || !rate.reportValidity()) return;
      const params = { topic: topic.name, type, message, rate_hz: Number(rate.value) };
      repeating = app.connection.subscribe("publishing", params, ({ count, subscriptions }) => {
        setText(status, `${count} published to ${counted(subscriptions)}`);
      }, {
        once: true,
        onerror(error) {
          stop();
          toast(error.message, { tone: "bad", hint: error.hint });
        },
      });
      repeat.textContent = "Stop";
    }

    function stop() {
      repeating?.end();
      repeating = null;
      repeat.textContent = "Repeat";
    }
  }

  load();
  return { element, end: () => repeating?.end() };
}

function counted(subscriptions) {
  return `${subscriptions} subscription${subscriptions === 1 ? "" : "s"}`;
}
