// What each source alone makes of the known error, and with its tolerances, to first order, up to
// which size; the largest first. And all together.
function sourcesTable(host, {components, quantities, sources, target, words, numbers}) {
  const live = sources.filter(source => source.live);
  const columns = [...components, ...quantities, ...quantities.map(name => `reach.${name}`)];
  const plain = name => name.replace("reach.", "");
  const heading = name => `${name === plain(name) ? words.quantities[name] || name
    : filled(words.up_to, {quantity: words.quantities[plain(name)]})}, ${
    numbers.ofError(plain(name)).label}`;
  const head = element("tr", {}, element("th", {scope: "col"}, words.source), ...columns.map(
    name => element("th", {scope: "col", className: "number"}, heading(name))));
  const body = element("tbody");
  host.append(element("table", {}, element("thead", {}, head), body));
  const rowOf = (name, label, title = "") => {
    const cells = columns.map(column => {
      const cell = element("td", {className: "number"});
      cell.dataset.of = `${name}.${column}`;
      return cell;
    });
    const row = element("tr", {}, element("th", {scope: "row", title}, label), ...cells);
    row.dataset.of = name;
    return {row, cells};
  };
  const rows = Object.fromEntries(live.map(({name, label, doc}) => [name, rowOf(name, label || name, doc)]));
  const all = {before: rowOf("before", words.together), after: rowOf("after", words.compensated)};
  for (const name in all) all[name].row.className = `all ${name}`;

  function fill({cells}, error, reach, decimals) {
    columns.forEach((name, at) => {
      const value = !error ? null : at < components.length ? error[at]
        : name === plain(name) ? sizeOf(error, components, name) : reach ? reach[plain(name)] : null;
      const {si} = numbers.ofError(plain(name)), shown = value === null ? NaN : value / si;
      const asked = name === plain(name) ? undefined : target[plain(name)];
      const fine = numbers.finer(shown, decimals(plain(name)), asked === undefined ? null : asked / si);
      put(cells[at], value === null ? undefined : value, numbers.fixed(shown, fine));
    });
  }

  // `bySource`: the error of each source alone, `reaches` up to which sizes it goes; `errors` by
  // state, null where there is none.
  function show(bySource, reaches, errors) {
    const every = [...Object.values(bySource), ...Object.values(errors)].filter(Boolean);
    const quantityOf = name => numbers.isLength(name) ? "position" : "orientation";
    const largest = name => Math.max(0,
      ...every.map(error => sizeOf(error, components, quantityOf(name))),
      ...Object.values(reaches).map(sizes => sizes[quantityOf(name)]));
    const digits = Object.fromEntries(columns.map(plain).map(name =>
      [name, numbers.decimalsOf(largest(name) / numbers.ofError(name).si)]));
    const decimals = name => digits[name];
    const size = name => reaches[name] ? reaches[name][quantities[0]] : -1;
    const order = live.map(({name}) => name).sort((a, b) => size(b) - size(a));
    const wanted = [...order.map(name => rows[name]), ...Object.values(all)].map(({row}) => row);
    if (wanted.some((row, at) => body.children[at] !== row)) body.replaceChildren(...wanted);
    for (const name of order) fill(rows[name], bySource[name], reaches[name], decimals);
    for (const name in all) fill(all[name], errors[name], reaches[name], decimals);
  }

  return {show};
}
