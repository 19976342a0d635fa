// Tables of numbers, and places that are gone to.

// `heads`: texts, or [text, class]; rows of cells: a text, or {text, si, of, className, node, title}.
// The first cell of a row is its head.
function tableOf(heads, rows, caption) {
  const cellOf = (cell, at) => {
    const {text = "", si, of, className = "", node, title = ""} =
      typeof cell === "object" && cell !== null ? cell : {text: cell};
    const made = element(at ? "td" : "th", {className, title, ...(at ? {} : {scope: "row"})});
    if (node) made.append(...[node].flat());
    else put(made, si, String(text));
    if (of) made.dataset.of = of;
    return made;
  };
  const headOf = head => {
    const [text, className = ""] = [head].flat();
    return element("th", {scope: "col", className}, text);
  };
  return element("table", {},
    ...(caption ? [element("caption", {className: "hidden"}, caption)] : []),
    element("thead", {}, element("tr", {}, ...heads.map(headOf))),
    element("tbody", {}, ...rows.map(row => element("tr", {}, ...row.map(cellOf)))));
}

// A table in a place that scrolls by itself, and can be reached by keys.
function scrolling(table, label) {
  return element("div", {className: "scroll", tabIndex: 0, role: "group", "aria-label": label}, table);
}

// Numbers of this machine in its units. `machine`: a function, what `state` says of it.
function tellerOf({numbers, words, said, machine, go}) {
  const quantity = name => words.quantities[name] || name;
  const cell = (value, name, of, compared = null) =>
    ({text: numbers.error(value, name, compared), si: value ?? undefined, of, className: "number"});

  // A pose in words: x 101.6 mm, a -10 deg.
  function pose(values, names = machine().commanded) {
    return names.map((name, at) => {
      const unit = numbers.ofPose(name), value = values[at];
      const shown = value === null ? MISSING
        : numbers.fixed(numbers.shown(value, unit), 3).replace(/([.,]\d*?)0+$/, "$1").replace(/[.,]$/, "");
      return `${name}\u00a0${shown}\u00a0${unit.label}`;
    }).join(", ");
  }

  // A button that goes to a pose.
  function goTo(values) {
    if (!values || values.some(value => value === null)) return "";
    const button = element("button", {type: "button", className: "go", title: said.go_there},
      pose(values));
    button.addEventListener("click", () => go(values));
    return button;
  }

  const percent = (share, decimals = 1) =>
    share === null || share === undefined ? MISSING : `${numbers.fixed(100 * share, decimals)}\u00a0%`;

  return {quantity, cell, pose, goTo, percent, numbers};
}
