"""What is wrong with a machine, said twice: in its file, and as laws by which machines are drawn.

An error writes its keys into the tables of a machine file, and draws deviations of s machines at
the p points of a path, of which a simulator knows the coordinates. Of a crank a micrometre is ten
microradians.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from build_machine import PER_METRE
from machine_file import File
from part_simulator import on_the_way
from part_simulator.closed_struts import ClosedStruts

Floats = NDArray[np.float64]
Random = np.random.Generator

MICRO = 1e-6
PER_MICROMETRE = 1e-5
"""rad."""


@dataclass(frozen=True, eq=False)
class Driven:
    """A path that a machine goes along: joints (p, n_drive), points (p, 3), rotations."""

    machine: ClosedStruts
    joints: Floats
    points: Floats
    rotations: Floats

    def coordinate(self, drive: Mapping[str, Any]) -> Floats:
        """(p,) of one drive."""
        return self.joints[:, self.machine.joint(drive["name"])]


class Sums:
    """Deviations by name, to which errors add."""

    def __init__(self) -> None:
        self.values: dict[str, Floats] = {}

    def add(self, name: str, value: Floats) -> None:
        self.values[name] = self.values[name] + value if name in self.values else value


class Error(Protocol):
    """One thing that is wrong."""

    def write(self, file: File, folder: Path) -> None:
        """Into the tables of a machine file."""
        ...

    def draw(self, random: Random, count: int, path: Driven, to: Sums) -> None:
        """Of `count` machines, (s or 1, p or 1)."""
        ...


def small(drive: Mapping[str, Any], micrometres: float) -> tuple[str, float]:
    """As a file says it, and SI."""
    if drive["kind"] == "crank":
        angle = micrometres * PER_MICROMETRE
        return f"{np.degrees(angle):.15g} deg", angle
    return f"{micrometres:.15g} um", micrometres * MICRO


def far(drive: Mapping[str, Any], millimetres: float) -> tuple[str, float]:
    """A length of a drive's travel, as a file says it, and SI."""
    return small(drive, 1e3 * millimetres)


@dataclass(frozen=True)
class Tolerances:
    """Half bands of parameters by pattern, um or urad, uniform; within [-1, 1] of them."""

    bands: Mapping[str, float]

    def write(self, file: File, folder: Path) -> None:
        """Into `[tolerance]`."""
        table = file.setdefault("tolerance", {})
        for pattern, band in self.bands.items():
            turns = ".axis." in pattern or self._of_cranks(file, pattern)
            table[pattern] = f"{np.degrees(band * MICRO):.15g} deg" if turns else f"{band:.15g} um"

    @staticmethod
    def _of_cranks(file: File, pattern: str) -> bool:
        return pattern.endswith(".offset") and file["drive"][0]["kind"] == "crank"

    def draw(self, random: Random, count: int, path: Driven, to: Sums) -> None:
        """A value for each parameter and machine."""
        for pattern, band in self.bands.items():
            for name in names_of(path.machine):
                if fnmatchcase(name, pattern):
                    to.add(name, band * MICRO * random.uniform(-1.0, 1.0, (count, 1)))


def names_of(machine: ClosedStruts) -> list[str]:
    """Parameters that may have a tolerance."""
    names = []
    for strut in machine.struts:
        places = [f"{end}.{axis}" for end in ("base", "platform") for axis in "xyz"]
        places += ["length"] * (strut["length"] is not None)
        names += [f"strut.{strut['name']}.{place}" for place in places]
    for drive in machine.drives:
        places = ["offset"]
        if drive["kind"] != "telescopic":
            places += [*(f"origin.{axis}" for axis in "xyz"), "axis.u", "axis.v"]
        names += [f"drive.{drive['name']}.{place}" for place in places]
    return names


@dataclass(frozen=True)
class OfDrives:
    """An error of every drive, which adds to its offset."""

    def write(self, file: File, folder: Path) -> None:
        """Into each drive's row."""
        for drive in file["drive"]:
            self.write_drive(drive, folder)

    def write_drive(self, drive: dict[str, Any], folder: Path) -> None:
        raise NotImplementedError

    def draw(self, random: Random, count: int, path: Driven, to: Sums) -> None:
        """Of each drive by itself."""
        for drive in path.machine.drives:
            value = self.draw_drive(random, count, drive, path.coordinate(drive))
            to.add(f"drive.{drive['name']}.offset", value)

    def draw_drive(self, random: Random, count: int, drive: Mapping[str, Any], q: Floats) -> Floats:
        raise NotImplementedError


@dataclass(frozen=True)
class Scale(OfDrives):
    """Within limits, ppm."""

    least: float
    most: float

    def write_drive(self, drive: dict[str, Any], folder: Path) -> None:
        limits = [f"{self.least:.15g} ppm", f"{self.most:.15g} ppm"]
        drive.setdefault("sensor", {})["scale_error"] = limits

    def draw_drive(self, random: Random, count: int, drive: Mapping[str, Any], q: Floats) -> Floats:
        ratio = MICRO * random.uniform(self.least, self.most, (count, 1))
        return on_the_way.scale_error(q, ratio)

    def known(self, drive: Mapping[str, Any], q: Floats) -> Floats:
        """(p,) the middle of the limits."""
        return on_the_way.scale_error(q, 0.5 * MICRO * (self.least + self.most))


@dataclass(frozen=True)
class Ripple(OfDrives):
    """Amplitude, um, and period, mm, of unknown phase."""

    amplitude: float
    period: float

    def write_drive(self, drive: dict[str, Any], folder: Path) -> None:
        drive.setdefault("actuator", {})["periodic"] = {
            "amplitude": small(drive, self.amplitude)[0],
            "period": far(drive, self.period)[0],
        }

    def at(self, drive: Mapping[str, Any], q: Floats, turns: Floats) -> Floats:
        """(s, p) at phases (s, 1)."""
        amplitude, period = small(drive, self.amplitude)[1], far(drive, self.period)[1]
        return on_the_way.ripple(q, amplitude, period, turns)

    def draw_drive(self, random: Random, count: int, drive: Mapping[str, Any], q: Floats) -> Floats:
        return self.at(drive, q, random.uniform(size=(count, 1)))


@dataclass(frozen=True)
class Resolution(OfDrives):
    """A step, um, of a grid of unknown origin."""

    step: float

    def write_drive(self, drive: dict[str, Any], folder: Path) -> None:
        drive.setdefault("sensor", {})["resolution"] = small(drive, self.step)[0]

    def at(self, drive: Mapping[str, Any], q: Floats, origin: Floats) -> Floats:
        """(s, p) at origins (s, 1)."""
        return on_the_way.rounding(q, small(drive, self.step)[1], origin)

    def draw_drive(self, random: Random, count: int, drive: Mapping[str, Any], q: Floats) -> Floats:
        return self.at(drive, q, random.uniform(size=(count, 1)))


@dataclass(frozen=True)
class Play(OfDrives):
    """Between flanks, um; friction holds it open against every load."""

    width: float

    def write_drive(self, drive: dict[str, Any], folder: Path) -> None:
        threshold = "1000 N m" if drive["kind"] == "crank" else "100 kN"
        drive["backlash"] = {"play": small(drive, self.width)[0], "threshold": threshold}

    def draw_drive(self, random: Random, count: int, drive: Mapping[str, Any], q: Floats) -> Floats:
        width = small(drive, self.width)[1]
        return on_the_way.play(q, width, random.uniform(-1.0, 1.0, (count, 1)))

    def known(self, drive: Mapping[str, Any], q: Floats) -> Floats:
        """(p,) the flank, 0 where the drive has no way yet."""
        return on_the_way.play(q, small(drive, self.width)[1], np.zeros(1))


@dataclass(frozen=True)
class Repeatability(OfDrives):
    """A standard deviation, um, of each visit."""

    sigma: float

    def write(self, file: File, folder: Path) -> None:
        """A tolerance that varies with each visit."""
        table = file.setdefault("tolerance", {})
        for drive in file["drive"]:
            table[f"drive.{drive['name']}.offset"] = {
                "standard_deviation": small(drive, self.sigma)[0],
                "varies": "visit",
            }

    def draw_drive(self, random: Random, count: int, drive: Mapping[str, Any], q: Floats) -> Floats:
        return small(drive, self.sigma)[1] * random.normal(size=(count, len(q)))


@dataclass(frozen=True)
class Table(OfDrives):
    """A measured table: `count` targets, either direction, five runs; drawn by a seed."""

    seed: int
    count: int = 9
    reversal: float = 4.0
    sigma: float = 1.0
    _runs: int = field(default=5, repr=False)

    def rows(self, drive: Mapping[str, Any], travel: Floats) -> tuple[Floats, Floats]:
        """Targets (t,), and deviations (t, 2, runs), SI."""
        random = np.random.default_rng([self.seed, *drive["name"].encode()])
        targets = np.linspace(*travel, self.count)
        unit = small(drive, 1.0)[1]
        mean = 5.0 * random.normal(size=(self.count, 1, 1))
        side = 0.5 * self.reversal * np.array([1.0, -1.0])[:, np.newaxis]
        runs = self.sigma * random.normal(size=(self.count, 2, self._runs))
        return targets, unit * (mean + side + runs)

    def write(self, file: File, folder: Path) -> None:
        """A data file for each drive."""
        for drive in file["drive"]:
            if drive["kind"] == "crank":
                coordinate, unit, per_unit = "deg", "deg", np.radians(1.0)
                ends = np.radians([float(end) for end in drive["travel"]])
            else:
                coordinate, unit, per_unit = "m", "um", MICRO
                metre = PER_METRE[file["units"]["length"]]
                ends = np.array([float(end) * metre for end in drive["travel"]])
            targets, rows = self.rows(drive, ends)
            if drive["kind"] == "crank":
                targets = np.degrees(targets)
            lines = [f"target ({coordinate}), direction, deviation ({unit})"]
            for target, both in zip(targets.tolist(), rows, strict=True):
                for sign, runs in zip("+-", both, strict=True):
                    lines += [f"{target!r}, {sign}, {one!r}" for one in (runs / per_unit).tolist()]
            name = f"{drive['name']}.csv"
            (folder / name).write_text("\n".join([*lines, ""]), encoding="utf-8")
            drive["actuator"] = {"table": name}

    def draw_drive(self, random: Random, count: int, drive: Mapping[str, Any], q: Floats) -> Floats:
        which = random.choice([-1.0, 1.0], size=(count, 1))
        return self._at(drive, q, which, random.normal(size=(count, len(q))))

    def known(self, drive: Mapping[str, Any], q: Floats) -> Floats:
        """(p,) the mean of the runs in the direction, of both where it has no way yet."""
        return self._at(drive, q, np.zeros(1), np.zeros(1))

    def _at(self, drive: Mapping[str, Any], q: Floats, which: Floats, draws: Floats) -> Floats:
        targets, rows = self.rows(drive, np.array(drive["travel"]))
        mean, spread = rows.mean(axis=2), rows.std(axis=2, ddof=1)
        ahead, back = ((mean[:, side], spread[:, side]) for side in (0, 1))
        return on_the_way.table(q, targets, ahead, back, which, draws)


@dataclass(frozen=True)
class Force:
    """Of unknown direction, N, on struts of a stiffness, N/um; one direction a run."""

    force: float
    stiffness: float

    def write(self, file: File, folder: Path) -> None:
        """An envelope, and stiff struts."""
        for strut in file["strut"]:
            strut["stiffness"] = f"{self.stiffness:.15g} N/um"
        file["condition"] = {"envelope": {"force": f"{self.force:.15g} N"}}

    def draw(self, random: Random, count: int, path: Driven, to: Sums) -> None:
        """Each strut gives way by its tension."""
        machine = path.machine
        along = [
            machine.tensions(path.joints, path.points, path.rotations, self.force * axis)
            for axis in np.eye(3)
        ]
        ways = on_the_way.directions(random, count)
        longer = np.einsum("sa,apk->spk", ways, np.array(along)) * MICRO / self.stiffness
        for number, strut in enumerate(machine.struts):
            name = f"strut.{strut['name']}.length"
            if strut["length"] is None:
                name = f"drive.{strut['drive']}.offset"
            to.add(name, longer[:, :, number])


def written(errors: Sequence[Error], file: File, folder: Path) -> File:
    """The file with all of them."""
    for error in errors:
        error.write(file, folder)
    return file


def drawn(errors: Sequence[Error], random: Random, count: int, path: Driven) -> dict[str, Floats]:
    """Deviations (s or 1, p or 1) of `count` machines with all of them."""
    sums = Sums()
    for error in errors:
        error.draw(random, count, path, sums)
    return sums.values
