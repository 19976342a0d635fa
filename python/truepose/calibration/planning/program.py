"""A plan on its way to the machine: a program that stops at every pose, and a table to fill in.

The program moves in straight lines of the commanded freedoms, as controllers do. Every line is
checked beforehand; where it leaves what the machine can reach, the way leads through home. Axis
words are machine coordinates in mm or inches and degrees (ISO 6983-1).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.calibration.instruments import Instrument
from truepose.calibration.measurements.columns import UNCERTAINTY
from truepose.calibration.measurements.read_csv import INSTRUMENT, SET
from truepose.calibration.measurements.write_csv import measurements_text
from truepose.calibration.planning.poses import Placed, home_of
from truepose.calibration.planning.readings import planned
from truepose.errors import Problem, RequestError
from truepose.files.units import FileUnit
from truepose.machine import Machine
from truepose.runs.poses import OK, pose_in_words
from truepose.version import version

FEED = 1.0 / 60.0
"""m/s: 1000 mm a minute."""

DWELL = 2.0
"""s, for the machine to come to rest and the instrument to read."""

LOOKED_AT = 33
"""Poses of a leg that are tried, ends included."""

INCH, MILLIMETRE, DEGREE = 0.0254, 1e-3, math.pi / 180.0
DIGITS = {"mm": 6, "inch": 7, "deg": 6}
"""Decimals that are written: a nanometre, or less."""

MOST_PROBLEMS = 10


@dataclass(frozen=True, eq=False)
class Way:
    """Where a measuring program goes.

    `stops` (n, n_commanded), SI, home first and last; `pose` (n,): which pose of the plan, from 0,
    each is, or -1 where the way only passes through home.
    """

    stops: Floats
    pose: Indices

    @property
    def by_home(self) -> int:
        """How many legs between two poses lead by home."""
        return int((self.pose[1:-1] < 0).sum())


def way_through(machine: Machine, poses: Floats) -> Way:
    """The way from home through `poses` (n, n_commanded) in their order, and back.

    Raises `RequestError` (plan-way) with every pose that cannot be gone to straight from where the
    way comes, nor from home.
    """
    home = home_of(machine)
    stops: Floats = np.concatenate([home[np.newaxis], poses, home[np.newaxis]])
    straight = reachable(machine, stops[:-1], stops[1:])
    from_home = reachable(machine, np.broadcast_to(home, poses.shape), poses)
    places, numbers = [home], [-1]
    problems = []
    for leg in range(len(poses) + 1):
        ends = [number for number in (leg - 1, leg) if 0 <= number < len(poses)]
        if not straight[leg]:
            blocked = [number for number in ends if not from_home[number]]
            # From home and to home there is no other way.
            if blocked or len(ends) < 2:
                problems += [_no_way(machine, poses, leg, number) for number in blocked or ends]
            places.append(home)
            numbers.append(-1)
        if leg < len(poses):
            places.append(poses[leg])
            numbers.append(leg)
    if problems:
        raise RequestError(*dict.fromkeys(problems[:MOST_PROBLEMS]))
    return Way(np.array([*places, home]), np.array([*numbers, -1], np.intp))


def reachable(machine: Machine, starts: Floats, ends: Floats) -> Flags:
    """(n,) whether the machine can be commanded straight from `starts` to `ends` (n, n_commanded).

    Within travel and joint limits, off singularities, at `LOOKED_AT` poses of each leg.
    """
    shares = np.linspace(0.0, 1.0, LOOKED_AT)[:, np.newaxis]
    points = starts[:, np.newaxis] + shares * (ends - starts)[:, np.newaxis]
    flat = np.ascontiguousarray(points.reshape(-1, points.shape[-1]))
    _, _, placed = machine.kernel.place(flat)
    _, regular = machine.kernel.conditioning(flat, status=True)
    fit = (placed == OK) & (regular == OK)
    return np.asarray(fit.reshape(len(points), LOOKED_AT).all(axis=1), np.bool_)


def _no_way(machine: Machine, poses: Floats, leg: int, number: int) -> Problem:
    came = f"pose {leg}" if 0 < leg < len(poses) else "home"
    return Problem(
        "plan-way",
        f"no straight way leads to pose {number + 1} of the plan: "
        f"{pose_in_words(machine, poses[number])}",
        machine.file,
        found=f"legs from {came} and from home that leave what the machine can reach",
        expected="a leg within travel and joint limits, off singularities",
        hint="give candidates without it, or a home in the middle of the workspace",
    )


def program(
    machine: Machine,
    poses: Floats,
    *,
    instruments: Sequence[Instrument] = (),
    dwell: float = DWELL,
    feed: float = FEED,
) -> str:
    """A program that moves through `poses` (n, n_commanded), SI, and dwells at each; G-code.

    `dwell` in s, `feed` in m/s, both above zero. From home and back; poses that have no straight
    way between them are joined by home. Raises `RequestError` (plan-way, plan-option).
    """
    for name, value in (("dwell", dwell), ("feed", feed)):
        if not (math.isfinite(value) and value > 0.0):
            raise RequestError(
                Problem(
                    "plan-option",
                    f"the {name} of a measuring program cannot be this",
                    found=f"{value:g}",
                    expected="a finite number above zero",
                )
            )
    return "\n".join(_lines(machine, way_through(machine, poses), instruments, dwell, feed)) + "\n"


def _lines(
    machine: Machine, way: Way, instruments: Sequence[Instrument], dwell: float, feed: float
) -> Iterator[str]:
    unit = _program_unit(machine)
    scale = {"mm": MILLIMETRE, "inch": INCH}[unit]
    total = int(way.pose.max()) + 1
    names = ", ".join(instrument.name for instrument in instruments)
    yield f"; {_ascii(machine.name)}: {total} poses to measure" + (
        f" with {_ascii(names)}" if names else ""
    )
    yield f"; planned by truepose {version()} for {_ascii(machine.file)}"
    yield "; in machine coordinates: without work offsets and tool length"
    yield f"; G4 P is in seconds; the machine rests {dwell:g} s at every pose"
    lowest = ""
    if "z" in machine.commanded:
        z = min(stop[machine.commanded.index("z")] for stop in way.stops)
        lowest = f", down to Z{_number(z / scale, DIGITS[unit])}"
    yield f"; it moves and rests, and probes nothing: see that nothing is in its way{lowest}"
    yield "; begins and ends at home" + (
        f"; {way.by_home} legs lead by home" if way.by_home > 1 else
        "; 1 leg leads by home" if way.by_home else ""
    )  # fmt: skip
    yield "G21" if unit == "mm" else "G20"
    yield "G90 G94"
    yield f"F{_number(feed * 60.0 / scale, 3)}"
    for stop, pose in zip(way.stops, way.pose.tolist(), strict=True):
        words = [
            f"{name.upper()}{_number(value / scale, DIGITS[unit])}"
            if name in "xyz"
            else f"{name.upper()}{_number(value / DEGREE, DIGITS['deg'])}"
            for name, value in zip(machine.commanded, stop, strict=True)
        ]
        yield f"; pose {pose + 1} of {total}" if pose >= 0 else "; home"
        yield "G1 " + " ".join(words)
        if pose >= 0:
            yield f"G4 P{_number(dwell, 3)}"
    yield "M2"


def _program_unit(machine: Machine) -> str:
    unit = machine.file_units.get("length")
    return "inch" if unit is not None and math.isclose(unit.scale, INCH) else "mm"


def _number(value: float, digits: int) -> str:
    """A decimal number without exponent and without idle zeros, never -0."""
    text = f"{value:.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def _ascii(text: str) -> str:
    """Text as printable ASCII without round brackets, for a comment of any controller."""
    kept = "".join(character if " " <= character <= "~" else "?" for character in text)
    return kept.replace("(", "[").replace(")", "]")


def template(machine: Machine, poses: Floats, instruments: Sequence[Instrument]) -> str:
    """A file of measurements for a plan: instruments and commanded poses, what is read left blank.

    `poses` (n, n_commanded), SI. Raises `RequestError` (plan-instrument, bad-poses, no-pose-left).
    """
    written = measurements_text(machine, planned(machine, instruments, Placed(machine, poses)))
    lines = written.splitlines()
    head = [line for line in lines if line.startswith("#:")]
    names = lines[len(head)].split(", ")
    readings = [
        name
        for name in names
        if not name.startswith((INSTRUMENT, "joint.", SET)) and UNCERTAINTY not in name
    ]
    units = [_file_unit(machine, name) for name in machine.commanded]
    commanded = [
        f"command.{name} ({unit.label})"
        for name, unit in zip(machine.commanded, units, strict=True)
    ]
    lines = [*head, ", ".join([INSTRUMENT, *commanded, *readings])]
    for pose in poses:
        cells = [repr(float(unit.to_file(value))) for unit, value in zip(units, pose, strict=True)]
        rest = [*cells, *[""] * len(readings)]
        lines += [", ".join([instrument.name, *rest]).rstrip() for instrument in instruments]
    return "\n".join(lines) + "\n"


def _file_unit(machine: Machine, freedom: str) -> FileUnit:
    dimension, si = ("length", "m") if freedom in "xyz" else ("angle", "rad")
    return machine.file_units.get(dimension) or FileUnit(si)
