// How large the error is of machines drawn at random: as commanded and compensated.

const BINS = 72;
// Digits at which the axis ends.
const ENDS = [1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10];
// Shares of machines at which sizes are asked for: evenly, and more in the tail.
const PROBABILITIES = [0.95, ...Array.from({length: 201}, (_, step) => step / 200)];

function distributionView(canvas, {numbers, words}) {
  const plane = canvasOf(canvas);
  let most = 0, shown = null;

  // `samples`: by state what `read` answered; `target` of the quantity, or undefined.
  function show(samples, quantity, target) {
    shown = {samples, quantity, target};
    draw();
  }

  function draw() {
    const {width, height} = plane.begin();
    const curves = shown ? Object.entries(shown.samples).filter(([, read]) => read) : [];
    if (!curves.length) return;
    const {quantity, target} = shown;
    const columns = curves.map(([name, read]) => [name, columnOf(read, quantity)]);
    const end = Math.max(target * 1.1 || 0, ...columns.map(([, {quantiles}]) => quantiles.at(-2)));
    if (!(most >= end && most < 1.8 * end)) most = roundUp(end * 1.02, ENDS);
    const low = height - 22, x = value => 8 + (width - 16) * value / most;
    const heights = columns.map(([, {quantiles}]) => densities(quantiles.slice(1), most));
    const top = Math.max(...heights.flat());
    plane.line([[8, low], [width - 8, low]], "strong", 1);
    const unit = numbers.ofError(quantity), step = roundUp(most / unit.si / 6);
    for (let tick = 0; tick * unit.si <= most * (1 + 1e-9); tick += step) {
      const decimals = Math.max(0, -Math.floor(Math.log10(step)));
      plane.text(numbers.fixed(tick, decimals), [x(tick * unit.si), height - 7], "quiet",
        {align: tick === 0 ? "left" : tick * unit.si > 0.97 * most ? "right" : "center"});
    }
    columns.forEach(([name, {quantiles}], at) => {
      const stairs = heights[at].flatMap((value, bin) => [bin, bin + 1].map(
        edge => [x(most * edge / BINS), low - (low - 18) * value / top]));
      const outline = [[x(0), low], ...stairs, [x(most), low]];
      const filled = name === "after";
      plane.line(outline, name, 1.5,
        filled ? {fill: name, alpha: 0.3} : {dash: [5, 3], fill: name, alpha: 0.08});
      plane.line([[x(quantiles[0]), low], [x(quantiles[0]), low - 10]], name, 3);
    });
    if (target) {
      plane.line([[x(target), low], [x(target), 16]], "ink", 1.5, {dash: [5, 4]});
      const right = x(target) > width - 130;
      plane.text(filled(words.asked, {target: numbers.error(target, quantity)}),
        [x(target) + (right ? -5 : 5), 20], "ink", {align: right ? "right" : "left"});
    }
  }

  return {show, draw, anew() { most = 0; }};
}

// A column of what was read, its quantiles at PROBABILITIES.
function columnOf(read, name) {
  const at = read.columns.indexOf(name);
  return {quantiles: read.quantiles[at], maximum: read.maximum[at], mean: read.mean[at]};
}

// Shares of machines in equal bins up to `most`, by quantiles at equal shares.
function densities(quantiles, most) {
  const shares = new Array(BINS).fill(0), each = 1 / (quantiles.length - 1);
  for (let at = 1; at < quantiles.length; at++) {
    const [from, to] = [quantiles[at - 1], quantiles[at]].map(value => value / most * BINS);
    if (to - from < 1e-9) {
      if (from < BINS) shares[Math.floor(from)] += each;
      continue;
    }
    for (let bin = Math.floor(from); bin < Math.min(BINS, to); bin++) {
      shares[bin] += each * (Math.min(to, bin + 1) - Math.max(from, bin)) / (to - from);
    }
  }
  return shares;
}
