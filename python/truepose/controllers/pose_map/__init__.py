"""Pose map: what to add to a wanted pose, on a grid, for a controller with a table of its own.

    commanded = wanted + correction(wanted)

freedom by freedom, angles as they are programmed. Between the nodes the correction is taken to be
multilinear; how wrong that is is found by comparing with exact corrections there.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import ClassVar

import numpy as np

from truepose._kernel import STATUS
from truepose.arrays import Flags, Floats
from truepose.compensation.commands import ActualMachine, blocks, corrected_poses, has_joints
from truepose.controllers._export import Export, Option
from truepose.controllers._fit import Extent, extent
from truepose.controllers._small_model import ascii_only, fixed, stem
from truepose.controllers.pose_map.grid import COUNT, Grid, grid_of
from truepose.errors import Problem, RequestError
from truepose.files.units import FileUnit, default_units
from truepose.files.wording import counted
from truepose.machine import Machine
from truepose.runs.controller_geometry import ROUNDING, nothing_to_correct
from truepose.runs.dataset import provenance
from truepose.runs.poses import OK, pose_in_words
from truepose.spatial import angle_between

FINEST = 1e-10
"""m and rad to which corrections are written, and finer."""

SCATTERED, CENTRES = 20_000, 20_000
"""Points at which the interpolation is judged: random ones, and middles of cells."""

WORST, STEPS, ROUNDS = 30, 20, 8
"""The search for the largest goes on from so many points, so many steps from each, so often."""

SEED = 1

FRAME = "base frame of the machine file; the tool point"
CONVENTION = "R = Rz(c) Ry(b) Rx(a)"
USE = "commanded = wanted + correction(wanted), multilinear between the nodes"


@dataclass(frozen=True, eq=False)
class NodeCorrections:
    """Corrections (n_node, n_commanded) as written, in file units, NaN without one; their status.

    `units`: of each commanded freedom. `digits`: decimals that are written.
    """

    machine: Machine
    grid: Grid
    units: tuple[FileUnit, ...]
    digits: tuple[int, ...]
    corrections: Floats
    status: np.ndarray

    @property
    def corrections_si(self) -> Floats:
        """(n_node, n_commanded) m and rad."""
        scale = np.array([unit.scale for unit in self.units])
        scaled: Floats = self.corrections * scale
        return scaled


def pose_map(machine: Machine, grid: Grid) -> NodeCorrections:
    """Exact corrections at every node. Raises `RequestError` (no-pose-left) where there is none."""
    nodes = grid.nodes
    commanded, status = corrected_poses(machine, nodes)
    if not has_joints(status).any():
        raise RequestError(
            Problem(
                "no-pose-left",
                "the machine can reach no node of the pose map",
                file=machine.file,
                found=f"{len(nodes)} nodes out of reach",
                expected="a workspace within the machine's reach",
            )
        )
    known = default_units() | dict(machine.file_units)
    units = tuple(known["length" if name in "xyz" else "angle"] for name in machine.commanded)
    digits = tuple(max(0, math.ceil(math.log10(unit.scale / FINEST))) for unit in units)
    written = np.empty_like(nodes)
    for column, (unit, places) in enumerate(zip(units, digits, strict=True)):
        written[:, column] = np.round(
            (commanded[:, column] - nodes[:, column]) / unit.scale, places
        )
    return NodeCorrections(machine, grid, units, digits, written, status)


@dataclass(frozen=True)
class MapErrors:
    """What interpolation is wrong by, m and rad, over the points.

    `commandable`: the same over those points alone whose exact command is within travel; None
    where all are, or none is. `points`: how many different ones were compared; `left_out`: how
    many lie in cells with a node out of reach.
    """

    position: Extent
    orientation: Extent | None
    commandable: Commandable | None
    points: int
    left_out: int


@dataclass(frozen=True)
class Commandable:
    """What interpolation is wrong by where the machine may go, m and rad, over `points`."""

    position: Extent
    orientation: Extent | None
    points: int


def assess(nodes: NodeCorrections) -> MapErrors:
    """Compare interpolated with exact corrections between the nodes.

    The rms is that over points scattered all over the box. The largest is looked for from the worst
    of those and of the middles of the cells, where a smooth correction is worst, by steps at random
    that shrink.
    """
    grid = nodes.grid
    middles = grid.centres()
    chosen = np.unique(np.linspace(0, len(middles) - 1, min(len(middles), CENTRES)).astype(np.intp))
    scattered = _compare(nodes, grid.scattered(SCATTERED, SEED))
    if not len(scattered.points):
        raise RequestError(
            Problem(
                "no-pose-left",
                "no cell of the pose map lies within the machine's reach",
                file=nodes.machine.file,
                found=f"{SCATTERED} points in cells with a node out of reach",
                expected="a workspace within the machine's reach, or more nodes",
            )
        )
    first = [scattered, _compare(nodes, middles[chosen])]
    turns = any(name in "abc" for name in nodes.machine.commanded)
    kinds = [_POSITION, _ORIENTATION] if turns else [_POSITION]
    allowed = sum(int(compared.allowed.sum()) for compared in first)
    some_out = allowed < sum(len(compared.points) for compared in first)
    if some_out and allowed:
        kinds += [_only_allowed(of) for of in kinds]
    every = [*first, *(compared for of in kinds for compared in _search(nodes, first, of))]
    points = np.concatenate([compared.points for compared in every])
    even = np.arange(len(points)) < len(scattered.points)
    within = np.concatenate([compared.allowed for compared in every])

    def over(of: _Of, chosen: Flags) -> Extent:
        values = np.concatenate([of(compared) for compared in every])[chosen]
        # The scattered ones alone are even; where none of them is left, all have to do.
        spread = even[chosen] if even[chosen].any() else np.ones(len(values), np.bool_)
        return extent(values, points[chosen], spread)

    def orientation(chosen: Flags) -> Extent | None:
        return over(_ORIENTATION, chosen) if turns else None

    all_of = np.ones(len(points), np.bool_)
    commandable = None
    if not within.all() and within.any():
        count = len(np.unique(points[within], axis=0))
        commandable = Commandable(over(_POSITION, within), orientation(within), count)
    return MapErrors(
        over(_POSITION, all_of),
        orientation(all_of),
        commandable,
        len(np.unique(points, axis=0)),
        sum(compared.left_out for compared in every),
    )


@dataclass(frozen=True, eq=False)
class _Compared:
    """Usable points (n, n_axis), and what interpolation is off there, (n,).

    `position` in m, `orientation` in rad; `allowed`: whether the exact command is within travel;
    `left_out`: points that are not usable.
    """

    points: Floats
    position: Floats
    orientation: Floats
    allowed: Flags
    left_out: int


_Of = Callable[[_Compared], Floats]
_POSITION: _Of = attrgetter("position")
_ORIENTATION: _Of = attrgetter("orientation")


def _only_allowed(of: _Of) -> _Of:
    return lambda compared: np.where(compared.allowed, of(compared), 0.0)


def _compare(nodes: NodeCorrections, points: Floats) -> _Compared:
    machine = nodes.machine
    exact, status = corrected_poses(machine, points)
    added = nodes.grid.interpolated(nodes.corrections_si, points)
    usable = has_joints(status) & np.isfinite(added).all(axis=1)
    at, exact, added = points[usable], exact[usable], points[usable] + added[usable]
    linear = [column for column, name in enumerate(machine.commanded) if name in "xyz"]
    place = machine.kernel.placement_of
    return _Compared(
        at,
        np.linalg.norm((added - exact)[:, linear], axis=1),
        angle_between(place(added)[:, 3:], place(exact)[:, 3:]),
        status[usable] == OK,
        int((~usable).sum()),
    )


def _search(nodes: NodeCorrections, first: Sequence[_Compared], of: _Of) -> list[_Compared]:
    """More points about the worst ones: rounds of random steps, each half as long as the last."""
    points = np.concatenate([compared.points for compared in first])
    values = np.concatenate([of(compared) for compared in first])
    ends = np.array([(axis.start, axis.stop) for axis in nodes.grid.axes])
    cell = (ends[:, 1] - ends[:, 0]) / np.maximum(np.array(nodes.grid.shape) - 1, 1)
    generator = np.random.default_rng(SEED)
    tried: list[_Compared] = []
    for round_ in range(ROUNDS):
        worst = np.argsort(values)[-WORST:]
        points, values = points[worst], values[worst]
        steps = generator.uniform(-1.0, 1.0, (STEPS, *points.shape)) * cell * 0.5 ** (round_ + 1)
        moved = np.clip((points + steps).reshape(-1, len(ends)), ends[:, 0], ends[:, 1])
        tried.append(_compare(nodes, moved))
        points = np.concatenate([points, tried[-1].points])
        values = np.concatenate([values, of(tried[-1])])
    return tried


class PoseMap:
    """Corrections on a grid, as CSV and JSON."""

    name: ClassVar[str] = "pose-map"
    doc: ClassVar[str] = "what to add to each pose, on a grid, as CSV and JSON for any controller"
    options: ClassVar[Mapping[str, Option]] = {"count": COUNT}

    @classmethod
    def export(cls, machine: Machine, options: Mapping[str, float | str]) -> Export:
        """The same map in both formats.

        Raises `RequestError`: bad-option, no-workspace, grid-too-large, no-pose-left; and
        controller-unsaid, controller-contradicted as `corrected_poses`.
        """
        nodes = pose_map(machine, grid_of(machine, str(options["count"])))
        judged = assess(nodes)
        head = _head(nodes)
        lines = statement(nodes, judged)
        name = f"{stem(machine)}_pose_map"
        files = {
            f"{name}.csv": _csv(nodes, head, lines),
            f"{name}.json": _json(nodes, judged, head),
        }
        return Export(files, lines)


def statement(nodes: NodeCorrections, judged: MapErrors) -> tuple[str, ...]:
    """Lines for the user."""
    machine = nodes.machine
    count = " x ".join(str(number) for number in nodes.grid.shape)
    lines = [f"{counted(len(nodes.status), 'node')} ({count}); {USE}"]
    if not np.nan_to_num(nodes.corrections).any() and not _deviates(nodes):
        lines.insert(0, f"WARNING: {nothing_to_correct(machine)['sentence']}")
    if judged.points == 1:
        lines.append("one node: there is nothing to interpolate")
    else:
        text = _both(machine, judged)
        lines.append(f"interpolation between the nodes is off by {text}")
    where = judged.commandable
    if where is not None:
        lines.append(
            f"where the machine may be commanded to, at {counted(where.points, 'point')} of them: "
            f"{_both(machine, where)}"
        )
    lines.append(f"the corrections at the nodes: {_words(machine, _sizes(nodes), 'm')}")
    if judged.points > 1:
        points = counted(judged.points, "point")
        lines.append(f"compared with exact corrections at {points} between the nodes")
    names, counts = np.unique(nodes.status[nodes.status != OK], return_counts=True)
    for code, number in zip(names, counts, strict=True):
        what = str(STATUS[code]).replace("_", " ")
        be, instead = ("is", "it has") if number == 1 else ("are", "they have")
        lines.append(f"{counted(number, 'node')} {be} {what}: {instead} {_instead(int(code))}")
    if judged.left_out:
        were = "was" if judged.left_out == 1 else "were"
        points = counted(judged.left_out, "point")
        lines.append(f"{points} in cells with such a node {were} not compared")
    return tuple(lines)


def _deviates(nodes: NodeCorrections) -> bool:
    """Whether anything is known to be off at a node, be it what no command corrects."""
    actual = ActualMachine(nodes.machine)
    wanted = nodes.grid.nodes
    for rows in blocks(len(wanted)):
        known = actual.deviations_at(wanted[rows])
        error, _ = actual.error(known, known.block.joints)
        if np.abs(np.nan_to_num(error)).max(initial=0.0) >= ROUNDING:
            return True
    return False


def _sizes(nodes: NodeCorrections) -> Extent:
    """How far corrections move the tool point."""
    linear = [at for at, name in enumerate(nodes.machine.commanded) if name in "xyz"]
    sizes = np.linalg.norm(nodes.corrections_si[:, linear], axis=1)
    have = np.isfinite(sizes)
    return extent(sizes[have], nodes.grid.nodes[have])


def _instead(code: int) -> str:
    if has_joints(np.array([code], np.uint8))[0]:
        return "corrections, but must not be commanded"
    return "no correction"


def _both(machine: Machine, judged: MapErrors | Commandable) -> str:
    text = _words(machine, judged.position, "m")
    if judged.orientation is not None:
        text += f"; {_words(machine, judged.orientation, 'rad')}"
    return text


def _words(machine: Machine, extent: Extent, unit: str) -> str:
    shown = machine.shown.small(unit)
    places = 2 if shown.per_si >= 1e6 else 4
    highest, rms = (f"{v * shown.per_si:.{places}f}" for v in (extent.highest, extent.rms))
    return (
        f"at most {highest} {shown.label} (at {pose_in_words(machine, extent.at)}), "
        f"rms {rms} {shown.label}"
    )


def _head(nodes: NodeCorrections) -> dict[str, object]:
    """What the map is of and how it is to be read, for both formats."""
    known = provenance(nodes.machine, nodes.machine.condition)
    given = {key: known[key] for key in ("truepose_version", "machine", "machine_file")}
    return {
        "format": "truepose pose map 1",
        **given,
        "machine_file_sha256": known["machine_hash"],
        "settings": known["settings"],
        "replaced": known["replaced"],
        "condition": json.loads(str(known["condition"])),
        "frame": FRAME,
        "orientation": CONVENTION,
        "use": USE,
        "order": "the first axis runs fastest",
    }


def _csv(nodes: NodeCorrections, head: Mapping[str, object], lines: tuple[str, ...]) -> str:
    out = io.StringIO()
    for key, value in head.items():
        text = value if isinstance(value, str) else json.dumps(value)
        if text:
            out.write(f"# {key}: {ascii_only(text)}\n")
    for line in lines:
        out.write(f"# {ascii_only(line)}\n")
    rows = csv.writer(out, lineterminator="\n")
    columns = [
        f"{what}{name} ({unit.label})"
        for what in ("", "add_")
        for name, unit in zip(nodes.machine.commanded, nodes.units, strict=True)
    ]
    rows.writerow([*columns, "status"])
    for node, added, code in zip(nodes.grid.nodes, nodes.corrections, nodes.status, strict=True):
        place = [
            f"{value / unit.scale:.12g}" for value, unit in zip(node, nodes.units, strict=True)
        ]
        numbers = [
            "" if math.isnan(value) else fixed(value, places)
            for value, places in zip(added, nodes.digits, strict=True)
        ]
        rows.writerow([*place, *numbers, STATUS[code]])
    return out.getvalue()


def _json(nodes: NodeCorrections, judged: MapErrors, head: Mapping[str, object]) -> str:
    machine = nodes.machine
    axes = [
        {"name": name, "unit": unit.label, "nodes": [float(f"{v / unit.scale:.12g}") for v in axis]}
        for name, unit, axis in zip(machine.commanded, nodes.units, nodes.grid.values, strict=True)
    ]
    columns = {
        name: [None if math.isnan(value) else float(value) for value in column]
        for name, column in zip(machine.commanded, nodes.corrections.T, strict=True)
    }
    document = {
        **head,
        "interpolation_error": {
            **_errors(judged),
            "commandable": None if judged.commandable is None else _errors(judged.commandable),
        },
        "axes": axes,
        "corrections": columns,
        "status": [STATUS[code] for code in nodes.status],
    }
    # One key a line: a column of numbers reads better, and shorter, along it.
    lines = [f"{json.dumps(k)}: {json.dumps(v, allow_nan=False)}" for k, v in document.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _errors(judged: MapErrors | Commandable) -> dict[str, object]:
    return {
        "position_m": _extent_data(judged.position),
        "orientation_rad": None if judged.orientation is None else _extent_data(judged.orientation),
        "points": judged.points,
    }


def _extent_data(extent: Extent) -> dict[str, object]:
    return {"highest": extent.highest, "rms": extent.rms, "highest_at": extent.at.tolist()}


__all__ = ["NodeCorrections", "PoseMap", "assess", "pose_map"]
