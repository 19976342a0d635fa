"""Random work in the page, as hands do it: fields, sliders, tabs, dialogs, files."""

from __future__ import annotations

import random
from typing import Any

from browser import Heard
from served_studio import ServedStudio
from studio_soak.window_work import Sizes

PATIENCE = 240_000
"""Milliseconds: a busy machine is slow, and slowness is no fault here."""

READY = "html[data-studio-ready=yes]"
AT_REST = """() => document.querySelector('[data-studio=status]').dataset.state === 'rest'
  && !document.querySelector('.field.sending')
  && document.getElementById('live').dataset.stale === 'no'
  && document.getElementById('live').dataset.map === 'fine'
  && document.getElementById('live').dataset.settled === 'yes'"""
NUMBER = """name => {
  const cell = document.querySelector(`[data-of="${name}"]`);
  return cell && "si" in cell.dataset ? Number(cell.dataset.si) : null;
}"""
# The socket that is open now, so that it can be cut.
FOUND = """
  const own = globalThis.WebSocket;
  globalThis.WebSocket = class extends own {
    constructor(...of) { super(...of); globalThis.socketNow = this; }
  };"""
# What the page says when its socket is closed: it is found again a quarter of a second later.
CUT = """async () => {
  const socket = socketNow;
  await new Promise(done => { socket.addEventListener("close", done); socket.close(); });
  return document.querySelector("[data-studio=status]").dataset.state;
}"""
# A field by its place among all, another value by a factor, or what is no value.
TYPE = """([share, factor, none]) => {
  const all = [...document.querySelectorAll("[data-key]")];
  const input = all[Math.floor(share * all.length)].querySelector("input, select");
  if (input.tagName === "SELECT") {
    input.selectedIndex = Math.floor(share * 1000) % input.options.length;
  } else if (none !== null) {
    input.value = none;
  } else {
    const other = number => Number((number * factor).toPrecision(6));
    input.value = input.value.replace(/\\d+(\\.\\d+)?/, other);
  }
  input.dispatchEvent(new Event("input"));
  input.dispatchEvent(new Event("change"));
}"""
STEP = """async ([share, keys]) => {
  const all = [...document.querySelectorAll("[data-key] input")];
  const input = all[Math.floor(share * all.length)];
  input.closest("details").open = true;
  input.focus();
  for (const [key, shiftKey] of keys) {
    input.dispatchEvent(new KeyboardEvent("keydown", {key, shiftKey, bubbles: true}));
    await new Promise(done => setTimeout(done, 15));
  }
  input.blur();
}"""
# By the pointer, which holds the slider until it is let go, or by keys, which follow the focus.
SLIDE = """async ([share, path, pointer]) => {
  const found = () => {
    const all = [...document.querySelectorAll("#live input[type=range]")];
    return all[Math.floor(share * all.length)];
  };
  if (pointer) found().dispatchEvent(new PointerEvent("pointerdown", {bubbles: true}));
  for (const part of path) {
    const range = found();
    range.value = Number(range.min) + part * (range.max - range.min);
    range.dispatchEvent(new Event("input"));
    await new Promise(done => requestAnimationFrame(done));
  }
  if (pointer) found().dispatchEvent(new PointerEvent("pointerup", {bubbles: true}));
}"""
CLICK = """([selector, share]) => {
  const all = [...document.querySelectorAll(selector)].filter(
    one => one.checkVisibility({visibilityProperty: true}));
  if (all.length) all[Math.floor(share * all.length)].click();
}"""
CHOOSE = """share => {
  const all = [...document.querySelectorAll("#live select")];
  const select = all[Math.floor(share * all.length)];
  select.selectedIndex = Math.floor(share * 1000) % select.options.length;
  select.dispatchEvent(new Event("change"));
}"""
FIND = """words => {
  const filter = document.getElementById("studio-filter");
  filter.value = words;
  filter.dispatchEvent(new Event("input"));
}"""
FILL = """([selector, share, text]) => {
  for (const input of document.querySelectorAll(selector)) {
    input.value = text;
    input.dispatchEvent(new Event("input"));
  }
}"""


class PageWork:
    """What is done in the page, each a method; by chance alone."""

    def __init__(
        self,
        browser: Any,
        studio: ServedStudio,
        chance: random.Random,
        measured: bytes,
        before: str,
    ) -> None:
        self.browser, self.studio = browser, studio
        self.chance, self.measured = chance, measured
        self.heard, self.sizes = Heard(), Sizes()
        self.page = browser.new_page()
        self._listen(self.page)
        self.page.add_init_script(FOUND + before)
        self.page.goto(studio.address, wait_until="load")
        self.page.wait_for_selector(READY, timeout=PATIENCE)
        self.tools = browser.new_cdp_session(self.page)
        self.tools.send("Performance.enable")

    def _listen(self, page: Any) -> None:
        """What a page complains of, and what it is told by the studio."""
        self.heard.listen(page)
        page.on("websocket", lambda socket: socket.on("framereceived", self.sizes.take))

    def rest(self) -> None:
        """Wait until everything is answered, here and by the studio."""
        self.page.wait_for_function(AT_REST, timeout=PATIENCE)

    def calm(self) -> None:
        """As it was opened: nothing looked for, nothing refused, the first tab, and no factors.

        Factors of tolerances and stiffness are the page's alone: no window's reset undoes them.
        """
        self.page.keyboard.press("Escape")
        self.page.evaluate(FIND, "")
        self.page.evaluate(CLICK, ["[data-studio=reset]", 0.0])
        self.page.evaluate(CLICK, ["[data-live=reset]", 0.0])
        self.page.evaluate(CLICK, ["#tab-sources", 0.0])
        self.page.evaluate("() => document.activeElement.blur()")

    def type(self, spread: float = 0.01) -> None:
        """Another value of a field, by some share of it."""
        factor = 1.0 + self.chance.gauss(0.0, spread)
        self.page.evaluate(TYPE, [self.chance.random(), factor, None])

    def refused(self) -> None:
        """What no field takes."""
        none = self.chance.choice(("wide", "", "5 N", "[1,", "1e999", "\u202e", '"'))
        self.page.evaluate(TYPE, [self.chance.random(), 1.0, none])

    def step(self) -> None:
        """A field's last digit, by arrow keys, and perhaps back by Escape."""
        keys = [
            [self.chance.choice(("ArrowUp", "ArrowDown")), self.chance.random() < 0.2]
            for _ in range(self.chance.randrange(1, 12))
        ]
        if self.chance.random() < 0.3:
            keys.append(["Escape", False])
        self.page.evaluate(STEP, [self.chance.random(), keys])

    def slide(self) -> None:
        """A slider of the live part, dragged."""
        at, path = self.chance.random(), []
        for _ in range(self.chance.randrange(3, 25)):
            at = min(1.0, max(0.0, at + self.chance.gauss(0.0, 0.05)))
            path.append(at)
        self.page.evaluate(SLIDE, [self.chance.random(), path, self.chance.random() < 0.5])

    def click(self) -> None:
        """A button: of changes, of tabs, of the live part, a pose that is gone to."""
        selector = self.chance.choice(
            (
                "[data-studio=undo]", "[data-studio=redo]", "[data-studio=reset]", "[role=tab]",
                "[role=tab]", "button.go", "button.back", "[data-live=reset]", "[data-live=fit]",
                "[data-studio=refused]", "[data-studio=only]", "summary", "canvas",
            )
        )  # fmt: skip
        self.page.evaluate(CLICK, [selector, self.chance.random()])

    def choose(self) -> None:
        """Another quantity, or other coordinates of the map."""
        self.page.evaluate(CHOOSE, self.chance.random())

    def map(self) -> None:
        """A pose in the map, dragged by the pointer."""
        box = self.page.locator("[data-live=map]").bounding_box()
        if box is None:
            return
        self.page.mouse.move(box["x"] + 80, box["y"] + 40)
        self.page.mouse.down()
        for _ in range(self.chance.randrange(1, 8)):
            x, y = (self.chance.uniform(0.1, 0.9) for _ in range(2))
            self.page.mouse.move(box["x"] + x * box["width"], box["y"] + y * box["height"])
        self.page.mouse.up()

    def find(self) -> None:
        """Words that are looked for among the fields."""
        self.page.evaluate(
            FIND, self.chance.choice(("", "strut", "tolerance", "strut.1.x", "\\[("))
        )

    def difference(self) -> None:
        """The difference, looked at."""
        self.page.evaluate(CLICK, ["[data-studio=difference]", 0.0])
        self.page.wait_for_function(
            "() => document.querySelector('[data-studio=difference-text]').textContent.length > 0",
            timeout=PATIENCE,
        )
        self.page.keyboard.press("Escape")

    def save(self) -> None:
        """Save as, under a name that is taken or not."""
        name = self.chance.choice(("page_1.toml", "page_2.toml", "../up.toml", "m.txt"))
        self.page.evaluate(CLICK, ["[data-studio=save]", 0.0])
        self.page.evaluate(FILL, ["[data-studio=save-name]", 0.0, name])
        self.page.evaluate(CLICK, ["[data-studio=save-form] button[type=submit]", 0.0])
        self.page.evaluate(CLICK, ["[data-studio=save-dialog] [data-close]", 0.0])

    def drop(self) -> None:
        """A file, good or not, and the poses to measure next."""
        self.page.evaluate(CLICK, ["#tab-calibration", 0.0])
        size = self.chance.choice((10, 1000, 1_000_000))
        content = self.chance.choice(
            (self.measured, self.measured, self.measured[:-400], self.chance.randbytes(size))
        )
        file = {"name": "measured.csv", "mimeType": "text/csv", "buffer": content}
        self.page.set_input_files("#dropped-file", file)
        if self.chance.random() < 0.4:
            self.page.evaluate(CLICK, ["[data-tab=calibration] form.asked button", 0.0])

    def part(self) -> None:
        """A program beside the file, or one that is not there."""
        self.page.evaluate(CLICK, ["#tab-part", 0.0])
        name = self.chance.choice(("part.ngc", "none.ngc", "../part.ngc"))
        self.page.evaluate(FILL, ["[data-tab=part] form input", 0.0, name])
        self.page.evaluate(CLICK, ["[data-tab=part] form button", 0.0])

    def cut(self) -> None:
        """The connection is lost, which the page says at once, and found again."""
        state = self.page.evaluate(CUT)
        if state != "lost":
            self.sizes.faults.append(f"a page without connection says {state}")
        self.page.wait_for_function("() => socketNow.readyState === 1", timeout=PATIENCE)

    def look(self) -> None:
        """Another size of the window, another colour scheme."""
        width, height = self.chance.choice(((1200, 900), (700, 900), (1800, 1000), (420, 800)))
        self.page.set_viewport_size({"width": width, "height": height})
        self.page.emulate_media(color_scheme=self.chance.choice(("light", "dark")))

    def second(self) -> None:
        """Another window of the browser, with something done in it, and closed."""
        page = self.browser.new_page()
        self._listen(page)
        page.goto(self.studio.address, wait_until="load")
        page.wait_for_selector(READY, timeout=PATIENCE)
        if self.chance.random() < 0.7:
            page.evaluate(TYPE, [self.chance.random(), 1.001, None])
            page.evaluate(CLICK, ["[role=tab]", self.chance.random()])
        page.close()
        self.page.bring_to_front()
