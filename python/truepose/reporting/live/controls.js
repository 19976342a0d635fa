// Sliders, each with its number beside it, which can be typed.

const WORLD = ["x", "y", "z"];
// How far beyond the workspace a pose may be asked, of its width.
const BEYOND = 0.25;
const STEPS = 200;

function element(name, attributes = {}, ...content) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key in made && key !== "list") made[key] = value;
    else made.setAttribute(key, value);
  }
  made.append(...content);
  return made;
}

// A slider of `get` and `set`, both SI. `ends`: a function, `low` and `high` of it, SI too, and `marks`,
// where ticks are.
function slider({name, label, unit, ends, get, set, numbers}) {
  const id = `live-${name.replace(/\W/g, "-")}`, ticks = element("datalist", {id: `${id}-marks`});
  const full = unit.label ? `${label}, ${unit.label}` : label;
  const range = element("input", {type: "range", id, "aria-label": full});
  const number = element("input", {type: "number", step: "any", "aria-label": full});
  let least, most, decimals, fitted = "";
  // Where the range was put, which moves nothing that stands there already: a browser lays it out anew.
  let placed = NaN;
  fit();
  const row = element(
    "div", {className: "live-slider"},
    element("label", {htmlFor: id}, label.replace(/[._]/g, "$&\u200b")), range, number,
    element("span", {className: "unit"}, unit.label),
    ...(ticks.childElementCount ? [ticks] : []),
  );
  row.dataset.of = name;

  // As long as its ends are.
  function fit() {
    const {low, high, marks = []} = ends();
    const told = String([low, high, marks]);
    if (told === fitted) return;
    [fitted, placed] = [told, NaN];
    [least, most] = [low, high].map(value => numbers.shown(value, unit));
    const step = roundUp((most - least) / STEPS * 0.999);
    decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    least = Math.floor(least / step + 1e-9) * step;
    most = Math.ceil(most / step - 1e-9) * step;
    Object.assign(range, {min: least, max: most, step});
    if (marks.length) range.setAttribute("list", ticks.id);
    ticks.replaceChildren(...marks.map(at => element("option", {value: numbers.shown(at, unit)})));
  }

  function show(besides) {
    const value = get(), shown = value === null ? null : numbers.shown(value, unit);
    const place = shown === null ? (least + most) / 2 : shown;
    if (besides !== range && place !== placed) range.value = placed = place;
    if (besides !== number) {
      const text = shown === null ? "" : String(Number(shown.toFixed(decimals + 1)));
      if (number.value !== text) number.value = text;
    }
    const said = shown === null ? MISSING : `${numbers.fixed(shown, decimals)} ${unit.label}`;
    if (range.getAttribute("aria-valuetext") !== said) range.setAttribute("aria-valuetext", said);
  }
  for (const input of [range, number]) {
    input.addEventListener("input", () => {
      const typed = input.valueAsNumber;
      if (input === range) placed = NaN;
      if (Number.isFinite(typed)) set(numbers.meant(typed, unit), input);
    });
  }
  number.addEventListener("change", () => show());
  return {row, show, fit, range, low: numbers.meant(least, unit), high: numbers.meant(most, unit)};
}

// All controls of a state; `changed` is called at every step of one. `bundle`: a function, that of the
// machine, of which others than `rowsOf` says may change.
function controlsOf({bundle, components, commanded, state, words, numbers, changed}) {
  const {units, workspace, parts} = bundle(), [, moment] = wrenchOf(bundle());
  const NUMBER = {label: "\u00d7", si: 1};
  const all = [];
  const ranges = [];

  function add(host, options) {
    const made = slider({...options, numbers, set: (value, input) => {
      options.set(value);
      for (const other of all) other.show(other === made ? input : null);
      changed();
    }});
    all.push(made);
    host.append(made.row);
    return made;
  }

  const size = widthOf(workspace, commanded) || 1;
  const pose = element("div");
  commanded.forEach((name, at) => {
    const [low, high] = [workspace.low[at], workspace.high[at]], span = high - low;
    const unit = numbers.ofPose(name);
    const room = span > 0 ? BEYOND * span : numbers.isLength(name) ? size / 2 : 0.2;
    ranges.push(add(pose, {
      name: `pose.${name}`, label: name, unit,
      ends: () => ({low: low - room, high: high + room, marks: span > 0 ? [low, high] : []}),
      get: () => state.pose[at], set: value => { state.pose[at] = value; },
    }));
  });

  const temperature = element("div");
  if (parts.length) {
    const common = {unit: units.temperature, ends: () => temperatureEnds(bundle())};
    add(temperature, {
      ...common, name: "temperature", label: words.all_parts,
      get: () => {
        const values = parts.map(({part}) => state.condition.temperature[part]);
        return values.every(value => value === values[0]) ? values[0] : null;
      },
      set: value => {
        for (const {part} of parts) state.condition.temperature[part] = value;
      },
    });
    if (parts.length > 1) {
      const each = element("details", {open: parts.length <= 4},
        element("summary", {}, words.each_part));
      for (const {part, label} of parts) {
        add(each, {
          ...common, name: `temperature.${part}`, label: label || part,
          get: () => state.condition.temperature[part],
          set: value => { state.condition.temperature[part] = value; },
        });
      }
      temperature.append(each);
    }
  }

  const load = element("div");
  const wrench = (host, index, name, label, unit, mostOf) => add(host, {
    name, label, unit, ends: () => {
      const most = mostOf();
      return {low: -most, high: most, marks: [0]};
    },
    get: () => state.condition.wrench[index],
    set: value => { state.condition.wrench[index] = value; },
  });
  const mostForce = () => roundUp(3 * Math.hypot(...wrenchOf(bundle())[0])) || 1000;
  const mostMoment = () => roundUp(
    Math.max(3 * Math.hypot(...wrenchOf(bundle())[1]), 0.2 * size * mostForce()));
  const turning = element("details", {open: moment.some(Boolean)},
    element("summary", {}, words.moment));
  WORLD.forEach((axis, at) => {
    if (components.includes(axis)) {
      const label = filled(words.force_along, {axis});
      wrench(load, at, `force.${axis}`, label, units.force, mostForce);
    }
  });
  WORLD.forEach((axis, at) => {
    if (components.includes(`r${axis}`)) {
      const label = filled(words.moment_about, {axis});
      wrench(turning, 3 + at, `moment.${axis}`, label, units.moment, mostMoment);
    }
  });
  if (turning.childElementCount > 1) load.append(turning);

  const tolerance = element("div");
  for (const group of groupsOf(bundle())) {
    add(tolerance, {
      name: `tolerance.${group}`, label: group, unit: NUMBER,
      ends: () => ({low: 0, high: 3, marks: [1]}),
      get: () => state.scale.half_width[group],
      set: value => { state.scale.half_width[group] = Math.max(0, value); },
    });
  }
  if (yields(bundle())) {
    add(tolerance, {
      name: "stiffness", label: words.stiffness, unit: NUMBER,
      ends: () => ({low: 0.1, high: 3, marks: [1]}),
      get: () => 1 / state.scale.compliance,
      set: value => { state.scale.compliance = 1 / Math.max(0.01, value); },
    });
  }

  return {
    groups: [
      [words.pose, pose], [words.temperature, temperature],
      [words.load, load], [words.factors, tolerance],
    ].filter(([, host]) => host.childElementCount),
    ranges,
    show: () => all.forEach(one => one.show()),
    // Ends as they are in the condition of another machine of the same rows.
    fit: () => all.forEach(one => one.fit()),
  };
}

// Which controls there are, and how many: machines that have it in common have the same ones.
function rowsOf(bundle) {
  return JSON.stringify([bundle.parts, groupsOf(bundle), yields(bundle), wrenchOf(bundle)[1].some(Boolean)]);
}

const groupsOf = ({variables}) => [...new Set(variables.map(({group}) => group))];
const yields = ({compliance: {own, shared, limbs}}) => Boolean(own.length || shared.length || limbs);
// Force and moment of the file.
const wrenchOf = ({condition: {wrench}}) => [wrench.slice(0, 3), wrench.slice(3)];

function temperatureEnds(bundle) {
  const {condition, parts, reference_temperature: reference} = bundle;
  const known = parts.map(({part}) => temperatureOf(condition, part, bundle));
  return {
    low: Math.min(reference, ...known) - 20, high: Math.max(reference, ...known) + 20, marks: [reference],
  };
}

// How wide the workspace is along the longest of its lengths, m.
function widthOf({low, high}, commanded) {
  return Math.max(...commanded.map((name, at) => WORLD.includes(name) ? high[at] - low[at] : 0));
}

function temperatureOf(condition, part, bundle) {
  const known = condition.temperature[part];
  return known === undefined ? bundle.reference_temperature : known;
}

// The state that the file describes, at its home pose.
function asInTheFile(bundle) {
  const {condition, parts, variables, workspace} = bundle;
  const groups = new Set(variables.map(({group}) => group));
  return {
    pose: [...workspace.home],
    condition: {
      temperature: Object.fromEntries(
        parts.map(({part}) => [part, temperatureOf(condition, part, bundle)])),
      wrench: [...condition.wrench],
    },
    scale: {half_width: Object.fromEntries([...groups].map(group => [group, 1])), compliance: 1},
  };
}

// The same with another pose and another condition, each null where it is the file's, as far as this
// machine has them.
function shownOf(bundle, {pose, condition}) {
  const state = asInTheFile(bundle);
  if (pose && pose.length === state.pose.length) state.pose = [...pose];
  if (condition) {
    for (const part in state.condition.temperature) {
      if (part in condition.temperature) state.condition.temperature[part] = condition.temperature[part];
    }
    state.condition.wrench = [...condition.wrench];
  }
  return state;
}

// Factors of another state, of groups that there still are.
function keepFactors(state, {scale}) {
  for (const group in state.scale.half_width) {
    if (group in scale.half_width) state.scale.half_width[group] = scale.half_width[group];
  }
  state.scale.compliance = scale.compliance;
}
