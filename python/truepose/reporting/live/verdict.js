// Whether the accuracy asked is kept at one pose in one condition, never over the workspace: met by a
// proof, NOT met by a machine that was found, undecided otherwise.

// Words of `said` and colours of the page.
const WORST_FIRST = ["missed", "computing", "open", "met"];

// Of one quantity: `bound` is what the kernel answered or undefined as long as it has not, `found`
// sizes of machines inside of the bands, null where there is none.
function judged(target, quantity, bound, found) {
  if (found.some(size => size !== null && size > target)) return "missed";
  if (bound === undefined) return "computing";
  const proven = bound.status === "proven" && bound.magnitude[quantity] <= target;
  return proven ? "met" : "open";
}

// The word of a state, of those of its quantities.
function together(words) {
  return WORST_FIRST.find(word => words.includes(word));
}

// Distributions within a band: a machine drawn of them is inside of the bands.
const WITHIN = ["uniform", "triangular", "arcsine", "two-point", "discrete"];

function allWithin(variables) {
  return variables.every(({distribution}) => WITHIN.includes(distribution.kind));
}
