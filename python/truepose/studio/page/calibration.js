// The tab of the calibration: what a dropped file of measurements says of the machine, and which
// poses to measure next.

const SHOWN_ROWS = 30;

const calibrationTab = {
  name: "calibration", asked: true,
  build(host, {said, tell, numbers, words, ask, addresses, say, dof}) {
    const drop = element("div"), body = element("div");
    const count = element("input", {type: "number", min: 1, max: 100, value: 8});
    const plan = element("form", {className: "asked"}, element("label", {}, said.plan_poses, " ", count),
      element("button", {type: "submit"}, said.plan));
    host.append(element("p", {className: "caption"}, said.calibration_caption), drop, body, plan);
    let planned = null;
    const files = droppedFiles(drop, {said, numbers, addresses, say, chosen() { planned = null; again(); }});

    function options() {
      if (files.current === null) return {};
      return {file: files.current, ...(planned ? {plan: planned} : {})};
    }

    function again() {
      plan.hidden = files.current === null;
      ask(options());
    }

    plan.addEventListener("submit", event => {
      event.preventDefault();
      planned = count.valueAsNumber;
      ask(options());
    });
    plan.hidden = true;

    const size = (value, unit) => value === null ? MISSING
      : unit === "m" ? numbers.error(value, "position") : unit === "rad" ? numbers.error(value, "orientation")
      : `${String(Number(value.toPrecision(4))).replace("-", MINUS)} ${unit}`;

    function residuals(rows) {
      const heads = [said.reading, said.line, said.pose_of, [said.residual_before, "number"],
        [said.residual_after, "number"]];
      const most = Math.max(1e-12, ...rows.flatMap(one => [one.residual, one.residual_before].map(Math.abs)));
      const arrow = value => ({className: "number", node: element("span", {
        className: "arrow", style: `--from: ${Math.min(0, value) / most}; --long: ${Math.abs(value) / most}`,
      }, numbers.fixed(value, 2))});
      return scrolling(tableOf(heads, rows.slice(0, SHOWN_ROWS).map(one => [
        one.observable, one.line, {node: tell.pose(one.pose, dof(one.pose.length))},
        arrow(one.residual_before), arrow(one.residual),
      ])), said.residuals);
    }

    function unknowns(rows) {
      const heads = [said.unknown, [said.found_value, "number"], [said.uncertainty, "number"],
        [said.uncertainty_before, "number"], [said.measured_share, "number"]];
      return scrolling(tableOf(heads, rows.slice(0, SHOWN_ROWS).map(one => [
        {text: one.label || one.name, title: one.name},
        ...["found", "uncertainty", "uncertainty_before"].map(key => (
          {text: size(one[key], one.unit), className: "number"})),
        {text: tell.percent(one.share), className: "number"},
      ])), said.unknowns);
    }

    function next({poses, rank, rms}) {
      const heads = [said.rank, said.pose_of,
        ...Object.keys(rms).map(name => [filled(said.rms_after, {quantity: tell.quantity(name)}), "number"])];
      // The one that buys most first; `rms` is after so many of them in that order.
      const order = poses.map((_, at) => at).sort((a, b) => rank[a] - rank[b]);
      const rows = order.map(at => [
        rank[at], {node: tell.goTo(poses[at])},
        ...Object.entries(rms).map(([name, values]) =>
          tell.cell(values[rank[at]] ?? null, name, `planned.${rank[at]}.${name}`)),
      ]);
      return scrolling(tableOf(heads, rows), said.planned);
    }

    const titled = (title, ...content) => [element("h3", {}, title), ...content];
    const listed = rows => element("ul", {}, ...rows.map(({sentence, refuses}) =>
      element("li", {className: refuses ? "refuses" : ""}, sentence)));

    return {
      options, body,
      heard({files: held}) { files.heard(held); plan.hidden = files.current === null; },
      show(value) {
        if (!("accepted" in value)) { body.replaceChildren(); return; }
        const {fit, suspicions, reasons} = value;
        const answer = element("p", {className: "word"}, value.answer);
        answer.dataset.of = "calibration.answer";
        const card = element("div", {className: "verdict"}, answer, reasons.length ? listed(reasons) : "");
        card.dataset.verdict = value.accepted ? "met" : "missed";
        body.replaceChildren(card,
          element("p", {className: "caption"}, filled(said.fit, {
            before: numbers.fixed(fit.rms_before, 2), after: numbers.fixed(fit.rms_after, 2),
            birge: numbers.fixed(fit.birge, 2), count: numbers.fixed(fit.observations, 0),
            freedom: numbers.fixed(fit.degrees_of_freedom, 0),
          })),
          ...titled(said.suspicions, suspicions.length ? listed(suspicions)
            : element("p", {className: "caption"}, said.no_suspicions)),
          ...titled(said.residuals, residuals(value.residuals)),
          ...titled(said.unknowns, unknowns(value.unknowns)),
          ...(value.planned ? titled(said.planned, next(value.planned)) : []));
      },
    };
  },
};
