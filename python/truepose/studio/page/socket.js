// The connection with the studio. It is lost when the studio ends, and found again when it is back:
// address and token are the same then.

const FIRST_WAIT = 250, LONGEST_WAIT = 4000;
// Characters of a refused message that come back, and messages whose refusal is waited for.
const QUOTED = 1000, REMEMBERED = 200;

// `hear` is told every message, `connected` whether there is a connection.
function socketOf(address, {hear, connected}) {
  let socket = null, wait = FIRST_WAIT;
  const sent = new Map();

  function connect() {
    socket = new WebSocket(address);
    socket.onopen = () => { wait = FIRST_WAIT; connected(true); };
    socket.onmessage = ({data}) => {
      const message = JSON.parse(data);
      if (message.type === "refused") refuse(message);
      else hear(message);
    };
    socket.onclose = () => {
      connected(false);
      setTimeout(connect, wait);
      wait = Math.min(LONGEST_WAIT, 2 * wait);
    };
  }

  function refuse({of, problems}) {
    const refused = sent.get(of);
    sent.delete(of);
    if (refused) refused(problems);
  }

  // Says something, if there is a connection; `refused` is called with what is wrong with it.
  function say(message, refused = null) {
    if (!socket || socket.readyState !== WebSocket.OPEN) return false;
    const text = JSON.stringify(message), quoted = [...text].slice(0, QUOTED).join("");
    sent.delete(quoted);
    sent.set(quoted, refused);
    if (sent.size > REMEMBERED) sent.delete(sent.keys().next().value);
    socket.send(text);
    return true;
  }

  connect();
  return {say};
}

// The address of the studio's own socket, and of what else it serves, with the token of the page's.
function addressesOf({host, search}) {
  const token = new URLSearchParams(search).get("token") || "";
  const withToken = (path, more = {}) => `${path}?${new URLSearchParams({token, ...more})}`;
  return {
    socket: `ws://${host}${withToken("/socket")}`, report: withToken("/report"),
    files: name => withToken("/files", {name}),
  };
}

// What is wrong, in the words of the file's own reader.
function problemText({message, found, expected, hint}, words) {
  return [
    message, found && filled(words.found, {found}), expected && filled(words.expected, {expected}),
    hint,
  ].filter(Boolean).join(" \u00b7 ");
}

const problemsText = (problems, words) => problems.map(one => problemText(one, words)).join("\n");
