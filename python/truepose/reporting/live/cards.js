// A card a state, as commanded and compensated: the word of the verdict, and the sizes behind it.

const LINES = ["known", "likely", "found", "proven", "asked"];

function cardsOf(host, strip, {states, quantities, target, words, numbers}) {
  const cards = {};
  for (const [name, title] of Object.entries(states)) {
    const cells = {};
    const rows = LINES.filter(line => line !== "asked" || Object.keys(target).length).map(line => {
      cells[line] = quantities.map(quantity => {
        const cell = element("td", {className: "number"});
        cell.dataset.of = `${name}.${line}.${quantity}`;
        return cell;
      });
      const named = element("th", {scope: "row", title: words.line_explained[line]}, words.lines[line]);
      return element("tr", {className: line}, named, ...cells[line]);
    });
    const word = element("p", {className: "word", role: "status"});
    word.dataset.of = `${name}.verdict`;
    const head = element("tr", {}, element("td"), ...quantities.map(
      quantity => element("th", {scope: "col", className: "number"}, words.quantities[quantity])));
    const card = element("div", {className: `verdict ${name}`},
      element("h3", {className: "question"}, element("i", {className: name}), ` ${title}`), word,
      element("table", {}, element("thead", {}, head), element("tbody", {}, ...rows)));
    const short = element("b");
    strip.append(element("span", {}, element("i", {className: name}), ` ${title}: `, short));
    host.append(card);
    cards[name] = {card, word, short, cells};
  }

  // `sizes`: by line and quantity; a number, null (there is none), a text, or undefined (not yet).
  // `decides`: by quantity the line that the verdict rests on.
  function show(name, verdict, said, sizes, decides) {
    const {card, word, short, cells} = cards[name];
    if (word.textContent !== said) word.textContent = said;
    short.textContent = said;
    card.dataset.verdict = short.dataset.verdict = verdict;
    for (const line in cells) {
      cells[line].forEach((cell, at) => {
        const quantity = quantities[at], value = sizes[line][quantity];
        cell.classList.toggle("said", typeof value === "string");
        cell.classList.toggle("decides", decides[quantity] === line);
        put(cell, value, value === undefined ? words.waiting
          : typeof value === "string" ? value
          : numbers.error(value, quantity, target[quantity] ?? null));
      });
    }
  }

  return {show};
}

// A text in a place, and the SI number that it says, for who reads the page by a program.
function put(cell, value, text) {
  if (cell.textContent !== text) cell.textContent = text;
  if (typeof value === "number") cell.dataset.si = value;
  else delete cell.dataset.si;
}
