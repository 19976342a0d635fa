// The tab of studies: the variants of a store in the machine's folder, how large their errors are over
// what was varied, and a button that sets one.

const studiesTab = {
  name: "studies", asked: true,
  build(host, {said, words, tell, numbers, say, ask}) {
    const store = element("select", {"aria-label": said.study}), axis = element("select", {"aria-label": said.parameter});
    const quantity = element("select", {"aria-label": said.quantity});
    const canvas = element("canvas", {role: "img", "aria-label": said.tabs.studies});
    const chart = element("div", {className: "live-canvas low"}, canvas), plane = canvasOf(canvas);
    const form = element("p", {className: "asked"}, element("label", {}, said.study, " ", store));
    const over = element("p", {className: "caption"}), figure = element("div", {}, over, chart,
      element("p", {className: "caption"}, said.study_dots));
    const body = element("div"), notes = element("div");
    host.append(element("p", {className: "caption"}, said.studies_caption), form, notes, figure, body);
    let state = null, shown = null, chosen = null;
    const options = () => chosen ? {store: chosen} : {};
    store.addEventListener("change", () => { chosen = store.value || null; ask(options()); });
    for (const select of [axis, quantity]) select.addEventListener("change", draw);
    new ResizeObserver(draw).observe(chart);

    function fill(select, names, label = name => name) {
      const before = select.value;
      select.replaceChildren(...names.map(name => element("option", {value: name}, label(name))));
      if (names.includes(before)) select.value = before;
    }

    // Each variant is a dot, the best one filled; what is asked is a line.
    function draw() {
      const study = shown && shown.study;
      if (!study || !study.drawn.numbers.length || !axis.value) { plane.begin(); return; }
      const asked = study.asked[quantity.value], across = study.drawn.axes[axis.value];
      const sizes = study.drawn.sizes[quantity.value], [low, high] = [Math.min(...across), Math.max(...across)];
      const chart = chartOf(plane, numbers, quantity.value, Math.max(...sizes, asked || 0));
      const x = value => chart.x(high > low ? (value - low) / (high - low) : 0.5);
      const unit = study.units[study.variables.indexOf(axis.value)];
      const ends = high > low ? [[low, "left"], [(low + high) / 2, "center"], [high, "right"]] : [[low, "center"]];
      for (const [value, align] of ends) {
        plane.text(`${numbers.fixed(Number(value.toPrecision(4)), placesOf(value))} ${unit}`, [x(value), chart.low], "quiet", {align});
      }
      if (asked) plane.line(chart.ends(asked), "strong", 1.5, {dash: [6, 4]});
      const dot = (at, ...look) => {
        if (sizes[at] !== null) plane.dot([x(across[at]), chart.y(sizes[at])], ...look);
      };
      for (let at = 1; at < sizes.length; at++) dot(at, 3, "before");
      dot(0, 6, "after", "strong");
    }

    const placesOf = value => {
      const [, places = ""] = String(Number(value.toPrecision(4))).split(".");
      return places.includes("e") ? 6 : places.length;
    };

    // One step to be undone: what is changed now, taken back, and the values of the variant.
    function set({settings}) {
      const study = shown.study, back = state.edits.map(([key]) => [key, null]);
      const values = study.variables.map((key, at) => [key, settings[at]]);
      say({type: "edit", edits: [...back, ...study.settings, ...values]});
    }

    function button(row) {
      const made = element("button", {type: "button", className: "go", title: said.study_set_about}, said.study_set);
      made.dataset.variant = row.number;
      made.addEventListener("click", () => set(row));
      return made;
    }

    function table({variables, units, rows}) {
      const [first] = rows, quantities = tell.quantities();
      const states = Object.keys(first.answers || {});
      const heads = [said.variant, ...variables.map((key, at) => units[at] ? `${key} [${units[at]}]` : key),
        ...states.map(name => said.states[name] || name),
        ...["known", "linear_maximum"].filter(name => first[name]).flatMap(name => quantities.map(
          kind => [`${name === "known" ? words.lines.known : said.lines.linear}, ${tell.quantity(kind)}`, "number"])), ""];
      const lines = rows.map(row => [
        {text: String(row.number), of: `study.${row.number}`},
        ...row.settings.map((text, at) => units[at] ? text.replace(` ${units[at]}`, "") : text),
        ...states.map(name => row.answers[name].map(word => said.part_verdicts[word] || MISSING).join(" / ")),
        ...["known", "linear_maximum"].filter(name => row[name]).flatMap(name => quantities.map(
          kind => tell.cell(row[name][kind], kind, `study.${row.number}.${name}.${kind}`))),
        {node: button(row)},
      ]);
      return scrolling(tableOf(heads, lines), said.tabs.studies);
    }

    function show(value) {
      shown = value;
      const {stores, study} = value;
      form.hidden = !stores.length;
      store.replaceChildren(element("option", {value: ""}, MISSING),
        ...stores.map(name => element("option", {value: name}, name)));
      store.value = study ? study.store : "";
      notes.replaceChildren();
      body.replaceChildren();
      figure.hidden = true;
      if (!stores.length) {
        notes.append(element("p", {}, said.studies_none), element("pre", {tabIndex: 0},
          `truepose study ${state.file.name} --vary "strut.*.stiffness=30:120:4 N/um" --output study.zarr`));
      }
      if (value.stores_left_out) {
        notes.append(element("p", {className: "caption"}, filled(said.stores_left_out, {count: value.stores_left_out})));
      }
      if (!study) return;
      const counts = Object.entries(study.counts).filter(([, count]) => count).map(
        ([word, count]) => `${numbers.fixed(count, 0)} ${said.study_status[word]}`).join(", ");
      notes.append(element("p", {className: "says"}, filled(said.study_statuses, {
        variants: numbers.fixed(study.variants, 0), counts,
      })));
      if (state.file.hash !== study.machine_hash) notes.append(element("p", {className: "problem"}, said.study_other));
      const axes = Object.keys(study.drawn.axes);
      figure.hidden = !axes.length;
      if (axes.length) {
        fill(axis, axes);
        fill(quantity, Object.keys(study.drawn.sizes), tell.quantity);
        over.replaceChildren(...inserted(said.study_over, quantity), " ", axis);
        canvas.setAttribute("aria-label", filled(said.study_over, {quantity: tell.quantity(quantity.value)}));
        draw();
      }
      if (study.rows.length) body.append(table(study));
      if (study.left_out) body.append(element("p", {className: "caption"}, filled(said.rows_left_out, {count: study.left_out})));
      if (study.causes.length) {
        body.append(element("h3", {}, said.study_causes), element("ul", {}, ...study.causes.map(
          ({status, count, first, reason}) => element("li", {},
            `${numbers.fixed(count, 0)} ${said.study_status[status]}: ${said.variant} ${first}, ${reason}`))));
      }
    }

    return {options, body, show, redraw: draw, heard(message) { state = message; }};
  },
};

// A sentence with a control in place of {quantity}.
function inserted(sentence, node) {
  const [before, after = ""] = sentence.split("{quantity}");
  return [before, node, after];
}
