// What was changed of the file: undone, redone, taken back, and the file that changed meanwhile.

function changesBar(find, {said, say, refused}) {
  const [undo, redo, reset] = ["undo", "redo", "reset"].map(name => {
    const button = find(name);
    button.addEventListener("click", () => say({type: name}, refused));
    return button;
  });
  const notice = find("changed");
  const again = edits => () => say({type: "reload", edits}, refused);
  find("reload").addEventListener("click", again("keep"));
  find("reload-drop").addEventListener("click", again("drop"));

  // As everywhere; where a text is being typed the keys are the text's own.
  document.addEventListener("keydown", event => {
    if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
    if (event.target.matches("input[type=text], input[type=number], input[type=search], textarea")) return;
    const key = event.key.toLowerCase();
    const asked = key === "z" ? (event.shiftKey ? "redo" : "undo") : key === "y" ? "redo" : null;
    if (!asked) return;
    event.preventDefault();
    say({type: asked}, refused);
  });

  // A button that ends while it has the focus would lose it to the page's beginning.
  function able(button, can) {
    button.setAttribute("aria-disabled", String(!can));
  }

  return {
    heard({undo: back, redo: forward, edits, file}) {
      able(undo, back > 0);
      able(redo, forward > 0);
      able(reset, edits.length > 0);
      undo.title = filled(said.steps, {count: back});
      redo.title = filled(said.steps, {count: forward});
      find("edits").textContent = edits.length
        ? filled(edits.length === 1 ? said.one_edit : said.edits, {count: edits.length})
        : said.no_edits;
      notice.hidden = !file.changed;
    },
  };
}
