// What a window shows besides: a tab at a time. Those that are `asked` the studio answers only while
// they are shown; of the others the answer is there anyway.

// `tools`: what every tab may use, and `say`, which tells the studio.
function tabsPanel({list, panels}, registry, {said, standing, tools, say, chosen}) {
  const tabs = registry.map(tab => {
    const id = `tab-${tab.name}`, answer = tab.asked ? `tab ${tab.name}` : tab.answer;
    const button = element("button", {type: "button", role: "tab", id, "aria-controls": `${id}-panel`},
      said.tabs[tab.name]);
    const body = element("div"), problem = element("p", {className: "problem"});
    const waiting = element("p", {className: "waiting"}, said.computing);
    const panel = element("div", {role: "tabpanel", id: `${id}-panel`, "aria-labelledby": id, hidden: true},
      problem, waiting, body);
    panel.dataset.tab = tab.name;
    const one = {tab, answer, button, panel, problem, body, waiting, part: null};
    list.append(button);
    panels.append(panel);
    standing.watch(body, answer);
    button.addEventListener("click", () => show(one));
    return one;
  });
  let shown = null, last = null;

  list.addEventListener("keydown", event => {
    const at = tabs.findIndex(({button}) => button === document.activeElement);
    const to = {ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: tabs.length - 1}[event.key];
    if (at < 0 || to === undefined) return;
    event.preventDefault();
    const one = tabs[(to + tabs.length) % tabs.length];
    one.button.focus();
    show(one);
  });

  function built(one) {
    if (one.part) return one.part;
    const ask = options => { one.problem.textContent = ""; tell(one, options); };
    one.part = one.tab.build(one.body, {...tools, ask});
    if (last && one.part.heard) one.part.heard(last);
    return one.part;
  }

  // Tells the studio what this window shows; of what is not asked for, nothing.
  function tell(one, options = one.part && one.part.options ? one.part.options() : {}) {
    say(one.tab.asked ? {type: "tab", name: one.tab.name, options} : {type: "tab", name: null},
      problems => failed(one, problems));
  }

  function show(one) {
    shown = one;
    for (const other of tabs) {
      other.panel.hidden = other !== one;
      other.button.setAttribute("aria-selected", String(other === one));
      other.button.tabIndex = other === one ? 0 : -1;
    }
    const part = built(one);
    if (part.redraw) part.redraw();
    standing.shows(one.answer);
    tell(one);
    chosen(one.tab.name);
    waits();
  }

  function failed(one, problems) {
    one.problem.textContent = problemsText(problems, said);
    (one.part.body || one.body).replaceChildren();
    if (!one.part.body) one.part = null;
  }

  // An answer for tabs that show it.
  function take(answer, {value, problems}) {
    for (const one of tabs.filter(each => each.answer === answer)) {
      const part = built(one);
      if (problems) failed(one, problems);
      else {
        one.problem.textContent = "";
        part.show(value);
      }
    }
    waits();
  }

  function waits() {
    for (const one of tabs) one.waiting.hidden = !standing.waits(one.answer);
  }

  return {
    take, waits,
    open(name) { show(tabs.find(({tab}) => tab.name === name) || tabs[0]); },
    // After a connection was lost: the studio knows no window any more.
    again() { if (shown) tell(shown); },
    heard(state) {
      last = state;
      for (const {part} of tabs) if (part && part.heard) part.heard(state);
    },
  };
}
