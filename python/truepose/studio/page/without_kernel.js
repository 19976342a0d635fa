// Pose, temperatures and load of a page that cannot run the kernel: the studio answers all of it.

function controlsAlone(host, setting, {names, moved}) {
  let state = null, controls = null, bundle = null;

  // As of a live part: another machine, and what is shown of it.
  function take(machine, shown) {
    bundle = machine.bundle;
    const {commanded, components} = names();
    const numbers = numbersOf({units: bundle.units, marks: setting.marks});
    state = shownOf(bundle, shown);
    controls = controlsOf({
      bundle: () => bundle, components, commanded, state, words: setting.words, numbers,
      changed: () => moved(state),
    });
    const {pose, temperature, load} = setting.words, kept = [pose, temperature, load];
    const groups = controls.groups.filter(([title]) => kept.includes(title));
    const back = element("button", {type: "button"}, setting.studio.as_in_file);
    back.addEventListener("click", () => {
      moved(null);
      show(AS_IN_FILE);
    });
    host.replaceChildren(...groups.map(([title, place]) =>
      element("fieldset", {}, element("legend", {}, title), place)), back);
    controls.show();
  }

  function show(shown) {
    if (!state) return;
    Object.assign(state, shownOf(bundle, shown));
    controls.show();
  }

  return {take, part: {show, get state() { return state; }}};
}
