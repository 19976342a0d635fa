// What a page does: it unpacks plotly.js and the figures' data, draws them, by day and by night and
// for print, gives data as CSV, and shows in the contents where one is. When all figures are
// drawn the root element has `data-ready`.
(() => {
  const root = document.documentElement;
  // How wide a figure is drawn that is printed, in pixels; page.css makes it as wide as the paper.
  const PRINT_WIDTH = 900;
  const HALF_PAGE = 410, WHOLE_PAGE = 1080;
  const BESIDE = {width: 420, height: 400};
  const forPrint = location.hash === "#print";
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const narrow = matchMedia("(max-width: 640px)");
  let drawn = {};

  async function unpacked(id) {
    const text = document.getElementById(id).textContent;
    const bytes = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
  }

  async function runPlotly() {
    const content = await (await unpacked("plotly")).blob();
    const address = URL.createObjectURL(new Blob([content], {type: "text/javascript"}));
    await new Promise((done, failed) => {
      const script = document.createElement("script");
      script.src = address;
      script.onload = done;
      script.onerror = () => failed(new Error("plotly.js does not run"));
      document.head.append(script);
    });
    URL.revokeObjectURL(address);
  }

  // A copy in which every text that is a colour of `colours` is what that says.
  function coloured(value, colours) {
    if (typeof value === "string") return colours[value] || value;
    if (Array.isArray(value)) return value.map(each => coloured(each, colours));
    if (value === null || typeof value !== "object") return value;
    const copy = {};
    for (const name in value) copy[name] = coloured(value[name], colours);
    return copy;
  }

  // What figures/_flow.py changes on a small screen: "xaxis2.domain" and its value, and so on.
  function narrowed(layout) {
    for (const [path, value] of Object.entries((layout.meta || {}).narrow || {})) {
      const steps = path.replace(/\[(\d+)\]/g, ".$1").split("."), last = steps.pop();
      let at = layout;
      for (const step of steps) at = at[step] = at[step] || {};
      at[last] = value;
    }
  }

  function draw(name, printed) {
    const {data, layout} = drawn.figures[name];
    const night = dark.matches && !printed;
    const colours = night ? drawn.dark : {};
    const ofTemplate = night ? {...drawn.dark, ...drawn.templateDark} : {};
    const shown = {
      template: coloured(drawn.template, ofTemplate), uirevision: name, ...coloured(layout, colours),
    };
    if (narrow.matches && !printed) narrowed(shown);
    const place = document.getElementById("figure-" + name);
    if (printed) {
      Object.assign(shown, place.closest(".beside")
        ? BESIDE : {width: PRINT_WIDTH, height: printedHeight(layout.height)});
      place.style.width = shown.width + "px";
    } else {
      place.style.width = "";
    }
    place.style.height = shown.height + "px";
    const settings = {...drawn.settings, responsive: !printed};
    return Plotly.react(place, coloured(data, colours), shown, settings);
  }

  // Two figures stand on a page where that squeezes none too much.
  function printedHeight(height) {
    return height <= 1.4 * HALF_PAGE ? Math.min(height, HALF_PAGE) : Math.min(height, WHOLE_PAGE);
  }

  function drawAll(printed) {
    for (const name in drawn.figures) draw(name, printed);
  }

  function unfold() {
    for (const each of document.querySelectorAll("details:not([open])")) {
      each.open = true;
      each.dataset.folded = "";
    }
  }

  function fold() {
    for (const each of document.querySelectorAll("details[data-folded]")) {
      each.open = false;
      delete each.dataset.folded;
    }
  }

  function followPrint() {
    if (forPrint) return;
    addEventListener("beforeprint", () => { unfold(); drawAll(true); });
    addEventListener("afterprint", () => { fold(); drawAll(false); });
    for (const each of [dark, narrow]) each.addEventListener("change", () => drawAll(false));
  }

  function saved(name, text) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], {type: "text/csv"}));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  function csvOf(button) {
    const {figure: name, file} = button.dataset;
    if (name) return saved(file, figureData(drawn.figures[name].data, drawn.figures[name].layout));
    const figure = button.closest("figure");
    const cells = row => Array.from(row.cells, cell => cell.textContent);
    const table = figure.querySelector("table");
    const header = table.tHead ? cells(table.tHead.rows[0]) : [];
    saved(file, tableData(header, Array.from(table.tBodies[0].rows, cells)));
  }

  // The keyboard goes to a table only where there is something to scroll: in a wide window, or where
  // its details are closed, there is not. The live part's tables change, and are reached always.
  function followWidths() {
    const observer = new ResizeObserver(() => {
      for (const each of tables) {
        if (each.scrollWidth > each.clientWidth + 1) each.tabIndex = 0;
        else each.removeAttribute("tabindex");
      }
    });
    const tables = document.querySelectorAll(".scroll:not([data-live])");
    for (const each of tables) observer.observe(each);
  }

  function followPlace() {
    const nav = document.querySelector("nav");
    const links = Array.from(nav.querySelectorAll("a"));
    const targets = links.map(link => document.getElementById(link.hash.slice(1)));
    let current, asked = false;
    function look() {
      asked = false;
      const line = innerHeight * 0.3;
      let at = 0;
      targets.forEach((target, index) => {
        if (target.getBoundingClientRect().top <= line) at = index;
      });
      if (links[at] === current) return;
      if (current) current.removeAttribute("aria-current");
      current = links[at];
      current.setAttribute("aria-current", "true");
      const list = nav.firstElementChild;
      list.scrollLeft = current.offsetLeft - 40;
      nav.scrollTop = current.offsetTop - nav.clientHeight / 2;
    }
    addEventListener("scroll", () => {
      if (!asked) requestAnimationFrame(look);
      asked = true;
    }, {passive: true});
    look();
  }

  // Spatial figures are there a frame after they are drawn; no frame comes to a hidden page.
  function nextFrames() {
    return Promise.race([
      new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done))),
      new Promise(done => setTimeout(done, 500)),
    ]);
  }

  async function start() {
    followPlace();
    followWidths();
    if (forPrint) unfold();
    // The live part, where there is one, comes first: plotly.js keeps the page busy.
    if (typeof liveStarted !== "undefined") await liveStarted;
    try {
      drawn = await (await unpacked("figures-data")).json();
      await runPlotly();
      for (const name in drawn.figures) {
        await draw(name, forPrint);
        await new Promise(done => setTimeout(done));
      }
      followPrint();
      for (const each of document.querySelectorAll("button.csv")) {
        each.addEventListener("click", () => csvOf(each));
      }
      await nextFrames();
      root.dataset.ready = "drawn";
    } catch (failure) {
      document.getElementById("not-drawn").style.display = "block";
      root.dataset.ready = "failed";
      console.error(failure);
    }
  }

  start();
})();
