// The size of the known error over two coordinates, at the pose and in the condition shown.

const FINE = [45, 33], COARSE = [15, 11];
const EDGE = {left: 46, right: 10, top: 8, bottom: 34};

// `before`: what `kept` gave of the map of another machine, to be over the same and in its colours.
function mapView(canvas, {
  scale, ask, limits, pose, workspace, numbers, commanded, words, moved, before,
}) {
  const plane = canvasOf(canvas);
  const same = before && before.of.join() === commanded.join();
  let axes = same ? before.axes : [0, 1], ends = same ? before.ends : null, shown = null;

  // Evaluate and draw; `coarse` while something is dragged.
  function update({machine, condition, scale: factors, components, quantity}, coarse) {
    const [across, up] = coarse ? COARSE : FINE;
    const [p, q] = axes, poses = [];
    const place = (axis, part) => limits[axis][0] + (limits[axis][1] - limits[axis][0]) * part;
    for (let row = 0; row < up; row++) {
      for (let column = 0; column < across; column++) {
        const at = [...pose()];
        at[p] = place(p, (column + 0.5) / across);
        at[q] = place(q, (row + 0.5) / up);
        poses.push(at);
      }
    }
    const {status, errors} = ask({
      op: "errors", machine, poses, condition, scale: factors, command: "nominal",
    });
    const sizes = errors.map(
      (error, at) => status[at] === "ok" ? sizeOf(error, components, quantity) : null);
    shown = {sizes, across, up, quantity};
    // The first picture is coarse: its scale is that of the fine one that follows it.
    if (!ends || ends.quantity !== quantity || (ends.coarse && !coarse)) fit(coarse);
    draw();
  }

  // The scale from what is shown.
  function fit(coarse = false) {
    const there = shown.sizes.filter(size => size !== null);
    if (!there.length) return;
    const [low, high] = [Math.min(...there), Math.max(...there)];
    ends = {low, high: high > low ? high : low + 1e-9, quantity: shown.quantity, coarse};
  }

  function draw() {
    if (!shown) return;
    const {width, height} = plane.begin(), {context} = plane;
    const wide = width - EDGE.left - EDGE.right, high = height - EDGE.top - EDGE.bottom;
    const {sizes, across, up} = shown, [dx, dy] = [wide / across, high / up];
    context.fillStyle = plane.colour("shade");
    context.fillRect(EDGE.left, EDGE.top, wide, high);
    sizes.forEach((size, at) => {
      if (size === null || !ends) return;
      context.fillStyle = colourOf(size);
      const [column, row] = [at % across, Math.floor(at / across)];
      const [x, y] = [EDGE.left + column * dx, EDGE.top + high - (row + 1) * dy].map(Math.floor);
      context.fillRect(x, y, Math.ceil(dx) + 1, Math.ceil(dy) + 1);
    });
    plane.line([[0, 0], [1, 0], [1, 1], [0, 1]].map(
      ([x, y]) => [EDGE.left + x * wide, EDGE.top + y * high]), "strong", 1, {closed: true});
    const at = (axis, value) => (value - limits[axis][0]) / (limits[axis][1] - limits[axis][0]);
    const on = ([x, y]) => [
      EDGE.left + wide * at(axes[0], x), EDGE.top + high * (1 - at(axes[1], y))];
    const [p, q] = axes, {low, high: far} = workspace;
    if (far[p] > low[p] && far[q] > low[q]) {
      plane.line([[low[p], low[q]], [far[p], low[q]], [far[p], far[q]], [low[p], far[q]]].map(on),
        "on-map", 1.5, {closed: true, dash: [4, 3]});
    }
    ticks(wide, high);
    const centre = on([pose()[p], pose()[q]]);
    context.save();
    context.beginPath();
    context.rect(EDGE.left - 8, EDGE.top - 8, wide + 16, high + 16);
    context.clip();
    for (const [radius, thick, name] of [[7, 5, "behind-map"], [7, 2.5, "on-map"]]) {
      context.beginPath();
      context.arc(...centre, radius, 0, 2 * Math.PI);
      context.lineWidth = thick;
      context.strokeStyle = plane.colour(name);
      context.stroke();
    }
    context.restore();
  }

  function colourOf(size) {
    if (size > ends.high * (1 + 1e-9)) return plane.colour("beyond");
    const part = Math.max(0, (size - ends.low) / (ends.high - ends.low)) * (scale.length - 1);
    const at = Math.min(scale.length - 2, Math.floor(part)), rest = Math.min(1, part - at);
    const mixed = scale[at].map((value, channel) =>
      Math.round(value + (scale[at + 1][channel] - value) * rest));
    return `rgb(${mixed.join(",")})`;
  }

  function ticks(wide, high) {
    axes.forEach((axis, which) => {
      const unit = numbers.ofPose(commanded[axis]);
      const [low, most] = limits[axis].map(value => numbers.shown(value, unit));
      const step = roundUp((most - low) / 5), decimals = Math.max(0, -Math.floor(Math.log10(step)));
      for (let tick = Math.ceil(low / step - 1e-9) * step; tick <= most + 1e-9 * step; tick += step) {
        const part = (tick - low) / (most - low), said = numbers.fixed(tick, decimals);
        if (which === 0) {
          plane.text(said, [EDGE.left + part * wide, EDGE.top + high + 14], "quiet", {align: "center"});
        } else {
          plane.text(said, [EDGE.left - 6, EDGE.top + high * (1 - part)], "quiet",
            {align: "right", base: "middle"});
        }
      }
    });
    const [p, q] = axes.map(axis => `${commanded[axis]}, ${numbers.ofPose(commanded[axis]).label}`);
    plane.text(p, [EDGE.left + wide, EDGE.top + high + 29], "quiet", {align: "right"});
    plane.text(`${q} \u2191`, [2, EDGE.top + high + 29], "quiet");
  }

  // What the ends of the scale are, and from where to where it goes if something is beyond them.
  function legend() {
    if (!ends) return null;
    const [low, high] = [ends.low, ends.high].map(value => numbers.error(value, ends.quantity));
    const there = shown.sizes.filter(size => size !== null);
    const least = Math.min(...there), most = Math.max(...there);
    const here = {low: numbers.error(least, ends.quantity), high: numbers.error(most, ends.quantity)};
    return {low, high, here, beyond: most > ends.high * (1 + 1e-9), below: least < ends.low * (1 - 1e-9)};
  }

  const set = ([x, y]) => {
    const wide = canvas.clientWidth - EDGE.left - EDGE.right;
    const high = canvas.clientHeight - EDGE.top - EDGE.bottom;
    const parts = [(x - EDGE.left) / wide, 1 - (y - EDGE.top) / high];
    axes.forEach((axis, which) => {
      const [low, most] = limits[axis], part = Math.max(0, Math.min(1, parts[which]));
      pose()[axis] = low + (most - low) * part;
    });
    moved();
  };
  const step = (which, sign) => () => {
    const axis = axes[which], [low, most] = limits[axis];
    pose()[axis] = Math.max(low, Math.min(most, pose()[axis] + sign * (most - low) / 50));
    moved();
  };
  followDrag(canvas, {
    start: set, move: set,
    keys: {
      ArrowLeft: step(0, -1), ArrowRight: step(0, 1), ArrowDown: step(1, -1), ArrowUp: step(1, 1),
    },
  });

  return {
    update, draw, legend,
    fit() { fit(); draw(); },
    kept: () => ({axes, ends, of: commanded}),
    over(first, second) { axes = [first, second]; ends = null; },
    get axes() { return axes; },
  };
}
