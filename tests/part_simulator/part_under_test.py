"""The drawn part on a machine, on both roads: truepose's elements and states, and the simulator's.

The points of the path are truepose's (their division is tested elsewhere, and that they lie on the
drawing here); joints, directions of travel and where a machine goes are the simulator's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from build_machine import description_of, grid_of
from machine_file import File, file_at, loaded
from part_simulator.closed_struts import ClosedStruts, Deviation
from part_simulator.drawn_part import DrawnPart, drawn_part
from part_simulator.errors import Driven, Error, drawn
from part_simulator.measured import Made
from part_simulator.questions import Question, asked_of, features_file
from truepose.machine import Machine
from truepose.runs.poses import required_sources
from truepose.workpiece.along import walk
from truepose.workpiece.features import Feature
from truepose.workpiece.read import Part, read_part
from truepose.workpiece.states import PartState, part_states

Floats = NDArray[np.float64]

MACHINES = Path(__file__).parent.parent.parent / "machines"
SOURCES = {
    "drive": ("backlash", "sensor", "actuator", "guideway"),
    "strut": (
        *("length_tolerance", "base_joint", "platform_joint", "screw"),
        *("stiffness", "base_stiffness", "section_area", "modulus"),
    ),
}
"""Keys by which a machine file has errors of its own."""


def without_errors(path: Path) -> File:
    """A shipped machine with nothing wrong: a test says what is."""
    file = file_at(path)
    for table, keys in SOURCES.items():
        for row in file.get(table, []):
            for key in keys:
                row.pop(key, None)
    for table in ("tolerance", "correlation", "clearance", "condition"):
        file.pop(table, None)
    return file


class PartUnderTest:
    """The part of `questions` about the middle of the workspace of a shipped machine.

    `file`: the machine's, with the errors that a test gave it; `folder` for what is written.
    """

    def __init__(
        self,
        name: str,
        file: File,
        folder: Path,
        questions: Sequence[Question] | None = None,
        *,
        least_squares: bool = False,
    ) -> None:
        path = MACHINES / f"{name}.toml"
        description = description_of(path)
        self.simulated = ClosedStruts(description)
        self.planar = "z" not in description["dof"]
        box = grid_of(path, description["commanded"])
        at = [description["commanded"].index(axis) for axis in ("xy" if self.planar else "xyz")]
        middle = np.zeros(3)
        middle[: len(at)] = box[at].mean(axis=1)
        size = 0.7 * float(np.ptp(box[at], axis=1).min())
        self.drawn: DrawnPart = drawn_part(middle, size, self.planar)
        asked = asked_of(self.planar) if questions is None else questions
        self.questions = [q for q in asked if not (self.planar and q.asks_a_face())]
        self.least_squares = least_squares
        self.machine: Machine = loaded(file, beside=folder)
        self.program, self.features_file = folder / "part.ngc", folder / "features.toml"
        self.program.write_text(self.drawn.text, encoding="utf-8")
        text = features_file(self.drawn, self.questions, least_squares)
        self.features_file.write_text(text, encoding="utf-8")
        self.read: Part = read_part(self.machine, self.program, self.features_file)

    # --- truepose's part

    @cached_property
    def path(self) -> PathPoints:
        """All points of the path."""
        batches = list(self.read.path())
        return PathPoints(
            np.concatenate([batch.poses for batch in batches]),
            np.concatenate([batch.element for batch in batches]) >= 0,
            np.concatenate([batch.line for batch in batches]),
        )

    @cached_property
    def states(self) -> tuple[PartState, ...]:
        """As commanded, and after compensation."""
        machine, condition = self.machine, self.machine.condition
        sources = required_sources(machine, condition)

        walked = walk(machine, condition, sources, self.read.path(), self.read.program)
        states, status = part_states(machine, condition, sources, walked.poses, walked.travel)
        assert not status.any()
        return states

    def evaluated(self, points: Floats) -> dict[str, Floats]:
        """(s, n_quantity) by the question's name, of parts (s, n, 3)."""
        return {
            feature.name: feature.values([points[:, place] for place in places(feature)])
            for feature in self.read.features
        }

    # --- the simulator's

    @cached_property
    def nominal(self) -> tuple[Floats, Floats, Floats]:
        """Joints (p, n_drive), tool points and rotations of the whole path."""
        return self.simulated.inverse(self.path.poses)

    @property
    def on_elements(self) -> NDArray[np.intp]:
        """(n,) which points of the path are the part's."""
        return np.flatnonzero(self.path.on_element)

    @property
    def way(self) -> Driven:
        """The whole path, for errors to know."""
        return Driven(self.simulated, *self.nominal)

    def made_by(self, errors: Sequence[Error], random: np.random.Generator, count: int) -> Floats:
        """(s, n, 3) the part's points, of machines with these errors."""
        return self.driven(drawn(errors, random, count, self.way))

    def driven(self, deviation: Deviation) -> Floats:
        """(s, n, 3) the part's points, of s machines.

        Deviations (s or 1, n or 1), or (s or 1, p) over the whole path.
        """
        on, whole = self.on_elements, len(self.path.poses)
        here = {}
        for name, value in deviation.items():
            every = np.atleast_2d(np.asarray(value, float))
            here[name] = every[:, on] if every.shape[1] == whole else every
        joints, points, rotations = (row[on] for row in self.nominal)
        return self.simulated.forward(joints, points, rotations, here)[0]

    def made(self, points: Floats) -> dict[str, Made]:
        """The elements of one part (n, 3), by their names in the drawing."""
        nominal = self.nominal[1][self.on_elements]
        lines = self.path.lines[self.on_elements]
        found = {}
        for name, text in self.drawn.lines.items():
            first, _, last = text.partition("-")
            own = (lines >= int(first)) & (lines <= int(last or first))
            found[name] = Made(self.drawn.shapes[name], nominal[own], points[own])
        return found

    def measured(self, points: Floats) -> dict[str, list[float]]:
        """The quantities of one part (n, 3), by the question's name."""
        made = self.made(points)
        return {q.name: q.measure(made, self.least_squares) for q in self.questions}


@dataclass(frozen=True, eq=False)
class PathPoints:
    """Poses (p, n_commanded) of the path, which are of the part's elements, and their lines."""

    poses: Floats
    on_element: NDArray[np.bool_]
    lines: NDArray[np.intp]


def places(feature: Feature) -> list[NDArray[np.intp]]:
    """Of each element and datum."""
    return [element.place for element in (*feature.elements, *feature.datums)]
