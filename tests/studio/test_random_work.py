"""A studio at random work, in a page and by the socket: two minutes of it in `make test-all`.

What memory does is asked of an hour alone, which `make soak` is.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import studio_soak.window_work
import truepose as tp
from command_line import MACHINES
from studio_soak import LARGEST_GROWTH, Outcome, broken, grown, soak
from studio_soak.memory import Reading
from studio_soak.numbers import OfCommands, differences
from sweeps import sweep
from system_package import require_web_kernel
from truepose.studio.answers import Question, known, verdict

PLANAR = MACHINES / "planar_two_slider.toml"
# A thread of the server that fails, as one of its own would.
FAILS = """
import threading
threading.Timer(2.0, lambda: [][0]).start()
"""
COMPLAINS = "setTimeout(() => { throw new Error('of the page'); }, 2000);"


@pytest.fixture
def needed() -> None:
    require_web_kernel()


@sweep
@pytest.mark.timeout(1200)
def test_two_minutes_of_random_work(needed: None, tmp_path: Path) -> None:
    outcome = soak(tmp_path, 120.0, 3)
    assert broken(outcome) == [], outcome
    # It has worked: in both ways, in the file, and with messages to hold against their size.
    assert {name.partition(".")[0] for name in outcome.done} == {"window", "page", "disk"}
    assert sum(outcome.done.values()) > 40
    assert min(outcome.messages, outcome.page_messages) > 100


@sweep
@pytest.mark.timeout(1200)
def test_it_notices_what_is_broken(
    needed: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(studio_soak.window_work, "MOST_SENT", 5000)
    (tmp_path / "sitecustomize.py").write_text(FAILS)
    environment = {"PYTHONPATH": str(tmp_path)}
    outcome = soak(
        tmp_path, 8.0, 4, machine=PLANAR, spoiled=COMPLAINS, environment=environment
    )  # fmt: skip
    found = "\n".join(broken(outcome))
    assert "the server says: Exception in thread" in found
    assert "IndexError" in found
    assert "the page complains: of the page" in found
    assert "messages: one of " in found
    assert outcome.largest > 5000
    assert outcome.page_largest > 5000
    assert outcome.wrong == []


# --- numbers at the end


@pytest.fixture(scope="module")
def commands() -> OfCommands:
    return OfCommands.of(PLANAR)


@pytest.fixture(scope="module")
def answered() -> str:
    question = Question(tp.load(PLANAR))
    *_, compensated = verdict(question)
    return json.dumps({"known": known(question), "verdict": compensated})


def in_page(given: dict[str, Any]) -> dict[str, float]:
    """Numbers of a page that shows these answers."""
    told = given["known"]
    shown = {
        "studio.largest.linear.position": told["highest"]["position"]["value"],
        "studio.largest.known.position": told["largest"]["position"]["value"],
    }
    shown["before.known.position"] = shown["studio.known.position"] = (
        sum(error**2 for error in told["error"][:2]) ** 0.5
    )
    return shown


def test_numbers_of_the_commands_are_right(commands: OfCommands, answered: str) -> None:
    given = json.loads(answered)
    assert differences(commands, given, in_page(given).get) == []


@pytest.mark.parametrize(
    "place",
    [
        ("known", "error", 1),
        ("known", "highest", "position", "value"),
        ("known", "largest", "position", "value"),
        ("verdict", 0, "witness", "value"),
        ("verdict", -1, "bound", "value"),
    ],
)
def test_a_number_that_is_not_the_commands_is_told(
    place: tuple[Any, ...], commands: OfCommands, answered: str
) -> None:
    given = json.loads(answered)
    shown, at = in_page(given), given
    for key in place[:-1]:
        at = at[key]
    at[place[-1]] *= 1.0 + 1e-9
    assert differences(commands, given, shown.get) != []


@pytest.mark.parametrize("place", ["studio.largest.linear", "studio.largest.known", "before.known"])
def test_a_number_that_is_not_the_pages_is_told(
    place: str, commands: OfCommands, answered: str
) -> None:
    given = json.loads(answered)
    shown = in_page(given)
    shown[f"{place}.position"] += 2e-12
    assert len(differences(commands, given, shown.get)) == 1
    del shown[f"{place}.position"]
    assert len(differences(commands, given, shown.get)) == 1


# --- memory


def outcome_of(sizes: list[float], name: str) -> Outcome:
    """A soak in which something had so many MB from minute to minute."""
    reading = Reading(0.0, 100.0, 250.0, 4.0, 110.0, 3800, 600)
    readings = [
        replace(reading, minute=float(minute), **{name: size})
        for minute, size in enumerate(sizes, 1)
    ]
    return Outcome(float(len(sizes)), readings, {}, 0, 0, 0, 0, [], [], "", [])


@pytest.mark.parametrize("name", ["server", "family", "heap", "process"])
def test_what_grows_is_told_but_not_what_warms_up(name: str) -> None:
    hour = [100.0 + 0.5 * minute for minute in range(60)]
    assert list(grown(outcome_of(hour, name))) == [name]
    warm = [100.0 + 5.0 * min(minute, 9) for minute in range(60)]
    assert grown(outcome_of(warm, name)) == {}
    slow = [100.0 + 0.1 * minute for minute in range(60)]
    assert grown(outcome_of(slow, name)) == {}
    assert 0.1 * 50 < LARGEST_GROWTH < 0.5 * 50
