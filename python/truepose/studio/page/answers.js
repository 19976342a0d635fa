// What the studio says over the workspace: the verdict as commanded and compensated, what it rests
// on, and where the largest errors are.

const ANSWERED = {"before compensation": "before", "after compensation": "after"};
const WORD_OF = {met: "met", "NOT met": "missed", undecided: "open"};
const WORST_ANSWER = ["missed", "open", "met"];
const NUMBERS_OF_ANSWER = {witness: "found", linear: "linear", bound: "proven"};

// `draw`: a function that draws the witness of an answer, or null.
function answersPanel({cards, strip, largest}, {words, said, tell, draw}) {
  const states = {before: words.as_commanded, after: words.compensated};

  // The word of a state by the answers of its quantities; null where it did not come yet.
  function wordOf(answers) {
    if (!answers.length) return ["computing", words.verdicts.computing];
    const asked = answers.map(({answer}) => WORD_OF[answer]).filter(Boolean);
    const word = WORST_ANSWER.find(one => asked.includes(one)) || "unasked";
    return [word, words.verdicts[word]];
  }

  function card(name, answers) {
    const [word, shown] = wordOf(answers);
    const place = element("p", {className: "word"}, shown);
    place.dataset.of = `workspace.${name}.verdict`;
    const host = element("div", {className: `verdict ${name}`},
      element("h3", {className: "question"}, element("i", {className: name}), ` ${states[name]}`), place);
    host.dataset.verdict = word;
    if (!answers.length) return host;
    const heads = ["", ...answers.map(({quantity}) => [tell.quantity(quantity), "number"])];
    const rows = Object.entries(NUMBERS_OF_ANSWER).map(([key, line]) => [
      {text: said.lines[line], title: said.line_explained[line]},
      ...answers.map(answer => ({
        ...tell.cell(answer[key].value, answer.quantity, `workspace.${name}.${line}.${answer.quantity}`,
          answer.asked),
        title: answer[key].pose ? tell.pose(answer[key].pose) : "",
      })),
    ]);
    if (answers.some(({asked}) => asked !== null)) {
      rows.push([words.lines.asked, ...answers.map(({asked, quantity}) => tell.cell(asked, quantity))]);
    }
    host.append(tableOf(heads, rows));
    for (const answer of answers) {
      const of = answers.length > 1 ? `${tell.quantity(answer.quantity)}: ` : "";
      const answered = words.verdicts[WORD_OF[answer.answer]];
      const why = answer.answer ? `${filled(said.rests, {answer: answered, on: answer.rests_on})} ` : "";
      host.append(element("p", {className: "rests"}, `${of}${why}${said.farthest_at} `,
        tell.goTo(answer.witness.pose)));
      if (answer.example) host.append(witness(name, answer));
    }
    const [{poses_used: used, poses_left_out: out}] = answers;
    host.append(element("p", {className: "rests"}, out
      ? filled(said.poses_left_out, {count: tell.numbers.fixed(used, 0), out: tell.numbers.fixed(out, 0)})
      : filled(said.poses_used, {count: tell.numbers.fixed(used, 0)})));
    return host;
  }

  // Which machine is farthest off, as the command says it, and a button that draws it.
  function witness(name, answer) {
    const {causes, centres} = answer.example;
    const line = element("p", {className: "rests"}, filled(said.witness, {causes: causes.join("; ")}));
    line.dataset.of = `workspace.${name}.example.${answer.quantity}`;
    if (draw && centres) {
      const button = element("button", {type: "button", className: "go"}, said.draw_witness);
      button.addEventListener("click", () => draw(answer));
      line.append(" ", button);
    }
    return line;
  }

  function verdict(value) {
    const by = {before: [], after: []};
    for (const answer of value) by[ANSWERED[answer.state]].push(answer);
    cards.replaceChildren(...Object.entries(by).map(([name, answers]) => card(name, answers)));
    strip.replaceChildren(...Object.entries(by).map(([name, answers]) => {
      const [word, shown] = wordOf(answers), short = element("b", {}, shown);
      short.dataset.verdict = word;
      return element("span", {}, element("i", {className: name}), ` ${states[name]}: `, short);
    }));
  }

  // The largest known error and linear maximum, where they are, and those at the pose shown.
  function known(value) {
    const heads = ["", [said.at_pose, "number"], [said.over_workspace, "number"], said.where];
    const rows = [];
    for (const [line, title, at, over] of [
      ["known", words.lines.known, value.error, value.largest],
      ["linear", said.lines.linear, value.linear_maximum, value.highest],
    ]) {
      for (const quantity of Object.keys(over)) {
        const here = !at ? null : line === "known" ? sizeOf(at, tell.components(), quantity) : at[quantity];
        rows.push([
          {text: `${title}, ${tell.quantity(quantity)}`, title: line === "known" ? words.line_explained.known
            : said.line_explained.linear},
          tell.cell(here, quantity, `studio.${line}.${quantity}`),
          tell.cell(over[quantity].value, quantity, `studio.largest.${line}.${quantity}`),
          {node: tell.goTo(over[quantity].pose)},
        ]);
      }
    }
    const pose = element("p", {className: "caption"}, `${said.pose_shown} ${tell.pose(value.pose)}`
      + (value.status === "ok" ? "" : ` \u2013 ${words.statuses[value.status] || value.status}`));
    largest.replaceChildren(scrolling(tableOf(heads, rows), said.over_workspace), pose);
  }

  // Instead of an answer: why there is none.
  const failed = host => problems => host.replaceChildren(
    element("p", {className: "problem"}, problemsText(problems, said)));

  return {
    verdict, known,
    failed: {
      verdict(problems) { failed(cards)(problems); strip.replaceChildren(said.no_answer); },
      known: failed(largest),
    },
  };
}
