// The tab of the shares: which source and parameter the spread at the pose shown comes from.

// Parameters with a smaller share are counted, and not shown.
const LEAST_SHARE = 0.002;

const sharesTab = {
  name: "shares", answer: "shares",
  build(host, {said, tell, numbers, findFields}) {
    const select = element("select", {"aria-label": said.component});
    const body = element("div");
    host.append(element("p", {className: "caption"}, element("label", {}, `${said.component} `, select)), body);
    let shown = null;
    select.addEventListener("change", () => { if (shown) show(shown); });

    const bar = share => element("span", {
      className: "share", style: `--share: ${Math.max(0, Math.min(1, share || 0))}`,
    }, tell.percent(share));

    function table(title, rows, at, isParameter) {
      const whole = [...rows].sort((a, b) => (b.total[at] ?? 0) - (a.total[at] ?? 0));
      const correlated = rows.some(({shapley}) => shapley);
      const heads = [title, [said.total, "number"], [said.first, "number"], [said.linear_share, "number"],
        ...(correlated ? [[said.shapley, "number"]] : [])];
      return scrolling(tableOf(heads, whole.map(({name, first, total, linear, shapley}) => {
        const button = element("button", {type: "button", className: "go", title: said.find_fields}, name);
        button.addEventListener("click", () => findFields(name));
        return [
          isParameter ? {node: button} : name,
          {node: bar(total[at]), className: "number"},
          {text: tell.percent(first[at]), className: "number"},
          {text: tell.percent(linear[at]), className: "number"},
          ...(correlated ? [{text: tell.percent(shapley && shapley[at]), className: "number"}] : []),
        ];
      })), title);
    }

    function show(value) {
      shown = value;
      const components = tell.components(), deviations = value.standard_deviation;
      if (select.options.length !== components.length
          || components.some((name, at) => select.options[at].text !== name)) {
        select.replaceChildren(...components.map((name, at) => element("option", {value: at}, name)));
        select.value = deviations.indexOf(Math.max(...quantityOf(components, deviations)));
        if (select.selectedIndex < 0) select.selectedIndex = 0;
      }
      const at = Number(select.value), name = components[at];
      const spread = filled(said.spread, {component: name, size: numbers.error(deviations[at], name)});
      const large = value.parameters.filter(({total}) => total[at] >= LEAST_SHARE);
      const others = value.left_out + value.parameters.length - large.length;
      body.replaceChildren(
        element("p", {className: "says"}, spread), table(said.source_of, value.sources, at, false),
        table(said.parameter, large, at, true),
        element("p", {className: "caption"}, others
          ? filled(said.parameters_left_out, {count: others}) : "", ` ${said.shares_caption}`));
    }
    return {show};
  },
};

// The deviations of the components along x, y and z, or of all where there are none.
function quantityOf(components, deviations) {
  const lengths = deviations.filter((_, at) => WORLD.includes(components[at]));
  return lengths.length ? lengths : deviations;
}
