/**
 * Keeps the focus when the control that has it is replaced, removed, hidden or disabled: otherwise, users
 * of a keyboard would start again at the top of the page.
 */
const FOCUSABLE = "a[href], button, input, select, summary, textarea, [tabindex]";
const MOST_VISITED = 8;

export function keepFocus() {
  const main = document.getElementById("main");
  /** The controls that had the focus, the latest first. */
  let visited = [];
  /** The name of the latest, and the elements around it, from the inside to the outside. */
  let name = "";
  let around = [];

  document.addEventListener("focusin", ({ target }) => {
    visited = [target, ...visited.filter((one) => one !== target)].slice(0, MOST_VISITED);
    name = nameOf(target);
    around = ancestorsOf(target);
  });
  // A click where no control is takes the focus away on purpose.
  document.addEventListener("pointerdown", () => setTimeout(() => {
    if (document.activeElement === document.body && isUsable(visited[0])) visited = [];
  }));
  new MutationObserver(restore).observe(document.body, {
    subtree: true,
    childList: true,
    attributeFilter: ["hidden", "disabled"],
  });

  function restore() {
    const [last] = visited;
    if (!last || (document.activeElement === last && isUsable(last))) return;
    const next = [last, near(last), ...visited, main].find((one) => isUsable(one) && one.checkVisibility());
    next.focus({ preventScroll: true });
  }

  /**
   * Return what is like a control, or else near it. Next to a disabled control is one for the same
   * thing; one that is gone has served the first of those around it.
   */
  function near(control) {
    for (const place of around) {
      if (!isUsable(place)) continue;
      if (place === main) return main;
      const others = [...place.querySelectorAll(FOCUSABLE)].filter((one) => isUsable(one) && one.checkVisibility());
      const same = others.find((one) => nameOf(one) === name);
      if (same) return same;
      const inOrder = others.filter((one) => one.tabIndex >= 0);
      if (inOrder.length > 0) return (isShown(control) && inOrder.find((one) => isAfter(one, control))) || inOrder[0];
    }
    return null;
  }
}

function isUsable(control) {
  return isShown(control) && !control.disabled;
}

function isShown(control) {
  return Boolean(control?.isConnected) && !control.closest("[hidden]");
}

function isAfter(one, other) {
  return Boolean(other.compareDocumentPosition(one) & Node.DOCUMENT_POSITION_FOLLOWING);
}

function ancestorsOf(element) {
  const found = [];
  for (let one = element.parentElement; one && one !== document.body; one = one.parentElement) found.push(one);
  return found;
}

/** Return what a control is recognized by after its place has been filled again. */
function nameOf(control) {
  return [
    control.tagName,
    control.dataset.key ?? control.getAttribute("aria-label") ?? control.labels?.[0]?.textContent ?? control.textContent,
  ].join(" ");
}
