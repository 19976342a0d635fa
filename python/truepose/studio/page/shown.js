// The pose and the condition that are shown: told to the studio when somebody moves them here, and
// heard from it when that was another window. One message is under way at a time.

const AS_IN_FILE = {pose: null, condition: null};

function shownLink({say, adopt, refused}) {
  let now = AS_IN_FILE, sent = null, wanted = null, own = null;
  const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

  // What of a state is the file's own is told as null, so that it follows the file.
  function plain({pose, condition}) {
    return {
      pose: own && same(pose, own.pose) ? null : [...pose],
      condition: own && same(condition, own.condition) ? null : {
        temperature: {...condition.temperature}, wrench: [...condition.wrench],
      },
    };
  }

  function send() {
    if (sent || !wanted || same(wanted, now)) return;
    const message = {type: "show", ...wanted}, asked = wanted;
    const there = say(message, problems => {
      sent = wanted = null;
      refused(problems);
      if (!same(asked, now)) adopt(now);
    });
    if (there) sent = asked;
  }

  function want(shown) {
    wanted = shown;
    send();
  }

  return {
    get now() { return wanted || now; },
    // `file`: pose and condition of the machine file, as the page has them.
    file(state) { own = {pose: state.pose, condition: state.condition}; },
    moved(state) { want(state ? plain(state) : AS_IN_FILE); },
    // Go to a pose, in the condition shown.
    go(pose) {
      want({...(wanted || now), pose});
      adopt(wanted);
    },
    heard({pose, condition}) {
      const before = now;
      now = {pose, condition};
      if (sent) {
        if (!same(now, sent)) return;  // of another window, and ours follows
        sent = null;
        if (wanted && !same(wanted, now)) { send(); return; }
        wanted = null;
      } else if (wanted) {
        send();
      } else if (!same(before, now)) {
        adopt(now);
      }
    },
    lost() { sent = null; },
  };
}
