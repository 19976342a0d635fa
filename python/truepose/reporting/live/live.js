// The live part of a page: a state that sliders change, what the kernel says of it at once, and what a
// worker finds after that.

const COMMAND_OF = {before: "nominal", after: "corrected"};
const STATE_OF = {nominal: "before", corrected: "after"};
// After so many milliseconds without a step the map is drawn finely.
const REST = 140;

// `engine` has the kernel, here and in a worker. `moved` is told the state whenever somebody moves it,
// and null when it is put back; `before` is what `end` gave of the part whose place this one takes.
function livePart(place, setting, {ask, worker}, {moved = () => {}, before = null} = {}) {
  const {words, scale: colours, planar} = setting;
  const {target, units, workspace} = setting.bundle;
  const numbers = numbersOf({units, marks: setting.marks});
  const made = ask({op: "machine", bundle: setting.bundle}), {components, commanded} = made;
  const quantities = quantitiesOf(components);
  const sources = sourcesOf(setting), form = formOf(setting);
  const find = name => place.querySelector(`[data-live="${name}"]`);
  // What another machine of the same form has its own.
  let {bundle, drawing} = setting, {machine} = made;
  let notLive = sources.filter(source => !source.live), within = allWithin(bundle.variables);

  const state = asInTheFile(bundle);
  if (before) keepFactors(state, before.state);
  let quantity = before && quantities.includes(before.quantity) ? before.quantity : quantities[0];
  let job = before ? before.job : 0, asked = false, rest = null;
  // What is known of the state shown: `errors` and `status` by state at once, the rest by and by.
  let known = null;
  // A machine that is drawn at its `pose` in place of what is known: `centres` of its joints, and how far
  // its tool is `moved`.
  let other = null;

  let controls = null;
  furnish();
  const cards = cardsOf(find("cards"), find("strip"), {
    states: {before: words.as_commanded, after: words.compensated}, quantities, target, words, numbers,
  });
  const table = sourcesTable(find("sources"), {components, quantities, sources, target, words, numbers});
  const view = machineView(find("machine"), {
    drawing, planar, box: edgesOf(workspace, commanded),
    grouped: factor => numbers.fixed(factor, factor < 10 ? 1 : 0), before: before && before.view,
  });
  const limits = controls.ranges.slice(0, commanded.length).map(({low, high}) => [low, high]);
  const map = mapView(find("map"), {
    scale: colours, ask, limits, pose: () => state.pose, workspace, numbers,
    commanded, words, moved: () => { controls.show(); changed(); }, before: before && before.map,
  });
  const distribution = distributionView(find("distribution"), {numbers, words});

  worker.postMessage({bundle});
  worker.onmessage = ({data}) => {
    if (data.id !== job || !known) return;
    if (data.failed) known.failed = data.failed;
    else Object.assign(known.later[STATE_OF[data.command]], data);
    told();
  };
  worker.onerror = event => { if (known) { known.failed = event.message; told(); } };

  // Controls of the machine.
  function furnish() {
    controls = controlsOf({
      bundle: () => bundle, components, commanded, state, words, numbers, changed: () => changed(),
    });
    find("controls").replaceChildren(...controls.groups.map(
      ([title, host]) => element("fieldset", {}, element("legend", {}, title), host)));
  }

  function changed() {
    moved(state);
    clearTimeout(rest);
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => { if (asked) update(true); });
  }

  // Everything of the state, the map coarser while it is `moving`.
  function update(moving) {
    const begun = performance.now();
    asked = false;
    const at = {machine, condition: state.condition, scale: state.scale};
    const {status, centres, placements} = ask({op: "place", machine, poses: [state.pose]});
    // What of a state comes later: `worst`, `bounds`, `samples`, and whether these are `done`.
    known = {status: {before: status[0], after: status[0]}, errors: {}, later: {before: {}, after: {}}};
    const picture = {centres: null, errors: {}, ellipses: {}};
    let bySource = {};
    const sizes = {};
    if (status[0] === "ok") {
      for (const [name, command] of Object.entries(COMMAND_OF)) {
        const whole = name === "before" ? {sources: true, centres_actual: true} : {};
        const told = ask({op: "errors", ...at, poses: [state.pose], command, ...whole});
        known.status[name] = told.status[0];
        known.errors[name] = told.status[0] === "ok" ? told.errors[0] : null;
        if (name === "before") {
          bySource = Object.fromEntries(Object.entries(told.by_source || {}).map(
            ([source, errors]) => [source, errors[0]]));
          picture.actual = known.errors.before && told.actual_centres ? told.actual_centres[0] : null;
        }
        picture.errors[name] = known.errors[name] && inSpace(known.errors[name]);
        const far = ask({op: "largest", ...at, pose: state.pose, command, sources: name === "before"});
        Object.assign(sizes, far.by_source, {[name]: far.largest});
      }
      Object.assign(picture, {centres: centres[0], tool: placements[0].slice(0, 3)});
    }
    const isThere = picture.centres && other && other.pose.every((value, at) => value === state.pose[at]);
    if (isThere) Object.assign(picture, {other: other.moved, actual: other.centres});
    place.dataset.drawn = isThere ? "other" : "known";
    table.show(bySource, sizes, {before: null, after: null, ...known.errors});
    const largest = Math.max(0, ...[...Object.values(picture.errors), picture.other].filter(Boolean).map(
      error => Math.hypot(...error)));
    find("factor").textContent = filled(words.magnified, {factor: view.show(picture, largest)});
    find("outside").textContent = status[0] === "ok" ? "" : words.statuses[status[0]];
    place.dataset.status = status[0];
    mapAt(at, moving);
    told();
    worker.postMessage({
      id: ++job, pose: state.pose, condition: state.condition, scale: state.scale,
      probabilities: PROBABILITIES, nothing: status[0] !== "ok",
    });
    place.dataset.step = performance.now() - begun;
    place.dataset.steps = 1 + Number(place.dataset.steps || 0);
    clearTimeout(rest);
    if (moving) rest = setTimeout(() => mapAt(at, false), REST);
  }

  function mapAt(at, coarse) {
    map.update({...at, components, quantity}, coarse);
    legend();
    place.dataset.map = coarse ? "coarse" : "fine";
  }

  const inSpace = error => ["x", "y", "z"].map(name => {
    const at = components.indexOf(name);
    return at < 0 ? 0 : error[at];
  });

  // What is known by now, in words and numbers.
  function told() {
    const shown = {};
    for (const name of Object.keys(COMMAND_OF)) {
      const later = known.later[name], fine = known.status[name] === "ok";
      const sizes = Object.fromEntries(LINES.map(line => [line, {}])), verdicts = [], decides = {};
      for (const each of quantities) {
        const size = fine ? sizeOf(known.errors[name], components, each) : null;
        const sample = fine && later.samples ? columnOf(later.samples, each) : null;
        const witness = later.worst ? later.worst[each] ?? null : undefined;
        sizes.known[each] = size;
        sizes.likely[each] = !fine ? null : sample ? sample.quantiles[0] : undefined;
        sizes.found[each] = fine ? witness : null;
        sizes.proven[each] = !fine ? null : boundSaid(later.bounds, each);
        sizes.asked[each] = target[each] === undefined ? null : target[each];
        if (target[each] !== undefined) {
          const found = [size, witness ?? null, within && sample ? sample.maximum : null];
          verdicts.push(judged(target[each], each, later.bounds, found));
          decides[each] = verdicts.at(-1) !== "missed" ? "proven" : size > target[each] ? "known" : "found";
        }
      }
      const verdict = notLive.length ? "none" : !fine ? "outside"
        : !verdicts.length ? "unasked" : together(verdicts);
      cards.show(name, verdict, said(verdict, name), sizes, decides);
      shown[name] = fine && later.samples ? later.samples : null;
    }
    view.add(Object.fromEntries(Object.entries(shown).map(([name, read]) => [name, read && read.ellipse])));
    if (shown.before || shown.after || !known.errors.before) {
      distribution.show(shown, quantity, target[quantity]);
    }
    counted(shown);
  }

  function said(verdict, name) {
    if (verdict === "outside") return words.statuses[known.status[name]] || known.status[name];
    if (known.failed && verdict === "computing") return words.failed;
    return words.verdicts[verdict];
  }

  function boundSaid(bounds, each) {
    if (bounds === undefined) return undefined;
    if (bounds.status === "proven") return bounds.magnitude[each];
    return words.bound_statuses[bounds.status] || MISSING;
  }

  function counted(shown) {
    const read = shown.after || shown.before;
    const done = read && Object.entries(known.later).every(
      ([name, {done, samples}]) => done || known.status[name] !== "ok" || !samples);
    find("count").textContent = read
      ? filled(words.drawn, {count: numbers.fixed(read.count, 0)}) : words.waiting;
    place.dataset.samples = read ? read.count : 0;
    place.dataset.settled = done ? "yes" : "no";
  }

  function legend() {
    const ends = map.legend();
    if (!ends) return;
    find("low").textContent = ends.low;
    find("high").textContent = ends.high;
    find("beyond").hidden = !ends.beyond;
    find("here").hidden = !ends.beyond && !ends.below;
    find("here").textContent = filled(words.here, ends.here);
  }

  // Which coordinates the map is over, and of which quantity it and the distribution are.
  function choices() {
    const chosen = commanded.map((name, at) => element("option", {value: at}, name));
    const selects = [find("across"), find("up")];
    selects.forEach((select, which) => {
      select.append(...chosen.map(option => option.cloneNode(true)));
      select.value = map.axes[which];
      select.addEventListener("change", () => {
        const values = selects.map(one => Number(one.value));
        if (values[0] === values[1]) {
          values[1 - which] = commanded.findIndex((_, at) => at !== values[which]);
          selects[1 - which].value = values[1 - which];
        }
        map.over(...values);
        update(false);
      });
    });
    const quantitySelect = find("quantity");
    quantitySelect.append(...quantities.map(
      name => element("option", {value: name}, words.quantities[name])));
    quantitySelect.value = quantity;
    quantitySelect.closest("label").hidden = quantities.length < 2;
    quantitySelect.addEventListener("change", () => {
      quantity = quantitySelect.value;
      update(false);
    });
    find("fit").addEventListener("click", () => { map.fit(); legend(); });
    find("reset").addEventListener("click", () => {
      moved(null);
      Object.assign(state, asInTheFile(bundle));
      controls.show();
      update(false);
    });
  }

  function drawAll() {
    view.draw();
    map.draw();
    distribution.draw();
  }

  find("scale").style.background = `linear-gradient(to right, ${colours.map(
    colour => `rgb(${colour.join(",")})`).join(",")})`;
  function sayNotLive() {
    find("not-live").replaceChildren(...notLive.map(source => {
      const size = Object.entries(source.largest || {}).map(
        ([name, value]) => numbers.error(value, name)).join(", ") || MISSING;
      const said = filled(words.not_live, {source: source.name, why: source.why, size});
      return element("li", {}, source.banded ? `${said} ${words.banded}` : said);
    }));
  }

  sayNotLive();
  choices();
  controls.show();
  const size = new ResizeObserver(drawAll), dark = matchMedia("(prefers-color-scheme: dark)");
  size.observe(place);
  dark.addEventListener("change", drawAll);

  // Shows a pose and a condition, each null where it is the file's, and tells nobody.
  function show(shown, moving = false) {
    Object.assign(state, shownOf(bundle, shown), {scale: state.scale});
    controls.show();
    update(moving);
  }

  // Draws another machine at its pose in place of what is known of this one; null: none.
  function overlay(machine) {
    if (machine === other) return;
    other = machine;
    update(false);
  }

  // Another machine in place of this one, in what is there of the page; false where its form is another.
  function exchange(next, shown) {
    if (formOf(next) !== form) return false;
    const anew = ask({op: "machine", bundle: next.bundle});
    if (String([anew.components, anew.commanded]) !== String([components, commanded])) {
      ask({op: "free", machine: anew.machine});
      return false;
    }
    ask({op: "free", machine});
    const same = rowsOf(next.bundle) === rowsOf(bundle);
    ({bundle, drawing} = next);
    ({machine} = anew);
    notLive = sourcesOf(next).filter(source => !source.live);
    within = allWithin(bundle.variables);
    known = other = null;
    const {scale} = state;
    Object.assign(state, asInTheFile(bundle));
    keepFactors(state, {scale});
    if (same) controls.fit();
    else furnish();
    sayNotLive();
    view.of(drawing);
    distribution.anew();
    worker.postMessage({bundle});
    show(shown, true);
    return true;
  }

  // Nothing of it runs any more; what the next part, of another machine, is to look like.
  function end() {
    clearTimeout(rest);
    asked = false;
    size.disconnect();
    dark.removeEventListener("change", drawAll);
    ask({op: "free", machine});
    return {state, quantity, job, view: view.kept(), map: map.kept()};
  }

  return {update, show, overlay, exchange, end, numbers, get state() { return state; }};
}

const sourcesOf = ({bundle, sources}) => bundle.sources.map(source => ({...source, ...sources[source.name]}));

// What a page's body is made of: machines that have it in common differ in numbers and controls alone.
function formOf({bundle, planar, sources}) {
  const {units, workspace, target, sources: own} = bundle;
  return JSON.stringify([planar, units, workspace, target, sources, own.map(({name, live}) => [name, live])]);
}
