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

// A slider of `get` and `set`, both SI. `low` and `high` are SI too, `marks` where ticks are.
function slider({name, label, unit, low, high, get, set, marks = [], numbers}) {
  const id = `live-${name.replace(/\W/g, "-")}`;
  let [least, most] = [low, high].map(value => numbers.shown(value, unit));
  const step = roundUp((most - least) / STEPS * 0.999);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  least = Math.floor(least / step + 1e-9) * step;
  most = Math.ceil(most / step - 1e-9) * step;
  const full = unit.label ? `${label}, ${unit.label}` : label;
  const range = element("input", {
    type: "range", id, "aria-label": full, min: least, max: most, step, ...(marks.length ? {list: `${id}-marks`} : {}),
  });
  const number = element("input", {type: "number", step: "any", "aria-label": full});
  const mark = marks.map(at => element("option", {value: numbers.shown(at, unit)}));
  const row = element(
    "div", {className: "live-slider"},
    element("label", {htmlFor: id}, label.replace(/[._]/g, "$&\u200b")), range, number,
    element("span", {className: "unit"}, unit.label),
    ...(marks.length ? [element("datalist", {id: `${id}-marks`}, ...mark)] : []),
  );
  row.dataset.of = name;
  function show(besides) {
    const value = get(), shown = value === null ? null : numbers.shown(value, unit);
    if (besides !== range) range.value = shown === null ? (least + most) / 2 : shown;
    if (besides !== number) {
      number.value = shown === null ? "" : Number(shown.toFixed(decimals + 1));
    }
    range.setAttribute("aria-valuetext",
      shown === null ? MISSING : `${numbers.fixed(shown, decimals)} ${unit.label}`);
  }
  for (const input of [range, number]) {
    input.addEventListener("input", () => {
      const typed = input.valueAsNumber;
      if (Number.isFinite(typed)) set(numbers.meant(typed, unit), input);
    });
  }
  number.addEventListener("change", () => show());
  return {row, show, range, low: numbers.meant(least, unit), high: numbers.meant(most, unit)};
}

// All controls of a state; `changed` is called at every step of one.
function controlsOf({bundle, components, commanded, state, words, numbers, changed}) {
  const {units, workspace} = bundle, file = bundle.condition;
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
      name: `pose.${name}`, label: name, unit, low: low - room, high: high + room,
      marks: span > 0 ? [low, high] : [],
      get: () => state.pose[at], set: value => { state.pose[at] = value; },
    }));
  });

  const temperature = element("div");
  const parts = bundle.parts;
  if (parts.length) {
    const known = parts.map(({part}) => temperatureOf(file, part, bundle));
    const reference = bundle.reference_temperature;
    const [low, high] = [Math.min(reference, ...known) - 20, Math.max(reference, ...known) + 20];
    const common = {unit: units.temperature, low, high, marks: [reference]};
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
  const wrench = (host, index, name, label, unit, most) => add(host, {
    name, label, unit, low: -most, high: most, marks: [0],
    get: () => state.condition.wrench[index],
    set: value => { state.condition.wrench[index] = value; },
  });
  const [force, moment] = [file.wrench.slice(0, 3), file.wrench.slice(3)];
  const mostForce = roundUp(3 * Math.hypot(...force)) || 1000;
  const mostMoment = roundUp(Math.max(3 * Math.hypot(...moment), 0.2 * size * mostForce));
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
  const groups = [...new Set(bundle.variables.map(({group}) => group))];
  for (const group of groups) {
    add(tolerance, {
      name: `tolerance.${group}`, label: group, unit: NUMBER,
      low: 0, high: 3, marks: [1],
      get: () => state.scale.half_width[group],
      set: value => { state.scale.half_width[group] = Math.max(0, value); },
    });
  }
  const {own, shared, limbs} = bundle.compliance;
  if (own.length || shared.length || limbs) {
    add(tolerance, {
      name: "stiffness", label: words.stiffness, unit: NUMBER, low: 0.1, high: 3, marks: [1],
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
