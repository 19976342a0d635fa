// The live part begins, and is given another machine while the page stands. When it is drawn for the
// first time the root has `data-live-ready`: "drawn", "absent" or "failed".

// The kernel, here and in a worker that is told of every step and drops what it had; null where the
// browser lacks what that takes.
async function startEngine() {
  if (typeof WebAssembly === "undefined" || typeof Worker === "undefined") return null;
  const text = id => document.getElementById(id).textContent;
  let module;
  try {
    module = await compiledModule(text("live-kernel"));
  } catch (failure) {
    return null;  // a browser without simd does not compile it
  }
  const address = URL.createObjectURL(new Blob([text("live-worker")], {type: "text/javascript"}));
  const worker = new Worker(address);
  worker.postMessage({module});
  return {ask: await kernelOf(module), worker};
}

// A live part whose machine can be changed: what is shown stays as far as the new one has it.
function changingPart(place, setting, engine, moved) {
  const body = () => place.querySelector(".live-body"), blank = body().cloneNode(true);
  let part = null, held = false, waiting = null;

  // Bundle, drawing and `planar` of a machine, and the pose and condition that are shown of it.
  function take(machine, shown) {
    // What is being dragged must not go away under the pointer.
    if (held) { waiting = [machine, shown]; return; }
    const begun = performance.now();
    const focus = part && placeOfFocus(body()), open = part && openDetails(body()).map(one => one.open);
    if (!part || !part.exchange(machine, shown)) begin(machine, shown);
    if (open) openDetails(body()).forEach((one, at) => { one.open = open[at] ?? one.open; });
    if (focus) focusAgain(body(), focus);
    place.dataset.taken = performance.now() - begun;
  }

  // A part of a machine of another form takes a body of its own.
  function begin(machine, shown) {
    const before = part && part.end();
    if (part) body().replaceWith(blank.cloneNode(true));
    part = livePart(place, {...setting, ...machine}, engine, {moved, before});
    part.show(shown, true);
  }

  place.addEventListener("pointerdown", event => { held = body().contains(event.target); });
  for (const name of ["pointerup", "pointercancel"]) {
    document.addEventListener(name, () => {
      held = false;
      const late = waiting;
      waiting = null;
      if (late) take(...late);
    });
  }

  return {take, get part() { return part; }};
}

const openDetails = host => [...host.querySelectorAll("details")];

// Where in a part the focus is, by what the part that takes its place has too; null: elsewhere.
function placeOfFocus(host) {
  const active = document.activeElement;
  if (!host.contains(active)) return null;
  const row = active.closest("[data-of]");
  if (row) return `[data-of="${row.dataset.of}"] input[type="${active.type}"]`;
  return active.dataset.live ? `[data-live="${active.dataset.live}"]` : null;
}

function focusAgain(host, selector) {
  const again = host.querySelector(selector);
  if (again) again.focus({preventScroll: true});
}

async function startLive() {
  const root = document.documentElement, place = document.getElementById("live");
  if (!place || !place.querySelector(".live-body") || location.hash === "#print") return;
  try {
    const engine = await startEngine();
    if (!engine) {
      root.dataset.liveReady = "absent";
      return;
    }
    const setting = JSON.parse(document.getElementById("live-setting").textContent);
    livePart(place, setting, engine).update(true);
    place.dataset.ready = performance.now();
    root.dataset.liveReady = "drawn";
  } catch (failure) {
    root.dataset.liveReady = "failed";
    console.error(failure);
  }
}
