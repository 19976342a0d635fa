// One number or word of the file: its text can be changed, is sent, and is refused in the file's own words.

// Characters from which a text has a line of its own.
const LONG = 15;

// `send`: a function of key, text (null takes the edit back), whether it joins the step before, and
// what to do where it is refused; false where there is no connection. `choices`: what a word may be,
// none of a number. `changed` is told when a text is refused, and when that is over.
function fieldRow({key, table, choices}, {said, send, changed}) {
  const id = `field-${key.replace(/\W/g, character => `_${character.charCodeAt(0)}`)}`;
  const path = table.replace(/^\[|\]$/g, "");
  const short = key.startsWith(`${path}.`) ? key.slice(path.length + 1) : key;
  const label = element("label", {htmlFor: id}, short.replace(/[._]/g, "$&\u200b"));
  const described = {id, "aria-describedby": `${id}-about ${id}-problem`};
  const input = choices.length
    ? element("select", described, ...choices.map(word => element("option", {value: word}, word)))
    : element("input", {
      ...described, type: "text", spellcheck: false, autocomplete: "off", autocapitalize: "off",
    });
  const unit = element("span", {className: "unit"});
  const back = element("button", {type: "button", className: "back", hidden: true}, "\u21ba");
  const about = element("p", {className: "about", id: `${id}-about`});
  const problem = element("p", {className: "problem", id: `${id}-problem`, role: "alert"});
  const row = element("div", {className: "field"}, label, input, unit, back, about, problem);
  row.dataset.key = key;
  // `touched`: what stands in the input is not what was sent, or was refused. `sending`: what the
  // studio was told and has not taken yet; `next`: what it is told after that.
  let text = "", file = null, touched = false, sending = null, next = null, steps = false;

  function refuse(words) {
    sending = next = null;
    steps = false;
    touched = true;
    problem.textContent = words;
    input.setAttribute("aria-invalid", "true");
    row.classList.remove("sending");
    changed();
  }

  function accept() {
    const was = isRefused();
    problem.textContent = "";
    input.removeAttribute("aria-invalid");
    if (was) changed();
  }

  const isRefused = () => input.hasAttribute("aria-invalid");

  function give(value, joins) {
    accept();
    if (!send(key, value, joins, problems => refuse(problemsText(problems, said)))) {
      refuse(said.not_connected);
      return;
    }
    sending = {value};
    touched = false;
    row.classList.add("sending");
  }

  function commit() {
    const typed = input.value;
    // The same again is sent again: what it was refused for may be mended.
    if (typed === (sending ? sending.value : text)) { touched = false; accept(); return; }
    steps = false;
    if (sending === null) give(typed, false);
    else next = {typed, joins: false};
  }

  function step(by) {
    const there = stepped(input.value, input.selectionEnd ?? 0, by);
    if (!there) return;
    input.value = there.text;
    input.setSelectionRange(there.from, there.to);
    const joins = steps;
    if (sending === null) give(there.text, joins);
    else next = {typed: there.text, joins: true};
    steps = true;
  }

  function takeBack() {
    input.value = text;
    touched = false;
    accept();
  }

  input.addEventListener("input", () => { touched = true; });
  input.addEventListener("change", commit);
  input.addEventListener("blur", () => { steps = false; });
  input.addEventListener("keydown", event => {
    const up = choices.length ? 0 : {ArrowUp: 1, ArrowDown: -1}[event.key];
    if (up && !event.altKey && !event.ctrlKey && !event.metaKey) {
      event.preventDefault();
      step(event.shiftKey ? 10 * up : up);
    } else if (event.key === "Escape") {
      event.preventDefault();
      takeBack();
    } else if (event.key === "Enter") {
      commit();
    }
  });
  back.addEventListener("click", () => {
    touched = false;
    give(null, false);
    input.focus();
  });

  return {
    row, input,
    // What the file has now. What somebody is typing stays.
    show(field, description) {
      ({text, file} = field);
      unit.textContent = field.unit;
      about.textContent = description;
      row.title = description;
      row.classList.toggle("edited", field.edited);
      row.classList.toggle("long", text.length > LONG);
      back.hidden = !field.edited;
      const before = file === null ? said.not_in_file : filled(said.in_file, {value: file});
      back.title = before;
      back.setAttribute("aria-label", `${key}: ${filled(said.take_back, {before})}`);
      input.setAttribute("aria-label", field.unit ? `${key}, ${field.unit}` : key);
      if (!touched && sending === null && input.value !== text) input.value = text;
    },
    // The studio has taken what was sent.
    taken() {
      if (sending === null) return;
      sending = null;
      row.classList.remove("sending");
      if (next) {
        const {typed, joins} = next;
        next = null;
        give(typed, joins);
      }
    },
    lost() { sending = next = null; steps = false; row.classList.remove("sending"); },
    // What was refused, or is being typed, goes.
    takeBack,
    isRefused,
    get text() { return text; },
  };
}
