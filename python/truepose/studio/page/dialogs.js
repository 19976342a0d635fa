// The difference to the file, and the file with its edits under another name.

function dialogs(find, {said, say, place}) {
  const difference = find("difference-dialog"), save = find("save-dialog");
  const [name, replace, answer, text] =
    ["save-name", "save-replace", "save-answer", "difference-text"].map(find);
  const open = (dialog, first) => () => { if (first() !== false) dialog.showModal(); };
  let file = "";

  find("difference").addEventListener("click", open(difference, () => {
    text.replaceChildren(said.computing);
    return say({type: "difference"}, problems => { text.textContent = problemsText(problems, said); });
  }));
  find("save").addEventListener("click", open(save, () => {
    answer.replaceChildren();
    if (!name.value) name.value = file.replace(/(\.toml)?$/, "_edited$1");
    replace.checked = false;
  }));
  for (const dialog of [difference, save]) {
    dialog.querySelector("[data-close]").addEventListener("click", () => dialog.close());
  }
  find("save-form").addEventListener("submit", event => {
    event.preventDefault();
    answer.className = "";
    answer.textContent = said.computing;
    const message = {type: "save", name: name.value.trim(), replace: replace.checked};
    if (!say(message, failed)) failed(null);
  });

  function failed(problems) {
    answer.className = "problem";
    answer.textContent = problems ? problemsText(problems, said) : said.not_connected;
  }

  // Lines that came and went have a colour, and their sign.
  function lineOf(line) {
    const kind = line.startsWith("@@") ? "place" : /^(\+\+\+|---)/.test(line) ? "names"
      : line.startsWith("+") ? "came" : line.startsWith("-") ? "went" : "";
    return element("span", {className: kind}, line + "\n");
  }

  return {
    heard(message) {
      file = message.file.name;
    },
    difference({text: lines, cut}) {
      text.replaceChildren(...(lines
        ? lines.replace(/\n$/, "").split("\n").map(lineOf) : [said.no_difference]),
      ...(cut ? [said.cut] : []));
    },
    saved({name: saved}) {
      const command = `truepose report ${/^[\w./-]+$/.test(saved) ? saved : `'${saved.replaceAll("'", "'\\''")}'`}`;
      answer.className = "";
      answer.replaceChildren(
        element("span", {}, filled(said.saved, {name: saved})), element("br"),
        said.report_command, " ", element("code", {}, command));
      place.dataset.saved = saved;
    },
  };
}
