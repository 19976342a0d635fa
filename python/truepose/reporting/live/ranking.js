// What each source alone makes of the known error, and with its tolerances, to first order, up to
// which size; the largest first. And all together.
function sourcesTable(host, {components, quantities, sources, words, numbers}) {
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
      const shown = value === null ? NaN : value / numbers.ofError(plain(name)).si;
      put(cells[at], value === null ? undefined : value, numbers.fixed(shown, decimals(plain(name))));
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
    body.replaceChildren(...order.map(name => rows[name].row), ...Object.values(all).map(one => one.row));
    for (const name of order) fill(rows[name], bySource[name], reaches[name], decimals);
    for (const name in all) fill(all[name], errors[name], reaches[name], decimals);
  }

  return {show};
}

// A function: half widths of the columns at a pose, the error of each source there and of all by
// state -> up to which sizes each goes, to first order.
function reachesOf({bundle, machine, components, quantities, ask}) {
  const parameters = [...new Set(bundle.columns.map(({parameter}) => parameter))];
  return (pose, halfWidths, bySource, errors) => {
    const known = {...bySource, ...errors};
    if (!parameters.length) return sizesOf({}, known, components, quantities);
    const {effects} = ask({op: "sensitivities", machine, poses: [pose], columns: parameters});
    const of = new Map(parameters.map((parameter, at) => [parameter, effects[0][at]]));
    const bands = bundle.variables.map(() => components.map(() => 0));
    bundle.columns.forEach(({parameter, variable}, column) => {
      const half = halfWidths[column];
      of.get(parameter).forEach((effect, at) => { bands[variable][at] += half * effect; });
    });
    const theirs = Object.fromEntries(Object.keys(errors).map(name => [name, bands]));
    bundle.variables.forEach(({source}, at) => (theirs[source] ||= []).push(bands[at]));
    return sizesOf(theirs, known, components, quantities);
  };
}

function sizesOf(bands, known, components, quantities) {
  const there = Object.entries(known).filter(([, error]) => error);
  return Object.fromEntries(there.map(([name, error]) => [name,
    Object.fromEntries(quantities.map(quantity => {
      const its = components.map((one, at) => at).filter(
        at => WORLD.includes(components[at]) === (quantity === "position"));
      const only = vector => its.map(at => vector[at] || 0);
      return [quantity, longest(only(error), (bands[name] || []).map(only))];
    })),
  ]));
}

// The longest sum of a vector and of others, each with either sign, that climbing finds.
function longest(centre, others) {
  const size = vector => Math.hypot(...vector);
  let most = size(centre);
  const starts = centre.flatMap((_, at) => [1, -1].map(
    sign => centre.map((_, axis) => axis === at ? sign : 0)));
  for (let along of [centre, ...starts, ...others.slice(0, 6)]) {
    for (let step = 0, before = -1; step < 20; step++) {
      const sum = [...centre];
      for (const other of others) {
        const ahead = other.reduce((total, value, axis) => total + value * along[axis], 0) < 0 ? -1 : 1;
        other.forEach((value, axis) => { sum[axis] += ahead * value; });
      }
      along = sum;
      if (size(sum) <= before * (1 + 1e-12)) break;
      before = size(sum);
    }
    most = Math.max(most, size(along));
  }
  return most;
}
