// The tab of other solutions: joints that reach the pose shown in each working mode, and poses to which
// the commanded joints lead, found from many starts.

// More solutions than these have no table of how far each is from each.
const MOST_COMPARED = 16;
// Residuals are rounding: two digits say how much.
const RESIDUAL_DIGITS = 1;

const modesTab = {
  name: "modes", asked: true,
  build(host, {said, tell, numbers, ask}) {
    const body = element("div");
    const count = element("input", {type: "number", min: 1, max: 50000, value: 2000});
    const form = element("form", {className: "asked"}, element("label", {}, said.starts, " ", count),
      element("button", {type: "submit"}, said.search_again));
    host.append(element("p", {className: "caption"}, said.modes_caption), body, form);
    form.addEventListener("submit", event => {
      event.preventDefault();
      ask(options());
    });
    const options = () => ({starts: count.valueAsNumber || 0});

    const joint = (value, coordinate) => {
      const unit = numbers.ofPose(coordinate === "angle" ? "a" : "x");
      return {text: `${numbers.fixed(numbers.shown(value, unit), 3)}\u00a0${unit.label}`, si: value, className: "number"};
    };
    const residual = (value, unit) => value === null ? MISSING
      : `${value === 0 ? 0 : value.toExponential(RESIDUAL_DIGITS).replace("-", MINUS)}\u00a0${unit}`;
    const length = value => {
      const unit = numbers.ofPose("x");
      return value === null ? MISSING : `${numbers.fixed(numbers.shown(value, unit), 3)}\u00a0${unit.label}`;
    };
    const standing = status => said.standings[status] || status;
    const signs = mode => ({text: mode.replaceAll("-", MINUS), className: "signs"});

    function workingModes(value) {
      const title = element("h3", {}, said.working_modes);
      if (!value.modes.length) return [title, element("p", {}, said.no_joints)];
      const heads = [said.working_mode, ...value.joints.map(name => [name, "number"]), said.stands];
      const rows = value.modes.map(({mode, joints, status}) => [
        signs(mode), ...joints.map((one, at) => joint(one, value.coordinates[at])), standing(status),
      ]);
      const more = [
        value.has_modes ? said.modes_signs : said.no_modes,
        value.modes_left_out ? filled(said.rows_left_out, {count: value.modes_left_out}) : "",
        value.modes_unsolved ? filled(said.modes_unsolved, {count: value.modes_unsolved}) : "",
      ].filter(Boolean).join(" ");
      return [title, scrolling(tableOf(heads, rows), said.working_modes),
        element("p", {className: "caption"}, more)];
    }

    function assemblyModes({dof, forward}) {
      const title = element("h3", {}, said.assembly_modes);
      if (!forward) return [title];
      const {solutions, apart, left_out: out} = forward;
      const heads = [said.solution, said.pose_of, [said.from_commanded, "number"],
        [said.from_nearest, "number"], [said.residual, "number"], [said.joint_residual, "number"],
        said.working_mode, said.in_workspace, said.stands, [said.reached, "number"]];
      const rows = solutions.map((one, at) => [
        String(at + 1), {node: tell.pose(one.pose, dof), of: `modes.${at + 1}.pose`},
        {text: length(one.distance), si: one.distance, of: `modes.${at + 1}.distance`, className: "number"},
        {text: length(one.nearest), si: one.nearest ?? undefined, className: "number"},
        {text: residual(one.residual, "m"), si: one.residual, of: `modes.${at + 1}.residual`, className: "number"},
        {text: residual(one.joint_residual, said.si_joint), si: one.joint_residual ?? undefined, className: "number"},
        signs(one.mode),
        one.in_workspace === null ? MISSING : one.in_workspace ? said.inside : said.outside,
        standing(one.status), {text: String(one.reached), className: "number"},
      ]);
      const words = element("p", {}, filled(said.not_complete, {
        found: numbers.fixed(forward.found, 0), starts: numbers.fixed(forward.starts, 0),
        converged: numbers.fixed(forward.converged, 0),
      }));
      words.dataset.of = "modes.words";
      const made = [title, words, scrolling(tableOf(heads, rows), said.assembly_modes)];
      if (out) made.push(element("p", {className: "caption"}, filled(said.rows_left_out, {count: out})));
      if (solutions.length > 2 && solutions.length <= MOST_COMPARED) {
        const numbered = solutions.map((_, at) => [String(at + 1), "number"]);
        made.push(element("h3", {}, said.apart), scrolling(tableOf([said.solution, ...numbered],
          apart.map((row, at) => [String(at + 1), ...row.map(value => (
            {text: length(value), si: value, className: "number"}))])), said.apart));
      }
      made.push(element("p", {className: "caption"}, said.apart_caption));
      return made;
    }

    return {
      options, body,
      show(value) { body.replaceChildren(...workingModes(value), ...assemblyModes(value)); },
    };
  },
};
