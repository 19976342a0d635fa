"""A machine, a program and what is said of its features -> the part, ready to be evaluated."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.controllers.gcode.program import PROGRAM, ProgramOptions
from truepose.errors import Fault, PartError, Problem
from truepose.files.text_file import on_disk, require_input
from truepose.files.units import FileUnit
from truepose.machine import Condition, Machine
from truepose.workpiece.datum_frame import datum_alignment
from truepose.workpiece.declarations import (
    Declarations,
    Declared,
    Kinds,
    Place,
    declared,
    raise_all,
)
from truepose.workpiece.element import Element
from truepose.workpiece.features._base import Feature, FeatureError
from truepose.workpiece.stretches import Stretches, holds_at
from truepose.workpiece.tables import Alignment, Plane
from truepose.workpiece.walk import MOST_POINTS, PathBatch, ProgramWalk

MOST_DATUM_POINTS = MOST_POINTS // 2
"""Points of a datum that is no feature's element."""

NORMALS: Mapping[Plane, tuple[float, float, float]] = {
    "xy": (0.0, 0.0, 1.0),
    "zx": (0.0, 1.0, 0.0),
    "yz": (1.0, 0.0, 0.0),
}
"""Unit normals of working planes, in the order of G17, G18, G19."""

G17 = 17


@dataclass(frozen=True, eq=False)
class Part:
    """The features of a part, and the path that makes them.

    `elements`: of all features and datums, each with its points; `features` in the order in which
    they are said; `datums`: the frame of alignment "datums", in its order; `alignment`: in which
    coordinates the part is judged. `program` and `file` of features, if there is one: as given.
    `units` that the file of features declares, by dimension.
    """

    elements: tuple[Element, ...]
    features: tuple[Feature, ...]
    datums: tuple[Element, ...]
    alignment: Alignment
    program: str
    file: str | None
    walk: ProgramWalk
    units: Mapping[str, FileUnit]

    @property
    def n_point(self) -> int:
        """Points that belong to elements: `Element.place` counts among them."""
        return 1 + max(int(element.place[-1]) for element in self.elements)

    def path(self) -> Iterator[PathBatch]:
        """The whole path from its beginning, as often as it is asked for.

        Rows with `element` of 0 or more are, in this order, the points of the elements. Raises
        `RequestError`: gcode-start, gcode-pose, gcode-singularity, with the line of the program.
        """
        return self.walk.path()


def read_part(
    machine: Machine,
    program: str | PathLike[str],
    features: str | PathLike[str] | None = None,
    options: ProgramOptions | None = None,
    condition: Condition | None = None,
    kinds: Kinds | None = None,
) -> Part:
    """The part that a program makes, with the features of a file and of the program's comments.

    `options`: what the program does not say of itself; `kinds` of features by name, default all.

    Raises `PartError` with every problem of what is said of the part; `RequestError` with those of
    the program and of a path that the machine cannot go (gcode-...), bad-correction for an option,
    and for a file that is not there.
    """
    if kinds is None:
        from truepose.workpiece.features import REGISTRY

        kinds = REGISTRY
    path = Path(program)
    require_input(path, PROGRAM)
    file = None if features is None else Path(features)
    options = ProgramOptions() if options is None else options

    def feed_lines() -> Indices:
        return ProgramWalk(machine, path, options, Stretches([])).feed_lines()

    with on_disk(path) as opened:
        said = declared(machine, path, opened, file, kinds, feed_lines)
    places = list(dict.fromkeys(place for row in said.every for place in row.places))
    walk = ProgramWalk(
        machine,
        path,
        options,
        Stretches(places),
        [_most_points(place, said.every) for place in places],
        condition,
    )
    _require_motion(said, places, walk)
    if not said.features:
        raise PartError(_nothing(path, file))
    return _built(said, places, walk, file)


def _nothing(program: Path, features: Path | None) -> Problem:
    return Problem(
        "no-feature",
        "no feature of the part is named",
        str(features or program),
        found="no feature, neither in a comment of the program nor in a features file",
        expected="a comment such as (feature: bore, diameter 40 +0.025 0), or [[feature]]",
        hint="--propose-features writes those that it finds to --output FILE.toml, to be edited",
    )


def _most_points(place: Place, rows: Sequence[Declared]) -> int:
    """Points that the elements with these lines may have, in whatever feature they are."""
    return min(
        MOST_DATUM_POINTS if row.kind is None else MOST_POINTS // len(row.places)
        for row in rows
        if place in row.places
    )


def _require_motion(said: Declarations, places: Sequence[Place], walk: ProgramWalk) -> None:
    raise_all(
        row.problem(
            Fault(
                "part-no-motion",
                f"the lines of {row.what} move nothing at feed",
                found=", ".join(f"{first} to {last}" for first, last in place[:3]),
                expected="lines with G1, G2 or G3 and axes that move",
                hint="a rapid (G0) cuts nothing; lines behind M2 or M30 are not read",
            )
        )
        for row in said.every
        for place in row.places
        if not walk.extents[places.index(place)].moves
    )


def _built(
    said: Declarations, places: Sequence[Place], walk: ProgramWalk, file: Path | None
) -> Part:
    found = walk.elements()
    part = said.part

    def element(row: Declared, number: int) -> Element:
        stretch = places.index(row.places[number])
        points, lines, place = found[stretch]
        several = f", wall {number + 1}" if len(row.places) > 1 else ""
        radius = row.table.tool_radius
        return Element(
            f"{row.name}{several}",
            points,
            place,
            lines,
            _normal(part.plane, holds_at(int(lines[0]), said.text.planes)),
            part.tool_radius if radius is None else radius,
            walk.is_closed(stretch),
        )

    datums = {row.name: element(row, 0) for row in said.datums}
    elements = list(datums.values())
    features: list[Feature] = []
    problems: list[Problem] = []
    for row in said.features:
        own = [element(row, number) for number in range(len(row.places))]
        elements += own
        assert row.kind is not None
        assert row.row is not None
        method = getattr(row.table, "evaluate", None) or part.evaluate
        try:
            features.append(
                row.kind.build(
                    row.name, row.row, own, {name: datums[name] for name in row.datums}, method
                )
            )
        except FeatureError as error:
            problems.append(row.problem(error.fault))
    frame = tuple(datums[name] for name in part.datums)
    if part.alignment == "datums":
        try:
            datum_alignment(frame, least_squares=False)
        except FeatureError as error:
            problems.append(said.document.problem(error.fault, ("part", "datums")))
    raise_all(problems)
    return Part(
        tuple(elements),
        tuple(features),
        frame,
        part.alignment,
        str(walk.program),
        None if file is None else str(file),
        walk,
        said.units,
    )


def _normal(plane: Plane | None, code: int | None) -> Floats:
    """(3,) unit normal of the plane that is said, or of the one that the program sets."""
    planes = tuple(NORMALS)
    return np.array(NORMALS[plane or planes[(code or G17) - G17]])


__all__ = ["Part", "read_part"]
