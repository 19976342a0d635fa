// Which numbers belong to what is set now. A place whose numbers do not has `data-stale="yes"`.

function standingOf(changed) {
  const places = [], given = new Map();
  let number = -1, holds = new Set(), due = new Set(), connected = false, tab = null;

  // Of an answer; one that was never given is not stale, but not there.
  function isStale(name) {
    if (!given.has(name)) return false;
    if (!connected || waits(name)) return true;
    // What tabs follow from only the studio knows: it says when they come anew.
    return !isTab(name) && given.get(name) < number && !holds.has(name);
  }

  const isTab = name => name.startsWith("tab ");
  // Tabs of other windows come too, and are not told to this one.
  const waits = name => due.has(name) && (!isTab(name) || name === tab);

  function show() {
    for (const {host, name} of places) {
      host.dataset.stale = isStale(name) ? "yes" : "no";
      host.setAttribute("aria-busy", String(isStale(name) || waits(name)));
    }
    const stale = places.map(({name}) => name).filter(isStale);
    changed({connected, due: [...new Set([...due].filter(waits).concat(connected ? stale : []))]});
  }

  return {
    // Grey a place as long as its answer is not of what is set.
    watch(host, name) { places.push({host, name}); },
    hear(message, tabs) {
      const named = name => tabs.includes(name) ? `tab ${name}` : name;
      if (message.type === "state") {
        number = message.number;
        holds = new Set(message.holds);
      } else if (message.type === "computing") {
        due = new Set(message.answers.map(named));
      } else if (message.type === "answer" || message.type === "tab") {
        const name = message.type === "tab" ? `tab ${message.name}` : message.name;
        given.set(name, message.number);
        if (message.number >= number) due.delete(name);
      }
      show();
    },
    connected(there) {
      connected = there;
      if (!there) due = new Set();
      show();
    },
    // Which tab this window shows; what was asked for another one does not come any more.
    shows(name) {
      if (tab !== name) due.delete(name);
      tab = name;
      show();
    },
    waits,
  };
}
