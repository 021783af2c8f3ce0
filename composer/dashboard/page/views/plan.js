/** The plan of the bring-up with the cause of each step, and the drift against the declaration. */
import { breakable, button, empty, h } from "../dom.js";
import { pathOf } from "../router.js";
import { attempt } from "../widgets/notices.js";
import { facts } from "../widgets/parts.js";

export function createPlan(app) {
  const content = h("div", { class: "scroll padded", tabindex: "-1" });
  const again = button("Compare again", () => attempt(again, drift));
  let tab = "";

  async function load(what, waiting, draw) {
    content.replaceChildren(empty(waiting));
    try {
      const found = await app.connection.request(what);
      if (what === tab) content.replaceChildren(draw(found));
    } catch (error) {
      if (what === tab) content.replaceChildren(empty(error.message, error.hint || "Start the dashboard with the file of the system: compose dashboard FILE"));
    }
  }

  function plan() {
    return load("plan", "Loading the plan …", ({ steps }) => h(
      "table",
      { class: "data plan", "aria-label": "Plan of the bring-up" },
      h("thead", {}, h("tr", {}, ["Step", "Node", "Transition", "Because"].map((text, index) => h("th", { scope: "col", class: index === 0 ? "number" : null }, text)))),
      h("tbody", {}, steps.map((step) => h(
        "tr",
        {},
        h("td", { class: "number" }, String(step.number)),
        h("th", { scope: "row" }, h("a", { href: pathOf("nodes", step.node) }, breakable(step.node))),
        h("td", {}, step.transition),
        h("td", { class: "wrap" }, step.cause, step.after?.length ? h("span", { class: "muted" }, ` after step ${step.after.join(", ")}`) : null),
      ))),
    ));
  }

  function drift() {
    return load("drift", "Comparing the running system with its file …", ({ differences }) => h(
      "div",
      {},
      h("div", { class: "toolbar" }, again),
      differences.length === 0 ? empty("The running system is as declared.") : null,
      differences.map((one) => h(
        "div",
        { class: "record drift" },
        h("h4", {}, one.node ? h("a", { href: pathOf("nodes", one.node) }, one.node) : one.subject, " ", h("span", {}, one.kind)),
        h("p", {}, one.message),
        facts([["declared", one.declared], ["running", one.live], ["declared at", one.declared_at], ["hint", one.hint]]),
      )),
    ));
  }

  function show(wanted) {
    tab = wanted;
    if (wanted === "drift") drift();
    else plan();
  }

  return { element: content, show };
}
