"""A page of a studio in a browser, as somebody uses it: fields are set, numbers are read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from browser import PATIENCE, Heard
from served_studio import ServedStudio

PIXELS = """name => document.querySelector(`#live [data-live="${name}"]`).toDataURL()"""
NUMBER = """name => {
  const cell = document.querySelector(`[data-of="${name}"]`);
  return cell && "si" in cell.dataset ? Number(cell.dataset.si) : null;
}"""
AT_REST = """() => document.querySelector('[data-studio=status]').dataset.state === 'rest'
  && !document.querySelector('.field.sending')
  && document.getElementById('live').dataset.stale === 'no'
  && document.getElementById('live').dataset.map === 'fine'
  && document.getElementById('live').dataset.settled === 'yes'"""


@dataclass(kw_only=True)
class Visit(Heard):
    """A page of a studio."""

    page: Any
    studio: ServedStudio
    folder: Path

    def rest(self) -> None:
        """Wait until everything is answered, here and by the studio."""
        self.page.wait_for_function(AT_REST, timeout=PATIENCE)

    def input(self, key: str) -> Any:
        return self.page.locator(f'[data-key="{key}"] input')

    def problem(self, key: str) -> Any:
        return self.page.locator(f'[data-key="{key}"] .problem')

    def find(self, words: str) -> None:
        self.page.locator("#studio-filter").fill(words)

    def set(self, key: str, text: str) -> None:
        """Type a value into its field, and wait until the file has it, and the answers."""
        self.find(key)
        self.input(key).fill(text)
        self.input(key).press("Enter")
        self.page.wait_for_function(
            """([key, text]) => {
              const row = document.querySelector(`[data-key="${key}"]`);
              const {value} = row.querySelector("input");
              return !row.classList.contains("sending") && value === text;
            }""",
            arg=[key, text],
            timeout=PATIENCE,
        )
        self.rest()

    def number(self, name: str) -> float:
        found = self.page.evaluate(NUMBER, name)
        assert found is not None, name
        return float(found)

    def looks(self) -> dict[str, str]:
        """Pixels of the machine and the map, and the words of the answers."""
        told = {name: self.page.evaluate(PIXELS, name) for name in ("machine", "map")}
        for name in ("cards", "largest", "strip"):
            told[name] = self.page.locator(f"[data-studio={name}]").inner_text()
        return told | {"quick": self.page.locator("[data-live=cards]").inner_text()}


def opened(browser: Any, studio: ServedStudio, folder: Path, before: str = "") -> Visit:
    visit = Visit(page=browser.new_page(), studio=studio, folder=folder)
    visit.listen(visit.page)
    if before:
        visit.page.add_init_script(before)
    visit.page.goto(studio.address, wait_until="load")
    visit.page.wait_for_selector("html[data-studio-ready=yes]", timeout=PATIENCE)
    return visit


@contextmanager
def visited(browser: Any, studio: ServedStudio, folder: Path) -> Iterator[Visit]:
    """A page of the file without edits; at its end nothing has left the machine, or complained."""
    with studio.window() as window:
        window.say(type="reset")
        window.say(type="show", pose=None, condition=None)
        while True:
            told = window.until("state")
            if told["edits"] == [] and told["pose"] is None and told["condition"] is None:
                break
    visit = opened(browser, studio, folder)
    visit.rest()
    yield visit
    visit.page.close()
    own = (f"http://{studio.host}/", "data:", f"blob:http://{studio.host}/")
    assert [url for url in visit.requests if not url.startswith(own)] == []
    assert visit.complaints == []
