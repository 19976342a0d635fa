"""Commands are killed at random moments: every file whole, and files of one command of one run.

`python -m kills` (tests/kills) does the same hundreds of times, over all commands that write.
"""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from kills import COMMANDS, Kills
from sweeps import long_member, thinned
from system_package import missing
from truepose.cli import COMMANDS as ALL
from truepose.reporting.live import part

KILLED = ["plan", "export linuxcnc", "calibrate"]
"""Commands with several files, which may be mixed; twice each: at any moment, and while the files
take their places."""
FURTHER = ["budget", "gcode", "live"]
"""Likewise, outside of the CI."""


@pytest.fixture(scope="module")
def kills_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Kills]:
    """Those of a command, whose two undisturbed runs are made once."""
    return cache(lambda name: Kills(name, tmp_path_factory.mktemp("kills") / "place"))


@pytest.mark.parametrize("name", [*thinned(KILLED), *map(long_member, FURTHER)])
def test_killed_at_any_moment(name: str, kills_of: Callable[[str], Kills]) -> None:
    if name == "live" and not part.is_built():
        missing("the kernel for browsers is not built: make web")
    kills = kills_of(name)
    chance = random.Random(name)  # noqa: S311
    for aimed in (False, True):
        killed = kills.one(chance, aimed=aimed)
        assert not killed.half, killed
        assert killed.told or not killed.mixed, killed


def test_a_mixed_export_says_that_it_is_one(
    kills_of: Callable[[str], Kills], tmp_path: Path
) -> None:
    kills = kills_of("export linuxcnc")
    folder = tmp_path / "mixed"
    shutil.copytree(kills.place / "old", folder)
    assert len(kills.hashes(folder)) == 1
    name = next(name for name in kills.names if name.endswith(".ini"))
    shutil.copy(kills.place / "new" / name, folder / name)
    assert len(kills.hashes(folder)) == 2


def test_every_command_that_writes_is_killed() -> None:
    writes_the_same_way = {"compare", "over-time", "strain"}  # their one file by `deliver`
    writes_the_same_way |= {"schema"}  # its one file as `init` does, and never another content
    writes_the_same_way |= {"studio"}  # what is saved as `init` does; tests/studio kills it
    writes_the_same_way |= {"study"}  # its store, which tests/unit/studies kills
    writes_nothing = {"explain", "completion"}
    written = set(ALL) - writes_the_same_way - writes_nothing
    assert {name.split()[0] for name in COMMANDS} == written
