// The tab of the error over time, at the pose shown, over the file's temperature log.

const overTimeTab = {
  name: "over_time", asked: true,
  build(host, {said, tell, numbers}) {
    const canvas = element("canvas", {role: "img", "aria-label": said.tabs.over_time});
    const chart = element("div", {className: "live-canvas low"}, canvas), plane = canvasOf(canvas);
    const select = element("select", {"aria-label": said.quantity}), words = element("div");
    let shown = null;

    function draw() {
      if (!shown) { plane.begin(); return; }
      const name = select.value, times = shown.time, [from, to] = [times[0], times.at(-1)];
      const {x, y, low} = chartOf(plane, numbers, name, Math.max(...shown.error[name]));
      const at = time => x(to > from ? (time - from) / (to - from) : 0);
      const every = roundUp((to - from) / 3600 / 5 || 1);
      for (let tick = Math.ceil(from / 3600 / every) * every; tick <= to / 3600 + 1e-9; tick += every) {
        plane.text(`${numbers.fixed(tick, Math.max(0, -Math.floor(Math.log10(every))))} h`,
          [at(3600 * tick), low], "quiet", {align: "center"});
      }
      plane.line(times.map((time, number) => [at(time), y(shown.error[name][number])]), "before", 2);
    }

    select.addEventListener("change", draw);
    new ResizeObserver(draw).observe(chart);
    const none = element("p", {className: "caption"}, said.no_log);
    const choice = element("p", {className: "caption"}, element("label", {}, `${said.quantity} `, select));
    const there = element("div", {}, choice, chart, words);
    none.hidden = there.hidden = true; // until it is known
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
