/** Shows the views as tabs, following the tabs pattern of the ARIA Authoring Practices Guide. */
export function createTabs(pictures, onChange) {
  const tabs = [...document.querySelectorAll("[role=tab]")];
  let current = pictures.find((picture) => !picture.view.hidden);

  function show(tab) {
    const next = pictures.find((picture) => picture.view.id === tab.getAttribute("aria-controls"));
    if (next === current) return;
    onChange.before();
    for (const other of tabs) {
      other.setAttribute("aria-selected", String(other === tab));
      other.tabIndex = other === tab ? 0 : -1;
    }
    for (const picture of pictures) picture.view.hidden = picture !== next;
    current = next;
    onChange.after();
  }

  tabs.forEach((tab, index) => {
    tab.addEventListener("click", () => show(tab));
    tab.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!step) return;
      const next = tabs[(index + step + tabs.length) % tabs.length];
      next.focus();
      show(next);
      event.preventDefault();
    });
  });
  return { current: () => current };
}
