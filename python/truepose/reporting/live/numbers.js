// Numbers as people read them, in the units of the file and with the marks of the language.

// So many more decimals a number may have to differ from another one.
const FINER = 6;
const MINUS = "\u2212", MISSING = "\u2013";

function numbersOf({units, marks}) {
  function fixed(value, decimals) {
    if (value === null || !Number.isFinite(value)) return MISSING;
    let text = Math.abs(value).toFixed(decimals);
    const minus = value < 0 && Number(text) !== 0 ? MINUS : "";
    const [whole, part] = text.split(".");
    const grouped = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, marks.group) : whole;
    return minus + grouped + (part ? marks.decimal + part : "");
  }

  // Decimals with which a number of this size has three digits, at most two of a micrometre.
  function decimalsOf(size) {
    if (!(size > 0) || !Number.isFinite(size)) return 1;
    return Math.max(0, Math.min(2, 2 - Math.floor(Math.log10(size))));
  }

  const isLength = name => ["x", "y", "z", "position"].includes(name);
  // The unit of an error's component or magnitude.
  const ofError = name => isLength(name) ? units.small_length : units.small_angle;
  const ofPose = name => isLength(name) ? units.length : units.angle;

  // An SI value as it is shown, and back.
  const shown = (value, unit) => value / unit.si - (unit.offset || 0);
  const meant = (number, unit) => (number + (unit.offset || 0)) * unit.si;

  // An error's component or magnitude with its unit, so fine that it differs from what it is
  // compared with, unless it is that.
  function error(value, name, compared = null) {
    if (value === null) return MISSING;
    const unit = ofError(name), number = value / unit.si;
    const decimals = finer(number, decimalsOf(Math.abs(number)), compared === null ? null : compared / unit.si);
    return `${fixed(number, decimals)} ${unit.label}`;
  }

  // So many decimals, or more, that a number differs from another one, unless it is that or there is none.
  function finer(number, decimals, other) {
    const finest = decimals + FINER;
    while (other !== null && decimals < finest && number !== other
      && fixed(number, decimals) === fixed(other, decimals)) decimals++;
    return decimals;
  }

  return {fixed, decimalsOf, finer, isLength, ofError, ofPose, shown, meant, error};
}

// The size of an error by its components, position or orientation; null where it is not known.
function sizeOf(error, components, quantity) {
  let sum = 0;
  for (const [at, name] of components.entries()) {
    if (["x", "y", "z"].includes(name) !== (quantity === "position")) continue;
    if (error[at] === null) return null;
    sum += error[at] ** 2;
  }
  return Math.sqrt(sum);
}

// Position and orientation, as far as the components have them.
function quantitiesOf(components) {
  const lengths = components.filter(name => ["x", "y", "z"].includes(name)).length;
  return [
    ...(lengths ? ["position"] : []), ...(lengths < components.length ? ["orientation"] : []),
  ];
}

// The least of 1, 2, 5 times a power of ten that is not less, or of other `digits`.
function roundUp(value, digits = [1, 2, 5, 10]) {
  const power = 10 ** Math.floor(Math.log10(value));
  return digits.find(digit => digit * power >= value * (1 - 1e-9)) * power;
}

// A sentence with its {places} filled.
function filled(text, values) {
  return text.replace(/\{(\w+)\}/g, (_, name) => values[name]);
}
