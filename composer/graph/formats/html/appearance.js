/** Switches between the light theme, the dark theme and the theme of the operating system. */
const APPEARANCES = ["auto", "light", "dark"];

export function createAppearance(button, { start = "auto", changed = () => {} } = {}) {
  let index = Math.max(APPEARANCES.indexOf(start), 0);

  function show() {
    const appearance = APPEARANCES[index];
    if (appearance === "auto") delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = appearance;
    button.textContent = `Theme: ${appearance}`;
    changed(appearance);
  }

  button.addEventListener("click", () => {
    index = (index + 1) % APPEARANCES.length;
    show();
  });
  if (index > 0) show();
}
