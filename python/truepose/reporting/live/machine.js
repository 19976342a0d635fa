// The machine as it is commanded, where it really is, magnified, and the errors at its tool point.

const TURN = {yaw: -0.85, pitch: 0.4};
const LARGEST_PITCH = 1.55;
// How much of the canvas the machine takes, on either side of its middle.
const FILLED = 0.43;
// How large the largest error drawn may be and is at least, of the picture's radius.
const SHOWN_LEAST = 0.05, SHOWN_BEST = 0.22, SHOWN_MOST = 0.5;

// `before`: what `kept` gave of the view of another machine, to be looked at in the same way.
function machineView(canvas, {drawing, planar, box, grouped, before}) {
  const plane = canvasOf(canvas);
  const {turn, magnification: magnified} = before || {turn: {...TURN}, magnification: null};
  let shown = null, magnification = magnified, middle, radius, wide, high;
  of(drawing);

  // What is drawn of a machine is as large as the canvas has room for it.
  function of(another) {
    drawing = another;
    ({middle, radius, wide, high} = extentOf([
      ...drawing.paths.flat(), ...drawing.frame, ...drawing.points, ...box.flat(),
    ]));
  }

  // A function: a point in space -> where it is on the canvas.
  function projection(width, height) {
    const rows = planar ? [[1, 0, 0], [0, 1, 0]] : turned(turn);
    // However it is turned about z, it stays inside.
    const [across, up] = planar ? [wide[0], wide[1]]
      : [radius, Math.abs(rows[1][2]) * high + Math.hypot(rows[1][0], rows[1][1]) * radius];
    const scale = Math.min(FILLED * width / across, FILLED * height / up);
    const centre = [width / 2, height / 2];
    const project = point => {
      const at = point.map((value, axis) => value - middle[axis]);
      return [centre[0] + scale * dot3(rows[0], at), centre[1] - scale * dot3(rows[1], at)];
    };
    return {project, rows, scale};
  }

  // How many times larger errors are drawn: kept until they are hardly seen, or leave the picture.
  function magnify(largest) {
    if (!(largest > 0)) return magnification || 1;
    const share = magnification * largest / radius;
    if (magnification === null || share < SHOWN_LEAST || share > SHOWN_MOST) {
      magnification = roundUp(SHOWN_BEST * radius / largest / 2.5);
    }
    return magnification;
  }

  function draw() {
    const {width, height} = plane.begin();
    const {project, rows, scale} = projection(width, height);
    if (!planar) axes(rows, height);
    if (!shown || !shown.centres) return;
    const {centres, tool, actual, errors, ellipses, other} = shown;
    const lines = (points, ...look) => plane.line(points.map(project), ...look);
    for (const edge of box) lines(edge, "green", 1, {dash: [2, 3]});
    lines(drawing.frame, "strong", 4, {closed: true});
    for (const path of drawing.paths) lines(path, "strong", 5);
    for (const {struts, pivot} of drawing.arms) {
      const ends = struts.map(strut => centres[strut][0]);
      if (ends.length > 1) lines(ends, "quiet", 4);
      if (pivot) lines([pivot, meanOf(ends)], "quiet", 4);
    }
    for (const [base, end] of centres) lines([base, end], "blue", 3);
    const platform = points => drawing.platform.map(strut => points[strut][1]);
    lines(platform(centres), "ink", 3, {closed: true, fill: "blue", alpha: 0.12});
    const arms = meanOf(centres.map(([, end]) => end));
    if (distance(arms, tool) > 0.02 * radius) lines([arms, tool], "ink", 2);
    if (actual) {
      const factor = magnification;
      const moved = centres.map((pair, strut) => pair.map((point, end) => point.map(
        (value, axis) => value + factor * (actual[strut][end][axis] - value))));
      const colour = other ? "beyond" : "before";
      for (const pair of moved) lines(pair, colour, 1.5, {dash: [5, 4]});
      lines(platform(moved), colour, 1.5, {dash: [5, 4], closed: true});
    }
    for (const [base, end] of centres) {
      plane.dot(project(base), 3.5, "paper", "ink");
      plane.dot(project(end), 3.5, "paper", "ink");
    }
    const at = project(tool);
    for (const [name, ellipse] of Object.entries(ellipses)) {
      if (ellipse) drawEllipse(ellipse, tool, name, {project, rows, scale});
    }
    for (const [name, error] of [...Object.entries(errors), ["beyond", other]]) {
      if (!error) continue;
      plane.arrow(at, project(tool.map((x, axis) => x + magnification * error[axis])), name, 2.5);
    }
    plane.dot(at, 4, "ink", "paper");
  }

  // The 95 % ellipse: the outline of the ellipsoid, projected; E as (e - c)' E^-1 (e - c) <= 1.
  function drawEllipse({centre, shape}, tool, name, {project, rows, scale}) {
    const [u, v] = rows;
    const [a, b, c] = [[u, u], [u, v], [v, v]].map(([p, q]) => dot3(p, shape.map(row => dot3(row, q))));
    const middle = (a + c) / 2, apart = Math.hypot((a - c) / 2, b);
    const angle = Math.atan2(b, (a - c) / 2) / 2;
    const [long, short] = [middle + apart, Math.max(0, middle - apart)].map(
      value => magnification * scale * Math.sqrt(value));
    const [x, y] = project(tool.map((value, axis) => value + magnification * centre[axis]));
    const points = Array.from({length: 64}, (_, step) => {
      const at = 2 * Math.PI * step / 64, [p, q] = [long * Math.cos(at), short * Math.sin(at)];
      return [
        x + p * Math.cos(angle) - q * Math.sin(angle), y - p * Math.sin(angle) - q * Math.cos(angle),
      ];
    });
    plane.line(points, name, 1.5, {closed: true, fill: name, alpha: 0.18});
  }

  // Where x, y and z point.
  function axes(rows, height) {
    const at = [30, height - 26];
    ["x", "y", "z"].forEach((name, axis) => {
      const to = [at[0] + 20 * rows[0][axis], at[1] - 20 * rows[1][axis]];
      plane.line([at, to], "quiet", 1.5);
      plane.text(name, [at[0] + 29 * rows[0][axis], at[1] - 29 * rows[1][axis]], "quiet",
        {align: "center", base: "middle"});
    });
  }

  function rotate(yaw, pitch) {
    turn.yaw += yaw;
    turn.pitch = Math.max(-LARGEST_PITCH, Math.min(LARGEST_PITCH, turn.pitch + pitch));
    draw();
  }

  if (!planar) {
    followDrag(canvas, {
      move: (_, [x, y]) => rotate(x / 150, y / 150),
      keys: {
        ArrowLeft: () => rotate(-0.1, 0), ArrowRight: () => rotate(0.1, 0),
        ArrowUp: () => rotate(0, -0.1), ArrowDown: () => rotate(0, 0.1),
        Home: () => { Object.assign(turn, TURN); draw(); },
      },
    });
  }

  return {
    draw, of,
    kept: () => ({turn, magnification}),
    // `largest`: the longest error that is to be seen, m; returns how many times it is magnified.
    show(picture, largest) {
      shown = picture;
      const factor = magnify(largest);
      draw();
      return grouped(factor);
    },
    // Ellipses of the states, null where there is none; nothing is drawn anew for what is there.
    add(ellipses) {
      if (!shown || Object.entries(ellipses).every(([name, one]) => (shown.ellipses[name] ?? null) === one)) return;
      shown.ellipses = ellipses;
      draw();
    },
  };
}

// Rows of the picture's axes, right and up, of a view turned about z and then tilted.
function turned({yaw, pitch}) {
  const [ca, sa, cb, sb] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  return [[ca, -sa, 0], [sa * sb, ca * sb, cb]];
}

// The middle of points, how far they reach from it about z, and half their extent by axis.
function extentOf(points) {
  const [low, high] = [Math.min, Math.max].map(
    end => [0, 1, 2].map(axis => end(...points.map(point => point[axis]))));
  const middle = low.map((value, axis) => (value + high[axis]) / 2);
  const wide = high.map((value, axis) => (value - low[axis]) / 2);
  const radius = Math.max(...points.map(
    ([x, y]) => Math.hypot(x - middle[0], y - middle[1])), 1e-3 * wide[2]);
  return {middle, radius, wide, high: wide[2]};
}

const dot3 = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const distance = (a, b) => Math.hypot(...a.map((value, axis) => value - b[axis]));
const meanOf = points => [0, 1, 2].map(
  axis => points.reduce((sum, point) => sum + point[axis], 0) / points.length);

// The edges of the workspace in space: those of a box, or of a rectangle where it is flat.
function edgesOf({low, high, home}, commanded) {
  const ends = ["x", "y", "z"].map(name => {
    const at = commanded.indexOf(name);
    return at < 0 ? [0, 0] : high[at] > low[at] ? [low[at], high[at]] : [home[at], home[at]];
  });
  const edges = [];
  for (let corner = 0; corner < 8; corner++) {
    for (const bit of [1, 2, 4]) {
      if (corner & bit) continue;
      const edge = [corner, corner | bit].map(
        which => ends.map(([from, to], axis) => which >> axis & 1 ? to : from));
      if (distance(...edge) > 0) edges.push(edge);
    }
  }
  return edges;
}
