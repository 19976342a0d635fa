"""The examples of docs/how_to/studio.md, clicked through: its numbers are those in the browser."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from command_line import MACHINES
from served_studio import studio_of
from studio_visit import PATIENCE, Visit, opened

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "how_to" / "studio.md"
DATA = ROOT / "examples" / "data"

ANSWERED = """([key, text]) => {
  const row = document.querySelector(`[data-key="${key}"]`);
  const cards = document.querySelector("[data-studio=cards]");
  return document.querySelector("[data-studio=status]").dataset.state === "rest"
    && cards.dataset.stale === "no" && row.querySelector("input").value === text
    && !row.classList.contains("sending");
}"""
ROW = re.compile(
    r"^\| `(?P<key>[^`]+)` \| `(?P<value>[^`]+)` \| (?P<word>[^|]+) \| (?P<size>[^|]+) \|$"
)


def section(number: int) -> str:
    """The text of an example, from 1 on, in one line a paragraph."""
    return PAGE.read_text(encoding="utf-8").split("\n## ")[number]


def rows(text: str) -> list[dict[str, str]]:
    """What is typed in an example, and what the page then says."""
    matches = map(ROW.match, text.splitlines())
    return [match.groupdict() for match in matches if match is not None]


@contextmanager
def studio(browser: Any, machine: Path, folder: Path) -> Iterator[Visit]:
    file = folder / "machine" / machine.name
    file.parent.mkdir()
    file.write_bytes(machine.read_bytes())
    with studio_of(file, folder / "state") as served:
        visit = opened(browser, served, file.parent)
        visit.page.wait_for_selector("[data-studio=status][data-state=rest]", timeout=PATIENCE)
        yield visit
        assert visit.complaints == []
        visit.page.close()


def typed(visit: Visit, key: str, value: str) -> None:
    """A value of the file, and its answers; what the page works out by itself goes on."""
    visit.find(key)
    visit.input(key).fill(value)
    visit.input(key).press("Enter")
    visit.page.wait_for_function(ANSWERED, arg=[key, value], timeout=PATIENCE)


def shown(visit: Visit, name: str) -> str:
    return str(visit.page.locator(f'[data-of="workspace.before.{name}"]').inner_text())


def answer(visit: Visit) -> tuple[str, str]:
    return shown(visit, "verdict"), shown(visit, "found.position")


def test_which_tolerance_matters(browser: Any, tmp_path: Path) -> None:
    text = section(1)
    with studio(browser, MACHINES / "hexapod.toml", tmp_path) as visit:
        page = visit.page
        word, size = answer(visit)
        assert f"**{word}**" in text
        assert f"{size} off" in text
        asked = page.locator("[data-studio=cards] .before tr").last.locator("td").first
        assert f"{asked.inner_text()} are asked" in text.replace("\n", " ")
        page.locator('[data-of="workspace.before.example.position"] button').click()
        page.wait_for_function("() => document.getElementById('live').dataset.drawn === 'other'")
        first = page.locator("[data-live=witness] li").first.inner_text()
        assert first.startswith("drive.")
        assert ".offset at its " in first
        turned = rows(text)
        for number, row in enumerate(turned):
            if number:
                page.locator("[data-studio=reset]").click()
            typed(visit, row["key"], row["value"])
            assert answer(visit) == (row["word"], row["size"])
        assert [row["word"] for row in turned] == ["NOT met", "NOT met", "met", "met"]
        page.locator("[data-studio=reset]").click()
        page.locator("#tab-shares").click()
        typed(visit, turned[0]["key"], "[-0.0005, 0.0005]")
        page.locator("[data-tab=shares] select").select_option(label="x")
        table = page.locator("[data-tab=shares] table").last
        cells = table.locator("tbody tr").first.locator("th, td").all_inner_texts()
        share = cells[1].replace("\u00a0", " ")
        assert f"`{cells[0]}` has {share} of the variance of x" in text


def test_what_temperature_and_what_invar(browser: Any, tmp_path: Path) -> None:
    text = section(2)
    with studio(browser, MACHINES / "planar_two_slider.toml", tmp_path) as visit:
        told = rows(text)
        for row in told:
            typed(visit, row["key"], row["value"])
            assert answer(visit) == (row["word"], row["size"])
        warmest = [row["value"] for row in told if row["key"] == "condition.temperature"]
        assert f"So {warmest[0]} °C with steel, and {warmest[2]} °C with struts of invar" in text
        page = visit.page
        page.locator("[data-studio=difference]").click()
        page.wait_for_selector("[data-studio=difference-text] .came")
        came = page.locator("[data-studio=difference-text] .came").all_inner_texts()
        lines = [line for line in came if not line.startswith("+++")]
        assert len(lines) == len({row["key"] for row in told})


def test_what_measurements_say(browser: Any, tmp_path: Path) -> None:
    text = " ".join(section(3).replace("\n> ", " ").split())
    with studio(browser, DATA / "delta_printer.toml", tmp_path) as visit:
        page = visit.page
        page.locator("#tab-calibration").click()
        page.set_input_files("#dropped-file", DATA / "delta_positions.csv")
        said = page.locator("[data-of='calibration.answer']")
        said.wait_for(timeout=PATIENCE)
        assert said.inner_text().partition(";")[0] in text
        fit = page.locator("[data-tab=calibration] .caption", has_text="Birge").inner_text()
        before, after = re.findall(r"[\d.]+", fit)[:2]
        assert f"from {before} times their uncertainty to {after}." in text
        page.locator("[data-tab=calibration] form input").fill("3")
        page.locator("[data-tab=calibration] form button").click()
        planned = page.locator("[data-tab=calibration] .scroll .go")
        planned.first.wait_for(timeout=PATIENCE)
        assert planned.count() == 3
        pose = planned.first.inner_text()
        planned.first.click()
        caption = page.locator("[data-studio=largest] .caption")
        caption.filter(has_text=pose).wait_for(timeout=PATIENCE)
