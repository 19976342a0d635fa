"""Random work in the real LinuxCNC: seconds of it, and two minutes in what the CI leaves out.

An hour was run once, by the same script: `endurance`.
"""

from __future__ import annotations

from itertools import count
from pathlib import Path

import pytest
from endurance import MACHINES, endure, require
from endurance_plan import Plan, Subject
from real_linuxcnc import required

from sweeps import long_member, sweep


@pytest.mark.parametrize(
    ("machine", "seed", "seconds"),
    [
        ("planar_two_slider", 3, 5.0),
        pytest.param("hexapod", 4, 20.0, marks=sweep),
        long_member("hexapod", 4, 120.0),
    ],
)
def test_random_work(machine: str, seed: int, seconds: float, tmp_path: Path) -> None:
    required()
    outcome = endure(tmp_path, Subject(MACHINES / f"{machine}.toml"), seed, seconds)
    require(outcome)
    assert outcome.minutes >= seconds / 60.0
    assert outcome.done.total() > 0.2 * seconds


def test_a_seed_is_a_plan() -> None:
    subject = Subject(MACHINES / "planar_two_slider.toml")
    first, again, other = (Plan(subject, seed, 200) for seed in (5, 5, 6))
    assert first.steps == again.steps
    assert first.programs == again.programs
    assert first.steps != other.steps
    assert len(set(first.kinds)) == 15


def changed(ending: str, old: str, new: str) -> Subject:
    """A machine with something in one of its exported files changed."""
    subject = Subject(MACHINES / "planar_two_slider.toml")
    name = next(name for name in subject.files if name.endswith(ending))
    text = subject.files[name]
    assert text.count(old) == 1
    subject.files = {**subject.files, name: text.replace(old, new)}
    return subject


def seed_with(subject: Subject, kind: str) -> int:
    """The first seed with which that is among the first things done."""
    return next(seed for seed in count() if kind in Plan(subject, seed, 20).kinds[:3])


@sweep
@pytest.mark.parametrize(
    ("ending", "old", "new", "kind", "told"),
    [
        # All of a change of the compensation in one cycle: drives cannot follow.
        (
            ".c",
            "rate * MILLIMETRE * seconds",
            "1e9",
            "home_compensated",
            "a joint falls behind",
        ),
        # Homing with the compensation in.
        (
            ".hal",
            "=> motion.homing-inhibit",
            "# nowhere",
            "home_compensated",
            "refused 0",
        ),
        # A compensation that is a little off.
        (
            ".c",
            "added[i] = in->share * within(",
            "added[i] = 0.999999 * in->share * within(",
            "check",
            "a joint is off",
        ),
    ],
)
def test_it_notices(ending: str, old: str, new: str, kind: str, told: str, tmp_path: Path) -> None:
    required()
    subject = changed(ending, old, new)
    with pytest.raises(AssertionError, match=told):
        require(endure(tmp_path, subject, seed_with(subject, kind), 8.0))
