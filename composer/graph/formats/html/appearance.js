/** Switches between the light theme, the dark theme and the theme of the operating system. */
const APPEARANCES = ["auto", "light", "dark"];

function createAppearance() {
  const button = document.getElementById("appearance");
  let index = 0;
  button.addEventListener("click", () => {
    index = (index + 1) % APPEARANCES.length;
    const appearance = APPEARANCES[index];
    if (appearance === "auto") delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = appearance;
    button.textContent = `Theme: ${appearance}`;
  });
}
