// Files that are dropped on the page: posted to the studio, which holds them in memory alone.

const LARGEST_FILE = 20000000;

// A place to drop a file or to choose one, and the files that are held. `chosen` is told the number
// of one, or null.
function droppedFiles(host, {said, numbers, addresses, say, chosen}) {
  const input = element("input", {type: "file", id: "dropped-file", className: "hidden"});
  const choose = element("label", {htmlFor: "dropped-file"}, said.choose_file);
  const select = element("select", {"aria-label": said.file_shown});
  const forget = element("button", {type: "button"}, said.forget);
  const problem = element("p", {className: "problem", role: "alert"});
  const place = element("div", {className: "drop"}, input, choose, element("span", {}, ` ${said.or_drop}`));
  const held = element("p", {className: "held"}, select, " ", forget);
  host.append(place, held, problem);
  let files = [], current = null;

  async function send(file) {
    problem.textContent = "";
    if (file.size > LARGEST_FILE) { problem.textContent = said.too_large; return; }
    try {
      const answer = await fetch(addresses.files(file.name), {method: "POST", body: file});
      const told = await answer.json();
      if (told.problems) { problem.textContent = problemsText(told.problems, said); return; }
      current = told.file;
      show();
      chosen(current);
    } catch (failure) {
      problem.textContent = said.not_connected;
    }
  }

  function show() {
    const size = bytes => `${numbers.fixed(bytes / 1000, bytes < 10000 ? 1 : 0)} kB`;
    select.replaceChildren(...files.map(({file, name, size: bytes}) =>
      element("option", {value: file}, `${name} (${size(bytes)})`)));
    if (current !== null) select.value = current;
    held.hidden = !files.length;
  }

  input.addEventListener("change", () => {
    if (input.files.length) send(input.files[0]);
    input.value = "";
  });
  for (const name of ["dragenter", "dragover"]) {
    place.addEventListener(name, event => { event.preventDefault(); place.classList.add("over"); });
  }
  place.addEventListener("dragleave", () => place.classList.remove("over"));
  place.addEventListener("drop", event => {
    event.preventDefault();
    place.classList.remove("over");
    if (event.dataTransfer.files.length) send(event.dataTransfer.files[0]);
  });
  select.addEventListener("change", () => { current = Number(select.value); chosen(current); });
  forget.addEventListener("click", () => { if (select.value) say({type: "forget", file: Number(select.value)}); });
  show();

  return {
    get current() { return current; },
    heard(now) {
      files = now;
      if (current !== null && !files.some(({file}) => file === current)) {
        current = files.length ? files.at(-1).file : null;
        chosen(current);
      }
      show();
    },
  };
}
