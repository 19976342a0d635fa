"""Kills: commands that write are ended by SIGKILL at random moments, and what stands is looked at.

`PYTHONPATH=tests python -m kills --count 300 --seed 1` starts every command in turn, on a folder
in which an earlier run of it stands, and kills it: every second time at any moment of its run, and
else within the milliseconds in which its files take their places, which the command tells us. Then
every file is the old one or the new one, whole, and the files of one command are all old or all
new, unless the kill fell between two renames, some microseconds apart. Then those that a controller
loads together (LinuxCNC's module, INI and HAL file) say so by their hashes, and are not loaded.
What a killed process leaves besides are its temporary files, whose names begin with a point.
"""

from __future__ import annotations

import os
import random
import re
import select
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PLANAR = ROOT / "machines" / "planar_two_slider.toml"
HEXAPOD = ROOT / "machines" / "hexapod.toml"
DATA = ROOT / "examples" / "data"

CHANGED = ("--set", 'machine.name="another"')
"""What makes every output of the new run differ from that of the old one."""
NEW = ("init", "import")
"""Commands that write new files only."""
OTHERS = {
    **dict.fromkeys(NEW, ()),
    "part": ("--set", "condition.temperature=27", "--seed", "2"),
    "calibrate": ("--set", 'accuracy.target="0.37 mm"', "--date", "2026-01-02"),
}
"""The same where that is no change: a new file is new, measurements name their machine, and
what varies along the way of a part's witness follows from the seed."""

COMMANDS: dict[str, tuple[str, ...]] = {
    "init": ("init", "tripod", "-o", "new.toml"),
    "import": ("import", str(DATA / "printer.cfg"), "-o", "new.toml"),
    "check": ("check", str(PLANAR), "-o", "out.json"),
    "budget": ("budget", str(PLANAR), "-o", "out.json", "--witness", "witness.toml"),
    "compensate": ("compensate", str(PLANAR), "-o", "out.nc"),
    "montecarlo": ("montecarlo", str(PLANAR), "--samples", "2000", "-o", "out.json"),
    "bounds": ("bounds", str(PLANAR), "-o", "out.json"),
    "shares": ("shares", str(PLANAR), "-o", "out.json"),
    "report": ("report", str(PLANAR), "-o", "page.html", "--figure-data", "data"),
    "live": ("live", str(PLANAR), "-o", "page.html"),
    "calibrate": (
        "calibrate", str(DATA / "delta_printer.toml"), str(DATA / "delta_positions.csv"),
        "-o", "out.json", "--machine-output", "calibrated.toml", "--date", "2026-01-01",
        "--report", "page.html", "--force",
    ),
    "allocate": ("allocate", str(DATA / "hexapod_costs.toml"), "-o", "designed.toml"),
    "plan": (
        "plan", str(PLANAR), "--instrument", "position=10um", "--poses", "4", "-o", "out.json",
        "--program", "measure.ngc", "--template", "readings.csv",
    ),
    "gcode": ("gcode", str(PLANAR), "part.ngc", "-o", "corrected.ngc", "--force"),
    "part": (
        "part", str(PLANAR), "part.ngc", "--samples", "20", "-o", "out.json",
        "--set", "drive.d2.actuator={periodic={amplitude='3 um',period='4 mm'}}",
        "--points", "points.csv", "--witness", "witness.toml",
    ),
    "export linuxcnc": ("export", "linuxcnc", str(PLANAR), "-o", "export"),
    "export c": ("export", "c", str(HEXAPOD), "-o", "export"),
}  # fmt: skip
"""Commands that write; those with several files come up as often as the others. `live` needs the
kernel for browsers."""

PART = "part.ngc"
PROGRAM = """\
G21 G90 G94
G0 X250 Y150
(feature: wall, straightness 0.000001)
G1 X350 F1500
(end feature)
G3 X370 Y170 J20
"""

TELLING = """
import os
from truepose.files import writing
from truepose.cli import main

take_places = writing.FileSet.take_places

def telling(self):
    os.write(int(os.environ["TELLS"]), b"!")
    take_places(self)

writing.FileSet.take_places = telling
main()
"""
"""The command line, which tells a pipe when its files are about to take their places."""

PATH = os.pathsep.join(str(Path(folder).resolve()) for folder in sys.path if folder)
"""The same truepose as here, whatever the folder."""

HASH = re.compile(r'^(?:KINEMATICS = .* ini=|loadrt .* hal=|#define HASH ")(\w{8})', re.M)
"""Where the files of an export of LinuxCNC say what they are of."""

MOMENTS = 20e-3
"""s after that within which a command is killed."""


@dataclass(frozen=True)
class Killed:
    """What stands after one kill: each file "old", "new", "none" or "half"; whether it was late.

    `mixed`: files of the set are of different runs. `ended`: it was done before the kill.
    `hashes`: of the export that each file says it is of, if it does.
    """

    command: str
    aimed: bool
    ended: bool
    files: dict[str, str]
    hashes: frozenset[str] = frozenset()

    @property
    def told(self) -> bool:
        """Whether a mixed set says that it is one, so that it is not loaded."""
        return len(self.hashes) > 1

    @property
    def mixed(self) -> bool:
        return len(set(self.files.values())) > 1

    @property
    def half(self) -> bool:
        return "half" in self.files.values()


class Kills:
    """Kills one command again and again, in folders below `place`."""

    def __init__(self, name: str, place: Path) -> None:
        self.name = name
        self.place = place
        self._old, self._new = place / "old", place / "new"
        start = time.monotonic()
        self._written(self._old, ())
        self._seconds = time.monotonic() - start
        self._written(self._new, self._changes())
        self.names = [name for name in _files(self._new) if self._differs(name)]
        if not self.names:
            raise AssertionError(f"{self.name}: nothing tells the runs apart")

    def one(self, chance: random.Random, *, aimed: bool) -> Killed:
        """Kill it once, at a moment drawn from `chance`."""
        folder = self.place / "folder"
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(self._old, folder)
        if self.name in NEW:  # it writes over nothing
            (folder / "new.toml").unlink()
        ears, mouth = os.pipe()
        process = self._started(folder, self._changes(), mouth)
        os.close(mouth)
        if aimed:
            select.select([ears], [], [], 120.0)
            time.sleep(MOMENTS * chance.random() ** 3)
        else:
            time.sleep(1.05 * self._seconds * chance.random())
        ended = process.poll() is not None
        process.send_signal(signal.SIGKILL)
        process.wait()
        os.close(ears)
        files = {name: self._state(name) for name in self.names}
        return Killed(self.name, aimed, ended, files, self.hashes(folder))

    def hashes(self, folder: Path) -> frozenset[str]:
        """Of which exports the files of a folder say they are."""
        there = [folder / name for name in self.names if (folder / name).exists()]
        texts = [path.read_text(errors="replace") for path in there]
        return frozenset(found for text in texts for found in HASH.findall(text))

    def _state(self, name: str) -> str:
        """Which run a file is of, byte by byte."""
        file = self.place / "folder" / name
        if not file.exists():
            return "old" if self.name in NEW else "none"
        content = file.read_bytes()
        runs = ("new",) if self.name in NEW else ("old", "new")
        return next((run for run in runs if content == self._content(run, name)), "half")

    def _differs(self, name: str) -> bool:
        if self.name in NEW:
            return name != PART
        return self._content("old", name) != self._content("new", name)

    def _content(self, run: str, name: str) -> bytes:
        return (self.place / run / name).read_bytes()

    def _changes(self) -> tuple[str, ...]:
        return OTHERS.get(self.name, CHANGED)

    def _written(self, folder: Path, changes: Sequence[str]) -> None:
        """A whole run."""
        folder.mkdir(parents=True)
        (folder / PART).write_text(PROGRAM)
        null = os.open(os.devnull, os.O_WRONLY)
        process = self._started(folder, changes, null)
        os.close(null)
        code = process.wait()
        if code not in (0, 1):
            raise AssertionError(f"{self.name} ends with {code}")

    def _started(self, folder: Path, more: Sequence[str], tells: int) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-c", TELLING, *COMMANDS[self.name], *more],
            cwd=folder,
            pass_fds=(tells,),
            env=os.environ | {"TELLS": str(tells), "PYTHONPATH": PATH},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )


def _files(folder: Path) -> list[str]:
    """Names of all files that are no temporary ones."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return sorted(str(p.relative_to(folder)) for p in files if not p.name.startswith("."))
