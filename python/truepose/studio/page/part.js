// The tab of a part: a program of the machine's folder, and what becomes of its features.

const partTab = {
  name: "part", asked: true,
  build(host, {said, tell, numbers, words, ask}) {
    const [program, features] = ["program", "features"].map(name => {
      const files = element("datalist", {id: `studio-${name}-files`});
      const input = element("input", {type: "text", spellcheck: false, autocomplete: "off"});
      input.setAttribute("list", files.id);
      return {input, files, label: element("label", {}, said[name], " ", input, files)};
    });
    const beside = element("p", {className: "caption"});
    const offer = ({files}, names) => files.replaceChildren(...names.map(value => element("option", {value})));
    const form = element("form", {className: "asked"}, program.label, features.label,
      element("button", {type: "submit"}, said.evaluate));
    const body = element("div");
    host.append(element("p", {className: "caption"}, said.part_caption), form, beside, body);
    const options = () => Object.fromEntries([["program", program], ["features", features]].map(
      ([name, {input}]) => [name, input.value.trim()]).filter(([, value]) => value));
    form.addEventListener("submit", event => {
      event.preventDefault();
      ask(options());
    });

    // A size in its SI unit, as it is shown.
    const size = (value, unit) => unit === "rad" ? numbers.error(value, "orientation")
      : unit === "m" ? numbers.error(value, "position")
      : value === null ? MISSING : `${numbers.fixed(value, 3)} ${unit}`;

    return {
      options, body,
      show(value) {
        offer(program, value.programs);
        offer(features, value.features_files);
        beside.textContent = value.programs.length
          ? filled(said.programs_there, {names: value.programs.join(", ")}) : said.no_programs;
        if (!value.rows) { body.replaceChildren(); return; }
        const states = value.rows.length ? value.rows[0].states.map(({state}) => said.states[state] || state) : [];
        const heads = [said.feature, said.characteristic, [said.limits, "number"],
          ...states.flatMap(state => [state, [`${words.lines.known}`, "number"]])];
        const rows = value.rows.map(({feature, quantity, unit, limits, states: all}) => [
          feature, quantity, {text: limits.map(end => size(end, unit)).join(" \u2026 "), className: "number"},
          ...all.flatMap(({verdict, why, known}) => [
            {text: said.part_verdicts[verdict] || verdict, title: why},
            {text: size(known, unit), si: known ?? undefined, className: "number"},
          ]),
        ]);
        body.replaceChildren(scrolling(tableOf(heads, rows), said.tabs.part),
          element("p", {className: "caption"}, filled(said.part_points, {
            points: numbers.fixed(value.points, 0), samples: numbers.fixed(value.samples, 0),
          }), value.left_out ? ` ${filled(said.rows_left_out, {count: value.left_out})}` : ""));
      },
    };
  },
};
