// What was changed of the file: undone, redone, taken back, and the file that changed meanwhile.

// `takeBack`: what is to be done with what the fields refused.
function changesBar(find, {said, say, refused, takeBack}) {
  let changed = 0, refusals = 0;
  const [undo, redo, reset] = ["undo", "redo", "reset"].map(find);
  undo.addEventListener("click", () => say({type: "undo"}, refused));
  redo.addEventListener("click", () => say({type: "redo"}, refused));
  reset.addEventListener("click", () => {
    if (changed) say({type: "reset"}, refused);
    takeBack();
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
    // So many texts stand in fields that the file does not take.
    refused(count) {
      refusals = count;
      able(reset, changed + refusals > 0);
    },
    heard({undo: back, redo: forward, edits, file, condition}) {
      able(undo, back > 0);
      able(redo, forward > 0);
      changed = edits.length;
      able(reset, changed + refusals > 0);
      undo.title = filled(said.steps, {count: back});
      redo.title = filled(said.steps, {count: forward});
      const told = !changed ? said.no_edits
        : filled(changed === 1 ? said.one_edit : said.edits, {count: changed});
      find("edits").textContent = condition ? filled(said.other_condition, {changed: told}) : told;
      notice.hidden = !file.changed;
    },
  };
}
