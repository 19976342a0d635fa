"""The whole program through the machine: its known error all along, and what the elements need.

The path is walked in batches, in constant memory. The flank on which a play lies follows from the
way that the drives came, over the whole path and not over an element alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

from truepose._kernel import STATUS
from truepose.arrays import Floats, Indices
from truepose.errors import Problem, RequestError
from truepose.machine import Condition, Machine
from truepose.runs.displacement import displacement
from truepose.runs.first_order import effects_at
from truepose.runs.poses import OK, Travel, pose_in_words, reason_text
from truepose.runs.variables import Variables, variables_at
from truepose.sources import PoseBlock, Source
from truepose.workpiece.states import in_space

if TYPE_CHECKING:
    from truepose.workpiece.walk import PathBatch


@dataclass(frozen=True, eq=False)
class PathErrors:
    """What is known of the m points of a batch of the path.

    `batch`; `points` (m, 3) programmed, `known` (m, 3) error there, m; `half` (m,): length of the
    95 % half widths of its components, to first order, m, or None where nobody asked.
    """

    batch: PathBatch
    points: Floats
    known: Floats
    half: Floats | None


class Sink(Protocol):
    """Who looks at the path as it is walked: a file of points, a picture.

    `wants_half`: whether it needs half widths, which take longer than the known error.
    """

    wants_half: bool

    def add(self, errors: PathErrors) -> None:
        """The next points."""
        ...


@dataclass
class Walked:
    """The path, walked: poses and travel of the elements' points, and the known error at its most.

    `poses` (n, n_commanded), `travel` (n, n_joint), `lines` (n,) of the kept points, in their
    order. `largest`, m, known error of all feeds, at `largest_line`; `rms`, m, over the path.
    """

    poses: Floats
    travel: Floats
    lines: Indices
    points: int = 0
    largest: float = 0.0
    largest_line: int = 0
    _square: float = field(default=0.0, repr=False)
    _length: float = field(default=0.0, repr=False)

    @property
    def rms(self) -> float:
        """m, weighted by the length of the path."""
        return float(np.sqrt(self._square / self._length)) if self._length > 0.0 else 0.0

    def note(self, batch: PathBatch, known: Floats) -> None:
        """The known error (m, 3) of a batch, at feeds."""
        sizes = np.where(batch.is_feed, np.sqrt(np.einsum("na,na->n", known, known)), 0.0)
        weights = np.where(batch.is_feed, batch.weight, 0.0)
        at = int(np.argmax(sizes)) if sizes.size else 0
        if sizes.size and sizes[at] > self.largest:
            self.largest, self.largest_line = float(sizes[at]), int(batch.line[at])
        self.points += len(sizes)
        self._square += float(weights @ np.square(sizes))
        self._length += float(weights.sum())


def unusable_point(
    machine: Machine, program: str, line: int, pose: Floats, why: str
) -> RequestError:
    """The error for a point of the path that the actual machine cannot take (gcode-pose)."""
    return RequestError(
        Problem(
            "gcode-pose",
            "the nominal machine goes there, but not as the error sources move it",
            file=program,
            line=line,
            found=f"{reason_text(why)} at {pose_in_words(machine, pose)}",
            expected="a path within reach of the actual machine too",
            hint="look for a number of the wrong size or unit among the sources, or keep away from "
            "the end of the reach",
        )
    )


def walk(
    machine: Machine,
    condition: Condition,
    sources: Sequence[Source],
    batches: Iterable[PathBatch],
    program: str,
    sinks: Sequence[Sink] = (),
) -> Walked:
    """Drive the whole path of `program`. Raises `RequestError` (gcode-pose) where it cannot go."""
    way = Travel(machine)
    poses, travels, lines = [], [], []
    walked = Walked(np.empty((0, 0)), np.empty((0, 0)), np.empty(0, np.intp))
    half_wanted = any(sink.wants_half for sink in sinks)
    for batch in batches:
        every = np.arange(len(batch.poses), dtype=np.intp)
        block = PoseBlock(
            machine,
            condition,
            batch.poses,
            every,
            batch.joints,
            batch.placements,
            way.into(batch.joints),
        )
        _, balanced = block.balance
        variables = variables_at(machine, block, sources)
        moved = _contiguous(variables)
        error, status = displacement(machine, block.joints, block.placements, moved)
        lost = np.flatnonzero((balanced != OK) | (status != OK))
        if lost.size:
            at = int(lost[0])
            why = STATUS[balanced[at] if balanced[at] != OK else status[at]]
            raise unusable_point(machine, program, int(batch.line[at]), batch.poses[at], why)
        known = in_space(machine, error)
        half = _half_widths(machine, block, variables) if half_wanted else None
        walked.note(batch, known)
        for sink in sinks:
            sink.add(PathErrors(batch, batch.placements[:, :3], known, half))
        kept = batch.element >= 0
        if kept.any():
            poses.append(batch.poses[kept])
            assert block.travel is not None
            travels.append(block.travel[kept])
            lines.append(batch.line[kept])
    if poses:
        walked.poses, walked.travel = np.concatenate(poses), np.concatenate(travels)
        walked.lines = np.concatenate(lines)
    return walked


def _contiguous(variables: Variables) -> tuple[Indices, Floats]:
    parameters, shift = variables.shift
    return parameters, np.ascontiguousarray(shift)


HALF_WIDTHS = 1.96
"""Standard deviations in the half of a 95 % interval of a normal distribution."""


def _half_widths(machine: Machine, block: PoseBlock, variables: Variables) -> Floats:
    """(n,) m, of the position, to first order."""
    effects, status = effects_at(machine, block, variables, _contiguous(variables))
    sigmas = np.array([one.sigmas for one in variables.distributions])
    if not sigmas.size:
        return np.zeros(len(effects))
    spread = np.swapaxes(in_space(machine, np.swapaxes(effects / sigmas, 1, 2)), 1, 2)
    other = spread if variables.correlation is None else spread @ variables.correlation
    variances = np.einsum("nav,nav->n", spread, other)
    return np.where(status == OK, HALF_WIDTHS * np.sqrt(np.maximum(variances, 0.0)), np.nan)
