// A canvas as large as its place, sharp on every screen, in the colours of the page.

function canvasOf(canvas) {
  const context = canvas.getContext("2d");
  let styles = getComputedStyle(document.documentElement), size = null;
  // Who asks for its size has the whole page laid out: that is done where it has changed alone.
  new ResizeObserver(() => { size = null; }).observe(canvas);

  // Cleared, and its width and height in CSS pixels.
  function begin() {
    const ratio = Math.min(3, devicePixelRatio || 1);
    size ??= {width: canvas.clientWidth, height: canvas.clientHeight};
    const {width, height} = size;
    const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    context.font = `12px ${styles.fontFamily || "sans-serif"}`;
    return {width, height};
  }

  const colour = name => styles.getPropertyValue(`--${name}`).trim();

  function line(points, name, width, {dash = [], closed = false, fill = null, alpha = 1} = {}) {
    if (points.length < 2) return;
    context.beginPath();
    points.forEach(([x, y], at) => at ? context.lineTo(x, y) : context.moveTo(x, y));
    if (closed) context.closePath();
    if (fill) {
      context.globalAlpha = alpha;
      context.fillStyle = colour(fill);
      context.fill();
      context.globalAlpha = 1;
    }
    if (name) {
      context.setLineDash(dash);
      context.lineWidth = width;
      context.lineJoin = context.lineCap = "round";
      context.strokeStyle = colour(name);
      context.stroke();
      context.setLineDash([]);
    }
  }

  function dot([x, y], radius, fill, edge = null) {
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = colour(fill);
    context.fill();
    if (edge) {
      context.lineWidth = 1.5;
      context.strokeStyle = colour(edge);
      context.stroke();
    }
  }

  function text(words, [x, y], name, {align = "left", base = "alphabetic"} = {}) {
    context.fillStyle = colour(name);
    context.textAlign = align;
    context.textBaseline = base;
    context.fillText(words, x, y);
  }

  // An arrow; of one too short to have a head, its line.
  function arrow(from, to, name, width) {
    line([from, to], name, width);
    const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (length < 7) return;
    const [u, v] = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
    const head = Math.min(9, 0.5 * length), back = [to[0] - head * u, to[1] - head * v];
    line([
      to, [back[0] - 0.5 * head * v, back[1] + 0.5 * head * u],
      [back[0] + 0.5 * head * v, back[1] - 0.5 * head * u],
    ], name, 1, {closed: true, fill: name});
  }

  return {canvas, context, begin, colour, line, dot, text, arrow};
}

// The points that a drag of the pointer goes through, and the keys of a place.
function followDrag(canvas, {start = () => {}, move, keys = {}}) {
  let from = null;
  canvas.addEventListener("pointerdown", event => {
    from = [event.offsetX, event.offsetY];
    canvas.setPointerCapture(event.pointerId);
    start(from);
  });
  canvas.addEventListener("pointermove", event => {
    if (!from) return;
    const now = [event.offsetX, event.offsetY];
    move(now, [now[0] - from[0], now[1] - from[1]]);
    from = now;
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, () => { from = null; });
  }
  canvas.addEventListener("keydown", event => {
    if (!keys[event.key]) return;
    keys[event.key]();
    event.preventDefault();
  });
}
