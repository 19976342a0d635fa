// A chart of sizes of errors, drawn on a canvas: where it lies, and its lines of round numbers.

const CHART_EDGE = {left: 84, right: 14, top: 12, bottom: 30};

// Begins a chart of sizes up to `largest`, SI, of a quantity. `x`: a share of its width, `y`: a size in
// SI -> where that is; `ends`: of its lines; `low`: where what is across is written.
function chartOf(plane, numbers, quantity, largest) {
  const {width, height} = plane.begin(), unit = numbers.ofError(quantity);
  const most = roundUp(Math.max(largest, 1e-12) / unit.si * 1.05, [1, 1.5, 2, 3, 4, 5, 6, 8, 10]);
  const {left, right, top, bottom} = CHART_EDGE, wide = width - left - right, high = height - top - bottom;
  const x = share => left + wide * share, y = size => top + high * (1 - size / unit.si / most);
  const step = roundUp(most / 4), decimals = Math.max(0, -Math.floor(Math.log10(step)));
  const ends = size => [[left, y(size)], [width - right, y(size)]];
  for (let tick = 0; tick <= most * (1 + 1e-9); tick += step) {
    const isTop = tick + step > most * (1 + 1e-9);
    plane.line(ends(tick * unit.si), "line", 1);
    plane.text(numbers.fixed(tick, decimals) + (isTop ? `\u00a0${unit.label}` : ""),
      [left - 6, y(tick * unit.si)], "quiet", {align: "right", base: "middle"});
  }
  return {x, y, ends, low: height - 10};
}
