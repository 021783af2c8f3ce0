/**
 * Searches the visible picture. Items that do not match are dimmed; Enter goes to the next match.
 *
 * An item matches if its text in the picture or its details, which `detailsOf` returns for its key
 * in lower case, contain every word.
 */
export function createSearch({ input, output }, currentPicture, { detailsOf, goTo }) {
  let matches = [];
  let position = -1;

  function textOf(item) {
    return `${item.words.join(" ")} ${detailsOf(item.key)}`.toLowerCase();
  }

  function update() {
    const picture = currentPicture();
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    matches = [];
    position = -1;
    for (const item of picture.items.values()) {
      const visible = !item.element.classList.contains("out");
      const found = words.length > 0 && visible && matchesAll(textOf(item), words);
      item.element.classList.toggle("found", found);
      item.element.classList.remove("current");
      if (found) matches.push(item);
    }
    // Matches in names rank above matches in details.
    matches.sort((one, other) => rank(one, words) - rank(other, words));
    picture.svg.classList.toggle("searching", words.length > 0);
    report(words.length > 0);
  }

  function step(by) {
    if (matches.length === 0) return;
    matches[position]?.element.classList.remove("current");
    position = (position + by + matches.length) % matches.length;
    matches[position].element.classList.add("current");
    goTo(matches[position]);
    report(true);
  }

  function report(asked) {
    const where = position < 0 ? `${matches.length} found` : `${position + 1} of ${matches.length}`;
    output.textContent = asked ? where : "";
  }

  function clear() {
    input.value = "";
    update();
  }

  input.addEventListener("input", update);
  input.addEventListener("keydown", (event) => {
    if (event.key === "Enter") step(event.shiftKey ? -1 : 1);
    else if (event.key === "Escape") clear();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  return { focus: () => input.select(), update, clear };
}

function matchesAll(text, words) {
  return words.every((word) => text.includes(word));
}

function rank(item, words) {
  return matchesAll(item.words.join(" ").toLowerCase(), words) ? 0 : 1;
}
