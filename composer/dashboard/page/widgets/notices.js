/** Messages over the page: of an action that failed or succeeded, and questions before it. */
import { button, h } from "../dom.js";

const SHOWN_MS = 6000;

/** Show a message for some seconds; errors stay until they are closed. */
export function toast(text, { tone = "good", hint = "" } = {}) {
  const box = h(
    "div",
    { class: "toast", data: { tone }, role: tone === "bad" ? "alert" : null },
    h("div", {}, h("p", {}, text), hint && h("p", { class: "hint" }, hint)),
    button("Close", () => box.remove(), { class: "quiet" }),
  );
  document.getElementById("toasts").append(box);
  if (tone !== "bad") setTimeout(() => box.remove(), SHOWN_MS);
}

/** Run an action of a button: it is disabled meanwhile, and an error is shown. */
export async function attempt(pressed, action) {
  if (pressed.getAttribute("aria-disabled") === "true") return;
  // Not `disabled`, which takes the focus away.
  pressed.setAttribute("aria-disabled", "true");
  try {
    await action();
  } catch (error) {
    toast(error.message, { tone: "bad", hint: error.hint });
  } finally {
    pressed.removeAttribute("aria-disabled");
  }
}

/**
 * Ask before an action; return the chosen value, or null.
 *
 * `answers` are [label, value], the last one the most far-reaching.
 */
export function asked(question, { hint = "", answers }) {
  return new Promise((resolve) => {
    const dialog = h(
      "dialog",
      { "aria-label": question, onclose: () => finish() },
      h("p", {}, question),
      hint && h("p", { class: "hint" }, hint),
      h(
        "div",
        { class: "actions" },
        button("Cancel", () => dialog.close("")),
        answers.map(([label, value], index) =>
          button(label, () => dialog.close(value), { class: index === answers.length - 1 ? "danger" : null })),
      ),
    );
    function finish() {
      dialog.remove();
      resolve(dialog.returnValue || null);
    }
    document.body.append(dialog);
    dialog.showModal();
  });
}

/** Ask before an action that cannot be undone; return whether to do it. */
export async function confirmed(question, { verb, hint = "" }) {
  return (await asked(question, { hint, answers: [[verb, "yes"]] })) === "yes";
}
