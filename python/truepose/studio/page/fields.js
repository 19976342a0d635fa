// Every number of the file, by table; groups, which stand for several parameters, first.

// Tables that say what is asked and where, after the groups; and those that are open at first.
const NEXT = ["[accuracy]", "[condition]", "[workspace]"];
const OPEN = ["[accuracy]", "[condition]"];
const MOST_OPEN = 30;

function fieldsPanel({list, filter, only, count, refused}, {said, say, told}) {
  let rows = new Map(), tables = [], shape = "", gathered = [], about = {}, edited = 0;

  const send = (key, value, joins, refused) =>
    say({type: "edit", edits: [[key, value]], ...(joins ? {joins} : {})}, refused);

  // A message with fields, or with a piece of them.
  function take(message) {
    if (message.first === 0) [gathered, about] = [[], {}];
    gathered.push(...message.fields);
    Object.assign(about, message.about);
    if (gathered.length === message.total) show();
  }

  function show() {
    const now = gathered.map(({key, table, choices}) => `${table} ${key} ${choices}`).join("\n");
    if (now !== shape) build();
    shape = now;
    for (const field of gathered) {
      rows.get(field.key).show(field, about[field.about] || "");
    }
    edited = gathered.filter(field => field.edited).length;
    for (const table of tables) {
      const changed = table.fields.filter(key => rows.get(key).row.classList.contains("edited")).length;
      table.count.textContent = changed
        ? filled(said.some_changed, {count: table.fields.length, changed}) : table.fields.length;
    }
    sift();
  }

  // How many texts stand in fields that the file's reader refused: no answer is of them.
  function refusals() {
    const all = [...rows.values()].filter(row => row.isRefused());
    refused.hidden = all.length === 0;
    refused.textContent = filled(all.length === 1 ? said.one_refused : said.refused, {count: all.length});
    told(all.length);
  }

  refused.addEventListener("click", () => {
    const first = [...rows.values()].find(row => row.isRefused());
    filter.value = "";
    only.checked = false;
    sift();
    first.row.closest("details").open = true;
    first.input.focus();
  });

  // The rows of a file of another shape; what is being typed in goes, what is focused stays.
  function build() {
    const focused = document.activeElement && document.activeElement.closest("[data-key]");
    rows = new Map();
    const byTable = new Map();
    for (const field of gathered) {
      if (!byTable.has(field.table)) byTable.set(field.table, []);
      byTable.get(field.table).push(field);
    }
    const rank = ([name, fields]) => fields.some(field => field.group) ? 0 : NEXT.includes(name) ? 1 : 2;
    const sorted = [...byTable].map((entry, at) => [rank(entry), at, entry]).sort(
      ([a, i], [b, j]) => a - b || i - j);
    tables = sorted.map(([first, , [name, fields]]) => {
      const number = element("span", {className: "count"});
      const place = element("details", {className: "table"},
        element("summary", {}, element("code", {}, name), " ", number));
      if (!wasOpen.has(name)) {
        wasOpen.set(name, (first === 0 && fields.length <= MOST_OPEN) || OPEN.includes(name));
      }
      place.open = wasOpen.get(name);
      for (const field of fields) {
        const row = fieldRow(field, {said, send, changed: refusals});
        rows.set(field.key, row);
        place.append(row.row);
      }
      place.addEventListener("toggle", () => { if (!sifting()) wasOpen.set(name, place.open); });
      return {name, place, count: number, fields: fields.map(({key}) => key)};
    });
    list.replaceChildren(...tables.map(({place}) => place));
    if (focused && rows.has(focused.dataset.key)) rows.get(focused.dataset.key).input.focus();
    refusals();
  }

  // Which tables are open while nothing is looked for.
  const wasOpen = new Map();
  const sifting = () => filter.value.trim() !== "" || only.checked;

  // Shows what fits the words that are looked for, and opens where it stands.
  function sift() {
    const wanted = filter.value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    let found = 0;
    for (const {name, place, fields} of tables) {
      let here = 0;
      for (const key of fields) {
        const {row} = rows.get(key);
        const fits = (!only.checked || row.classList.contains("edited"))
          && wanted.every(word => isNamed(word, key, name, row.title));
        row.hidden = !fits;
        if (fits) here++;
      }
      place.hidden = here === 0;
      if (sifting()) place.open = here > 0;
      else place.open = wasOpen.get(name);
      found += here;
    }
    count.textContent = sifting()
      ? filled(said.fields_found, {found, total: rows.size})
      : filled(edited ? said.fields_changed : said.fields_all, {total: rows.size, changed: edited});
  }

  filter.addEventListener("input", sift);
  only.addEventListener("change", sift);
  filter.addEventListener("keydown", event => {
    if (event.key !== "Escape" || !filter.value) return;
    event.preventDefault();
    filter.value = "";
    sift();
  });

  return {
    take,
    taken() { for (const row of rows.values()) row.taken(); },
    lost() { for (const row of rows.values()) row.lost(); },
    takeBack() { for (const row of rows.values()) row.takeBack(); },
    // Look for the fields of a parameter.
    find(words) {
      filter.value = words;
      only.checked = false;
      sift();
      filter.focus();
    },
  };
}

// Whether a word names a field: it is in its key, table or description, or is a parameter that the
// field's pattern stands for, or part of one.
function isNamed(word, key, table, description) {
  if (`${key} ${table} ${description}`.toLowerCase().includes(word)) return true;
  const pattern = key.startsWith("tolerance.") ? key.slice("tolerance.".length)
    : key.startsWith("each.") ? key.replace(/^each\.(\w+)\./, "$1.*.") : null;
  if (pattern === null || !word.includes(".")) return false;
  const plain = pattern.toLowerCase().replace(/_tolerance$/, "");
  const parts = plain.split("*").map(part => part.replace(/[.?+^$()[\]{}|\\]/g, "\\$&"));
  return new RegExp(`^${parts.join("[^.]*")}`).test(word);
}
