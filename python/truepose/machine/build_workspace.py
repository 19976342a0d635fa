"""The poses and the home of a machine, from the models of a file without problems."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Fault, Problem
from truepose.files.data_file import Column, DataFiles
from truepose.files.dimensions import FREEDOMS
from truepose.files.document import Document, Key
from truepose.files.units import QuantityError
from truepose.files.wording import counted
from truepose.machine.tables.machine import MachineTable
from truepose.machine.tables.workspace import (
    WAYS,
    BoxTable,
    CylinderTable,
    GridTable,
    PathTable,
    Rows,
    WorkspaceTable,
)
from truepose.machine.validation import Validated
from truepose.machine.workspace import (
    LARGEST_GRID,
    MOST_POSES,
    GridAxis,
    Workspace,
    along,
    disc,
    disc_size,
    grid,
    steps,
)

Home = Mapping[str, float]


def workspace(
    document: Document, validated: Validated, data_files: DataFiles, problems: list[Problem]
) -> tuple[Workspace | None, Home]:
    """The workspace, and the home pose by freedom; what home does not name is 0.

    None, and something in `problems` or in those of `data_files`, where the poses are no good.
    """
    table, machine = validated.table(WorkspaceTable), validated.table(MachineTable)
    if table is None or machine is None:
        return None, {}
    home = {}
    if table.home is not None:
        home = {freedom: getattr(table.home, freedom) for freedom in FREEDOMS}
    commanded = tuple(machine.commanded or machine.dof)
    making = _Making(document, validated, data_files, problems, commanded, home)
    workspace = making.made(table)
    if workspace is not None and table.home is None:
        home = dict(zip(commanded, _middle(workspace).tolist(), strict=True))
    return workspace, home


def too_large(
    document: Document, size: float, key: Key, most: int = LARGEST_GRID
) -> Problem | None:
    """The problem of so many poses, asked for at `key`, if they are too many."""
    if size <= most:
        return None
    return document.problem(
        Fault(
            "grid-too-large",
            "more poses than are allowed",
            found=f"{size:.3g} poses" if size < 1e300 else "more than 1e300 poses",
            expected=f"at most {most:.0e} poses".replace("e+0", "e").replace("e+", "e"),
        ),
        key,
    )


def _middle(workspace: Workspace) -> Floats:
    if workspace.listed is None:
        return np.array([axis.centre for axis in workspace.axes])
    middle: Floats = 0.5 * (workspace.listed.min(axis=0) + workspace.listed.max(axis=0))
    return middle


@dataclass(frozen=True)
class _Making:
    """The ways to give poses, one method each."""

    document: Document
    validated: Validated
    data_files: DataFiles
    problems: list[Problem]
    commanded: tuple[str, ...]
    home: Home

    def made(self, table: WorkspaceTable) -> Workspace | None:
        line = self.document.line(("workspace",))
        (way,) = (key for key in WAYS if getattr(table, key) is not None)
        makers: dict[str, Callable[[], tuple[GridAxis, ...] | Floats | None]] = {
            "grid": lambda: self._grid(table.grid),
            "box": lambda: self._box(table.box),
            "cylinder": lambda: self._cylinder(table.cylinder),
            "poses": lambda: self._rows(table.poses, ("workspace", "poses")),
            "path": lambda: self._path(table.path),
        }
        poses = makers[way]()
        if poses is None:
            return None
        if isinstance(poses, tuple):
            return Workspace(poses, line=line)
        return Workspace(listed=poses, line=line, is_path=way == "path")

    def _stays(self, freedom: str) -> GridAxis:
        value = self.home.get(freedom, 0.0)
        return GridAxis(freedom, value, value, 1)

    def _grid(self, table: GridTable | None) -> tuple[GridAxis, ...]:
        spans = {freedom: getattr(table, freedom) for freedom in self.commanded}
        return tuple(
            self._stays(freedom) if span is None else GridAxis(freedom, *span)
            for freedom, span in spans.items()
        )

    def _filled(
        self, table: BoxTable | CylinderTable | None, freedoms: Sequence[str]
    ) -> tuple[GridAxis, ...]:
        """An axis for each of `freedoms`, in steps of at most what the table says."""
        assert table is not None
        axes = []
        for freedom in freedoms:
            span = getattr(table, freedom)
            if span is None:
                axes.append(self._stays(freedom))
                continue
            step = table.step if FREEDOMS[freedom] == "length" else table.angle_step
            start, stop = span
            count = 1 if start == stop else 1 + steps(stop - start, step or math.inf)
            axes.append(GridAxis(freedom, start, stop, count))
        return tuple(axes)

    def _box(self, table: BoxTable | None) -> tuple[GridAxis, ...] | None:
        axes = self._filled(table, self.commanded)
        size = math.prod(float(axis.count) for axis in axes)
        return None if self._refused(size, ("workspace", "box"), LARGEST_GRID) else axes

    def _cylinder(self, table: CylinderTable | None) -> Floats | None:
        assert table is not None
        if not {"x", "y"} <= set(self.commanded):
            return None  # a check has said so
        others = [freedom for freedom in self.commanded if freedom not in ("x", "y")]
        axes = self._filled(table, others)
        layers = math.prod(float(axis.count) for axis in axes)
        if self._refused(layers * disc_size(table.radius, table.step), ("workspace", "cylinder")):
            return None
        points = disc(table.radius, table.step)
        points += table.centre or (self.home.get("x", 0.0), self.home.get("y", 0.0))
        layered = grid(axes)
        poses = np.empty((len(points) * len(layered), len(self.commanded)))
        poses[:, [self.commanded.index("x"), self.commanded.index("y")]] = np.tile(
            points, (len(layered), 1)
        )
        if others:
            columns = [self.commanded.index(freedom) for freedom in others]
            poses[:, columns] = np.repeat(layered, len(points), axis=0)
        return poses

    def _rows(self, given: Rows | str | None, key: Key) -> Floats | None:
        """(n, n_commanded) poses, SI, of a list or a CSV file."""
        assert given is not None
        return self._of_file(given, key) if isinstance(given, str) else self._of_list(given, key)

    def _of_file(self, name: str, key: Key) -> Floats | None:
        columns = [Column(f, FREEDOMS[f], required=False) for f in self.commanded]
        table = self.data_files.read(name, columns, key)
        if table is None or self._refused(table.n_row, key):
            return None
        stays = [np.full(table.n_row, self.home.get(freedom, 0.0)) for freedom in self.commanded]
        return np.stack(
            [table.numbers.get(f, stay) for f, stay in zip(self.commanded, stays, strict=True)],
            axis=1,
        )

    def _of_list(self, given: Rows, key: Key) -> Floats | None:
        result = np.zeros((len(given), len(self.commanded)))
        before = len(self.problems)
        for row, pose in enumerate(given):
            for column, (value, freedom) in enumerate(zip(pose, self.commanded, strict=True)):
                try:
                    result[row, column] = self.validated.units.read(value, FREEDOMS[freedom])
                except QuantityError as error:
                    self.problems.append(self.document.problem(error.fault, (*key, row, column)))
        return result if len(self.problems) == before else None

    def _path(self, table: PathTable | None) -> Floats | None:
        assert table is not None
        key: Key = ("workspace", "path", "points")
        points = self._rows(table.points, key)
        if points is None:
            return None
        if len(points) < 2:
            self._refuse_path("points", counted(len(points), "point"), "at least two points")
            return None
        moves = np.diff(points, axis=0)
        angles = np.array([FREEDOMS[freedom] == "angle" for freedom in self.commanded])
        distance = np.linalg.norm(moves[:, ~angles], axis=1)
        turn = np.abs(moves[:, angles]).max(axis=1, initial=0.0)
        if not self._spaced(table, distance, turn):
            return None
        counts = [
            max(
                steps(way, table.step or math.inf),
                steps(angle, table.angle_step or math.inf),
                int(way > 0.0 or angle > 0.0),
            )
            for way, angle in zip(distance.tolist(), turn.tolist(), strict=True)
        ]
        if self._refused(1.0 + math.fsum(map(float, counts)), ("workspace", "path")):
            return None
        return along(points, np.array(counts, np.intp))

    def _spaced(self, table: PathTable, distance: Floats, turn: Floats) -> bool:
        """Whether every line of a path that is divided has a step that divides it."""
        still = (
            ("angle_step", table.step, table.angle_step, (turn > 0.0) & (distance == 0.0), "turns"),
            ("step", table.angle_step, table.step, (distance > 0.0) & (turn == 0.0), "moves"),
        )
        good = True
        for key, given, lacking, lines, does in still:
            if given is not None and lacking is None and lines.any():
                at = int(np.flatnonzero(lines)[0])
                only = f"the line from point {at + 1} to point {at + 2} only {does}, without {key}"
                self._refuse_path(key, only, f"{key}, as there are lines that only it divides")
                good = False
        return good

    def _refuse_path(self, key: str, found: str, expected: str) -> None:
        self.problems.append(
            self.document.problem(
                Fault("missing-key", "the path lacks something", found=found, expected=expected),
                ("workspace", "path", key),
            )
        )

    def _refused(self, size: float, key: Key, most: int = MOST_POSES) -> bool:
        problem = too_large(self.document, size, key, most)
        if problem is not None:
            self.problems.append(problem)
        return problem is not None
