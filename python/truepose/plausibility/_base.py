"""The form of an oddity and of a rule that finds it, and the machine at home as rules see it.

A rule looks at one machine in the base frame at its home pose, and says in a sentence what is odd,
the numbers, what is usual, and what to do if it is meant. It judges by physics or by ratios of the
machine's own sizes, never by numbers of the library's machines.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from truepose._kernel import STATUS
from truepose.arrays import Codes, Floats
from truepose.errors import TrueposeError
from truepose.language import marked, say
from truepose.sources import Deviation, PoseBlock, acting

if TYPE_CHECKING:
    from truepose.machine import Machine, Strut

OK = STATUS.index("ok")

READABLE = 1e7
"""Of the file's unit: longer lengths are said as a power of ten."""


@dataclass(frozen=True)
class Oddity:
    """What looks odd about a machine. It changes no answer.

    `code`: of the rule; `sentence`: for people; `parts`: paths of what is meant, as in the machine
    file or among the machine's parameters.
    """

    code: str
    sentence: str
    parts: tuple[str, ...] = ()


Remark = tuple[str, tuple[str, ...]]
"""A sentence, and the paths of what it is about."""


@dataclass(frozen=True)
class Rule:
    """One kind of oddity: `code`, `doc` (what is odd), `basis` (the threshold, and its source)."""

    code: str
    doc: str
    basis: str
    inspect: Callable[[MachineAtHome], Iterable[Remark]]

    def oddities(self, view: MachineAtHome) -> Iterator[Oddity]:
        """What the rule finds."""
        for sentence, parts in self.inspect(view):
            yield Oddity(self.code, sentence, parts)


@dataclass(frozen=True, eq=False)
class MachineAtHome:
    """A machine at its home pose, nominal, base frame, SI; what costs anything is made when asked.

    `given_status` (n_pose,): kernel status codes of the poses of its workspace, if they are known.
    """

    machine: Machine
    given_status: Codes | None = None

    @cached_property
    def poses(self) -> Floats:
        """(n_pose, n_commanded) the workspace's; none where the file has none."""
        machine = self.machine
        return (
            np.empty((0, len(machine.commanded))) if machine.workspace is None else machine.poses()
        )

    @cached_property
    def status(self) -> Codes:
        """(n_pose,) status codes of `poses`."""
        if self.given_status is not None:
            return self.given_status
        if len(self.poses) == 0:
            return np.empty(0, np.uint8)
        status = self.machine.inverse(self.poses, status=True)[1]
        solved = self.machine.conditioning(self.poses, status=True)[1]
        return np.where(status == OK, solved, status)

    @cached_property
    def pose(self) -> Floats:
        """(1, n_commanded) home, as it is commanded."""
        machine = self.machine
        at = [machine.dof.index(freedom) for freedom in machine.commanded]
        return np.asarray(machine.home)[at][np.newaxis, :]

    @cached_property
    def placed(self) -> tuple[Floats, Floats, int]:
        """Joint coordinates (1, n_joint), placement (1, 7) and status code at home."""
        joints, placements, status = self.machine.kernel.place(self.pose)
        return joints, placements, int(status[0])

    @property
    def is_reached(self) -> bool:
        """Whether the machine can be at home."""
        return self.placed[2] == OK

    @cached_property
    def conditioning(self) -> float:
        """At home: 1 is best, 0 is singular; NaN out of reach."""
        if not self.is_reached:
            return float("nan")
        value, status = self.machine.conditioning(self.pose, status=True)
        return float(value[0]) if status[0] == OK else 0.0

    @cached_property
    def centres(self) -> Floats:
        """(n_strut, 2, 3) base-side and platform-side joint centres, m; NaN of what is unknown."""
        joints, placements, _ = self.placed
        centres: Floats = self.machine.kernel.joint_centres(joints, placements)[0]
        return centres

    @cached_property
    def nominal(self) -> dict[str, float]:
        """Every parameter's nominal value by its name, SI."""
        machine = self.machine
        return dict(zip(machine.parameters, machine.nominal.tolist(), strict=True))

    @cached_property
    def lengths(self) -> Floats:
        """(n_strut,) m: those of the file, and of telescopic struts at home.

        Out of reach, a telescopic strut has its longest.
        """
        reached = np.linalg.norm(self.centres[:, 1] - self.centres[:, 0], axis=1).tolist()
        lengths = []
        for strut, length in zip(self.machine.struts, reached, strict=True):
            ends = self.telescope(strut)
            at_home = length if ends is None or self.is_reached else ends[1]
            lengths.append(self.nominal.get(f"{strut.part}.length", at_home))
        return np.array(lengths)

    def telescope(self, strut: Strut) -> tuple[float, float] | None:
        """Shortest and longest length, m, of a strut whose drive is its length; None of others."""
        drive = next((d for d in self.machine.drives if d.name == strut.drive), None)
        if drive is None or drive.kind != "telescopic":
            return None
        scale, offset = (
            self.nominal.get(f"{drive.part}.{name}", usual)
            for name, usual in (("scale", 1.0), ("offset", 0.0))
        )
        short, long = sorted(scale * end + offset for end in drive.travel)
        return short, long

    @cached_property
    def size(self) -> float:
        """Diagonal, m, of the box about all joint centres at home, or the longest strut.

        Out of reach, of the boxes about those of the base and of the platform the larger.
        """
        bodies = (
            [self.centres.reshape(-1, 3)]
            if self.is_reached
            else [self.centres[:, 0], self.centres[:, 1]]
        )
        spans = [float(np.nanmax(self.lengths, initial=0.0))]
        for points in bodies:
            known = points[np.isfinite(points).all(axis=1)]
            if len(known):
                spans.append(float(np.linalg.norm(np.ptp(known, axis=0))))
        return max(spans)

    @property
    def is_planar(self) -> bool:
        """Whether the platform moves in a plane, where struts lie in layers above each other."""
        return "z" not in self.machine.dof

    def vector(self, path: str) -> Floats | None:
        """(3,) of the parameters `path.x`, `path.y`, `path.z`; None where there are none."""
        values = [self.nominal.get(f"{path}.{axis}") for axis in "xyz"]
        known = [value for value in values if value is not None]
        return np.array(known) if len(known) == 3 else None

    @cached_property
    def _lever(self) -> dict[str, float]:
        """Part -> the length, m, that its lengths are compared with: the strut's own, or size."""
        levers: dict[str, float] = {}
        for strut, length in zip(self.machine.struts, self.lengths.tolist(), strict=True):
            if np.isfinite(length):
                levers[strut.part] = length
                if strut.drive is not None:
                    path = f"drive.{strut.drive}"
                    levers[path] = min(length, levers.get(path, length))
        return levers

    def lever(self, column: int) -> float:
        """What a deviation of a parameter is a share of: m, or 1 for angles and ratios."""
        machine = self.machine
        if machine.units[column] != "m":
            return 1.0
        part = ".".join(machine.parameters[column].split(".")[:2])
        return self._lever.get(part, self.size)

    @cached_property
    def deviations(self) -> tuple[tuple[str, Deviation], ...]:
        """What each acting source does to the parameters at home, by its name.

        None where the machine is out of reach or nothing holds it. A source that lacks something
        is left out: it is an error wherever it is asked.
        """
        if not self.conditioning > 0.0:
            return ()
        machine, condition = self.machine, self.machine.condition
        joints, placements, _ = self.placed
        block = PoseBlock(machine, condition, self.pose, np.array([0]), joints, placements)
        done = []
        for source in acting(machine):
            try:
                done.append((source.name, source.deviation(machine, condition, block)))
            except TrueposeError:
                continue
        return tuple(done)

    def length(self, metres: float) -> str:
        """A length for people, in the unit of the file; no more digits than are worth reading."""
        unit = self.machine.shown.length
        if abs(metres) * unit.per_si < READABLE:
            return unit.text(metres)
        return marked(f"{metres * unit.per_si:.3g} {unit.label}")

    def quantity(self, value: float, column: int) -> str:
        """A deviation of a parameter for people."""
        shown = self.machine.shown
        unit = self.machine.units[column]
        if unit == "m" and abs(value) >= shown.least_dimension:
            return self.length(value)
        return shown.small(unit).text(value)

    def degrees(self, kelvin: float) -> str:
        """A temperature for people, on the scale of the file."""
        shown = self.machine.shown
        return marked(f"{float(shown.temperature(kelvin)):.4g} {shown.degree}")


def listed(paths: Iterable[str], most: int = 3) -> str:
    """Paths in words: all of a few, the first of many and how many more."""
    every = list(paths)
    if len(every) <= most:
        return ", ".join(every)
    named = ", ".join(every[:most])
    return say("{names} and {count} more", names=named, count=len(every) - most)
