"""At rest the page's quick numbers are the studio's, wherever both answer: to 1e-12 m and rad."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

import truepose as tp
from browser import Heard
from command_line import MACHINES
from served_studio import Window, free_port, studio_of
from sweeps import thinned

PATIENCE = 120_000
CLOSE = 1e-12
"""m and rad, of errors of some millimetres at most."""
ROUNDS = 4

MACHINES_SHOWN = ["planar_two_slider", "hexapod", "linear_delta", "tricept", "hexapod_all_sources"]

AT_REST = """pose => {
  const status = document.querySelector("[data-studio=status]");
  const live = document.getElementById("live");
  const shown = document.querySelector('#live [data-of="pose.x"] input[type=number]');
  return status.dataset.state === "rest" && live.dataset.stale === "no"
    && live.dataset.settled === "yes" && Math.abs(Number(shown.value) - pose) < 0.1;
}"""
# The SI numbers of the quick part: of both cards, and of the table of sources.
QUICK = """() => Object.fromEntries([...document.querySelectorAll("#live [data-of][data-si]")].map(
  cell => [cell.dataset.of, Number(cell.dataset.si)]))"""
POSE = (
    """() => Number(document.querySelector('#live [data-of="pose.x"] input[type=number]').value)"""
)


def random_edits(window: Window, chance: random.Random) -> None:
    """Other values of some fields, close to what they are; refused ones are drawn anew."""
    states = [told for told in window.told if told["type"] == "state"]
    pieces = [told["fields"] for told in window.told if told["type"] == "fields"]
    fields = {row["key"]: row for piece in pieces for row in piece}.values()
    factor = 1.0 + chance.uniform(-1e-3, 1e-3)

    def near(text: str) -> str:
        return re.sub(r"\d+(\.\d+)?", lambda number: f"{float(number[0]) * factor:.9g}", text)

    changing = [
        [row["key"], near(row["text"])]
        for row in fields
        if not row["choices"] and not row["key"].startswith("workspace")
        if re.search("[1-9]", row["text"])
    ]
    window.say(type="edit", edits=chance.sample(changing, 3))
    while True:
        told = window.next()
        if told["type"] == "refused":
            random_edits(window, chance)
            return
        if told["type"] == "state" and told["number"] > states[-1]["number"]:
            piece = window.until("fields", number=told["number"])
            while piece["first"] + len(piece["fields"]) < piece["total"]:
                piece = window.until("fields", number=told["number"])
            return


def compared(quick: Mapping[str, float], known: Mapping[str, Any], machine: tp.Machine) -> int:
    """Hold each number that both have against the other; how many those are."""
    live = {name.partition(".")[0] for name in quick}
    pairs: dict[str, float | None] = {}
    columns = list(machine.components)
    every = len([one for one in known["sources"] if one["name"] in live]) == len(known["sources"])
    sources = [one for one in known["sources"] if one["name"] in live]
    if every:
        sources = [*sources, {**known, "name": "before"}]
    for source in sources:
        name = source["name"]
        pairs |= {
            f"{name}.{column}": error
            for column, error in zip(columns, source["error"], strict=True)
        }
        pairs |= {f"{name}.reach.{kind}": most for kind, most in source["linear_maximum"].items()}
        for kind, begins in (("position", "xyz"), ("orientation", "r")):
            own = [e for c, e in zip(columns, source["error"], strict=True) if c[0] in begins]
            if own:
                pairs[f"{name}.{kind}"] = math.hypot(*own)
                if name == "before":
                    pairs[f"before.known.{kind}"] = math.hypot(*own)
    for name, expected in pairs.items():
        assert quick[name] == pytest.approx(expected, rel=0.0, abs=CLOSE), name
    return len(pairs)


@pytest.mark.parametrize(
    "name", thinned(MACHINES_SHOWN, {"planar_two_slider", "hexapod", "linear_delta"})
)
def test_quick_numbers_are_those_of_the_studio(name: str, browser: Any, tmp_path: Path) -> None:
    machine, chance = tp.load(MACHINES / f"{name}.toml"), random.Random(name)  # noqa: S311
    file = tmp_path / "m" / "m.toml"
    file.parent.mkdir()
    file.write_bytes((MACHINES / f"{name}.toml").read_bytes())
    heard, page = Heard(), browser.new_page()
    heard.listen(page)
    count = 0
    with (
        studio_of(file, tmp_path / "state", "--port", str(free_port())) as studio,
        studio.window() as window,
    ):
        page.goto(studio.address)
        page.wait_for_selector("html[data-studio-ready=yes]", timeout=PATIENCE)
        window.until("answer", name="machine")
        bundle = window.told[-1]["value"]["bundle"]
        low, high = bundle["workspace"]["low"], bundle["workspace"]["high"]
        parts = [one["part"] for one in bundle["parts"]]
        for at in range(ROUNDS):
            random_edits(window, chance)
            pose = [chance.uniform(least, most) for least, most in zip(low, high, strict=True)]
            condition = {
                "temperature": {one: chance.uniform(285.0, 310.0) for one in parts},
                "wrench": [chance.gauss(0.0, 200.0) if axis in machine.components else 0.0
                           for axis in ("x", "y", "z", "rx", "ry", "rz")],
            }  # fmt: skip
            window.say(type="show", pose=pose, condition=condition if at % 2 else None)
            state = window.until("state", pose=pose)
            known = window.until("answer", name="known", number=state["number"])["value"]
            shown = pose[0] / bundle["units"]["length"]["si"]
            page.wait_for_function(AT_REST, arg=shown, timeout=PATIENCE)
            assert known["status"] == "ok"
            count += compared(page.evaluate(QUICK), known, machine)
    assert count >= ROUNDS * 2 * len(machine.components)
    assert heard.complaints == []
    page.close()
