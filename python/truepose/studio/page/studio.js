// The page of a studio: the live part with the file behind it. When the studio has told its state and
// fields the root has `data-studio-ready`.

const TABS = [sourcesTab, sharesTab, budgetTab, overTimeTab, partTab, calibrationTab, studiesTab,
  modesTab];
// Where a window keeps which tab it shows, for when the page is loaded again.
const KEPT_TAB = "truepose studio tab", KEPT_HASH = "truepose studio file";

async function startStudio() {
  const root = document.documentElement, host = document.getElementById("studio");
  const place = document.getElementById("live");
  const setting = JSON.parse(document.getElementById("live-setting").textContent);
  const {words, studio: said} = setting;
  const find = name => host.querySelector(`[data-studio="${name}"]`);
  const numbers = numbersOf({units: setting.units, marks: setting.marks});
  const addresses = addressesOf(location);
  let state = null, told = false, machine = null, live = null;

  // --- what the page works out by itself

  const link = shownLink({
    say: (message, refused) => socket.say(message, refused), refused: notify,
    adopt(shown) { if (live && live.part) live.part.show(shown, true); },
  });
  const moved = shown => { link.moved(shown); factors(); };
  const engine = await startEngine().catch(() => null);
  live = engine ? changingPart(place, setting, engine, moved)
    : controlsAlone(find("controls"), setting, {names: () => state.machine, moved});
  if (!engine) {
    root.dataset.liveReady = "absent";
    find("alone").hidden = false;
  } else if (setting.bundle) {
    take(setting);
  } else {
    root.dataset.liveReady = "waiting";
  }
  notLive(setting.bundle ? "" : setting.why);

  // Another machine, unless it is the one that is shown.
  function take({bundle, drawing, planar, sources}) {
    const text = JSON.stringify(bundle);
    if (text === machine || (!engine && !state)) return;
    try {
      link.file(asInTheFile(bundle));
      live.take({bundle, drawing, planar, sources}, link.now);
      machine = text;
      if (engine) root.dataset.liveReady = "drawn";
      if (told && drawn) drawn.again();
      place.dataset.machines = 1 + Number(place.dataset.machines || 0);
      notLive("");
    } catch (failure) {
      root.dataset.liveReady = "failed";
      console.error(failure);
    }
    factors();
  }

  function notLive(why) {
    find("not-live").hidden = !why;
    find("not-live").textContent = why ? filled(said.not_live, {why}) : "";
  }

  // Factors of tolerances are the page's alone: the studio answers for the file.
  function factors() {
    const {scale} = (live.part && live.part.state) || {};
    const own = !scale || (scale.compliance === 1 && Object.values(scale.half_width).every(one => one === 1));
    find("factors").hidden = own;
  }

  // --- what the studio answers

  const tell = {
    ...tellerOf({numbers, words, said, machine: () => state.machine, go: pose => link.go(pose)}),
    components: () => state.machine.components, quantities: () => state.machine.quantities,
  };
  const standing = standingOf(status);
  const drawn = engine && witnessDrawing(place, {
    words, said, tell, part: () => live.part, go: pose => link.go(pose),
  });
  const answers = answersPanel(
    {cards: find("cards"), strip: find("strip"), largest: find("largest")},
    {words, said, tell, draw: drawn && drawn.choose});
  for (const name of ["cards", "strip"]) standing.watch(find(name), "verdict");
  standing.watch(find("largest"), "known");
  standing.watch(place, "machine");
  const say = (message, refused = notify) => {
    const there = socket.say(message, refused);
    if (!there) notify(null);
    return there;
  };
  const fields = fieldsPanel(
    {list: find("fields"), filter: find("filter"), only: find("only"), count: find("count"),
      refused: find("refused")},
    {said, say: (message, refused) => socket.say(message, refused), told: count => changes.refused(count)});
  const changes = changesBar(find, {said, say, refused: notify, takeBack: fields.takeBack});
  const asked = dialogs(find, {said, say, place: host});
  const dof = count => count === state.machine.commanded.length ? state.machine.commanded
    : state.machine.components;
  const tabs = tabsPanel({list: find("tab-list"), panels: find("panels")}, TABS, {
    said, standing, say: (message, refused) => socket.say(message, refused),
    tools: {said, words, tell, numbers, addresses, dof, say, findFields: fields.find},
    chosen(name) { keep(KEPT_TAB, name); },
  });
  const names = TABS.filter(tab => tab.asked).map(tab => tab.name);
  find("report").href = addresses.report;
  const bar = host.querySelector(".studio-bar");
  new ResizeObserver(() => {
    document.body.style.setProperty("--bar", `${bar.offsetHeight}px`);
  }).observe(bar);

  // What went wrong with something that has no place of its own; null: there is no connection.
  function notify(problems) {
    find("notice").textContent = problems ? problemsText(problems, said) : said.not_connected;
  }

  function status({connected, due}) {
    const waits = due.map(name => said.answers[name] || said.tabs[name.replace("tab ", "")] || name);
    find("status").textContent = !connected ? (told ? said.lost : said.connecting)
      : waits.length ? filled(said.computes, {what: waits.join(", ")}) : said.at_rest;
    find("status").dataset.state = !connected ? "lost" : waits.length ? "computing" : "rest";
    if (told) tabs.waits();
  }

  const heard = {
    state(message) {
      // Another file than the page was made of: words, units and coordinates may be others.
      const before = state && state.file.hash;
      state = message;
      if (before && before !== message.file.hash && kept(KEPT_HASH) !== message.file.hash) {
        keep(KEPT_HASH, message.file.hash);
        location.reload();
        return;
      }
      find("notice").textContent = "";
      find("condition").hidden = message.condition === null;
      link.heard(message);
      if (drawn && !message.holds.includes("verdict")) drawn.stale();
      fields.taken();
      changes.heard(message);
      asked.heard(message);
      tabs.heard(message);
    },
    fields(message) {
      fields.take(message);
      if (message.first + message.fields.length < message.total || told) return;
      told = true;
      if (!engine && setting.bundle) take(setting);
      tabs.open(kept(KEPT_TAB));
      root.dataset.studioReady = "yes";
    },
    answer({name, value, problems}) {
      if (name === "machine") {
        if (problems) {
          root.dataset.liveReady = engine ? "waiting" : "absent";
          machine = null;
          notLive(problems[0].message);
        } else {
          take(value);
        }
      } else if (answers[name]) {
        if (problems) answers.failed[name](problems);
        else answers[name](value);
        if (drawn && name === "verdict") drawn.take(problems ? [] : value);
      }
      tabs.take(name, {value, problems});
    },
    tab({name, value, problems}) { tabs.take(`tab ${name}`, {value, problems}); },
    difference: message => asked.difference(message),
    saved: message => asked.saved(message),
    changed() {},  // the state that follows says it too
    computing() {},
  };

  const socket = socketOf(addresses.socket, {
    hear(message) {
      standing.hear(message, names);
      heard[message.type](message);
    },
    connected(there) {
      link.lost();
      fields.lost();
      standing.connected(there);
      if (there && told) tabs.again();
    },
  });
}

// What a window keeps; a browser that keeps nothing has the page begin anew.
function keep(name, value) {
  try { sessionStorage.setItem(name, value); } catch (failure) { /* it is not kept */ }
}

function kept(name) {
  try { return sessionStorage.getItem(name); } catch (failure) { return null; }
}
