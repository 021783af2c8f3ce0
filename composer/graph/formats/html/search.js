/**
 * Search in the picture that is shown: what does not match is dimmed; Enter goes to the next match.
 *
 * A thing matches when every word is in what stands in the picture or in what is known about it.
 */
function createSearch(currentPicture, goTo) {
  const input = document.getElementById("search");
  const output = document.getElementById("matches");
  const knowledge = new Map();
  for (const article of document.querySelectorAll(".listing [data-about]")) {
    knowledge.set(article.dataset.about, article.textContent.toLowerCase());
  }
  let matches = [];
  let position = -1;

  function textOf(thing) {
    return `${thing.words.join(" ")} ${knowledge.get(thing.key) ?? ""}`.toLowerCase();
  }

  function update() {
    const picture = currentPicture();
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    matches = [];
    position = -1;
    for (const thing of picture.things.values()) {
      const visible = !thing.element.classList.contains("out");
      const found = words.length > 0 && visible && matchesAll(textOf(thing), words);
      thing.element.classList.toggle("found", found);
      thing.element.classList.remove("current");
      if (found) matches.push(thing);
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

function rank(thing, words) {
  return matchesAll(thing.words.join(" ").toLowerCase(), words) ? 0 : 1;
}
