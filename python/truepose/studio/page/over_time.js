// The tab of the error over time, at the pose shown, over the file's temperature log.

const TIME_EDGE = {left: 60, right: 12, top: 12, bottom: 30};

const overTimeTab = {
  name: "over_time", asked: true,
  build(host, {said, tell, numbers}) {
    const canvas = element("canvas", {role: "img", "aria-label": said.tabs.over_time});
    const chart = element("div", {className: "live-canvas low"}, canvas), plane = canvasOf(canvas);
    const select = element("select", {"aria-label": said.quantity}), words = element("div");
    let shown = null;

    function draw() {
      const {width, height} = plane.begin();
      if (!shown) return;
      const name = select.value, unit = numbers.ofError(name), times = shown.time;
      const most = roundUp(Math.max(...shown.error[name], 1e-12) / unit.si * 1.05, [1, 1.5, 2, 3, 4, 5, 6, 8, 10]);
      const [from, to] = [times[0], times.at(-1)], wide = width - TIME_EDGE.left - TIME_EDGE.right;
      const high = height - TIME_EDGE.top - TIME_EDGE.bottom;
      const x = time => TIME_EDGE.left + wide * (to > from ? (time - from) / (to - from) : 0);
      const y = value => TIME_EDGE.top + high * (1 - value / most);
      const step = roundUp(most / 4), decimals = Math.max(0, -Math.floor(Math.log10(step)));
      for (let tick = 0; tick <= most * (1 + 1e-9); tick += step) {
        plane.line([[TIME_EDGE.left, y(tick)], [width - TIME_EDGE.right, y(tick)]], "line", 1);
        plane.text(numbers.fixed(tick, decimals), [TIME_EDGE.left - 6, y(tick)], "quiet",
          {align: "right", base: "middle"});
      }
      const every = roundUp((to - from) / 3600 / 5 || 1);
      for (let tick = Math.ceil(from / 3600 / every) * every; tick <= to / 3600 + 1e-9; tick += every) {
        plane.text(`${numbers.fixed(tick, Math.max(0, -Math.floor(Math.log10(every))))} h`,
          [x(3600 * tick), height - 10], "quiet", {align: "center"});
      }
      plane.line(times.map((time, at) => [x(time), y(shown.error[name][at] / unit.si)]), "before", 2);
    }

    select.addEventListener("change", draw);
    new ResizeObserver(draw).observe(chart);
    const none = element("p", {className: "caption"}, said.no_log);
    const choice = element("p", {className: "caption"}, element("label", {}, `${said.quantity} `, select));
    const there = element("div", {}, choice, chart, words);
    host.append(none, there);
    return {
      show(value) {
        none.hidden = Boolean(value.times);
        there.hidden = !value.times;
        shown = value.times ? value : null;
        if (!shown) return;
        const names = Object.keys(value.error), before = select.value;
        select.replaceChildren(...names.map(name => element("option", {value: name}, tell.quantity(name))));
        select.value = names.includes(before) ? before : names[0];
        words.replaceChildren(...names.map(name => element("p", {className: "caption"}, filled(said.largest_at, {
          quantity: tell.quantity(name), size: numbers.error(value.largest[name].value, name),
          time: `${numbers.fixed(value.largest[name].time / 3600, 2)} h`,
        }))), element("p", {className: "caption"}, `${said.pose_shown} ${tell.pose(value.pose)}`));
        draw();
      },
      redraw: draw,
    };
  },
};
