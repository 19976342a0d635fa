"""The walk over the poses of a run: in blocks, what cannot be used set aside and counted.

One rule says for every command which poses these are. A pose belongs to a run where the machine
goes with the nominal command: as drawn, with each source alone at its shift, and with all of them
together (`exact.at_shifts`). Where it does not, the pose is left out with the kernel's status,
whatever was asked. What the bands do there is not the pose's but the command's: one that meets a
machine inside the bands that cannot be assembled leaves the pose out as `band`, or counts it as a
sample that failed, and no verdict is a yes there (`broken`).

A block bounds the memory of everything that is kept a pose only while it is worked on, lets
Ctrl-C and progress in between two blocks, and is long enough for the kernel's lanes and threads.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from truepose._kernel import STATUS
from truepose.arrays import Flags, Floats, Indices, real_numbers
from truepose.errors import ArgumentError, Problem, RequestError
from truepose.language import grouped, marked, say
from truepose.machine import Condition, Machine
from truepose.machine.workspace import PoseTable
from truepose.sources import PoseBlock, Source, acting

BLOCK = 8192
"""Poses in a block."""

EXPLAINED = 200
"""Poses that are looked into when none can be used, evenly spaced over all of them."""

STILL = 1e-12
"""Step of a joint, in its travel, that is rounding and no motion."""

Progress = Callable[[int, int], None]
"""Called with (poses done, poses in all), between blocks."""

OK = STATUS.index("ok")
NOT_CONVERGED = STATUS.index("not_converged")

BAND = "band"
"""Why a pose is left out at which some machines inside the bands cannot be assembled."""

CORRECTION = "correction_"
"""Begins why a pose is left out whose corrected command the machine cannot follow."""

REASONS = (*STATUS, BAND, *(f"{CORRECTION}{name}" for name in STATUS))
"""Why a pose may be left out: a kernel status, or what a command found that looked further."""


def requested_table(machine: Machine, poses: ArrayLike | None) -> PoseTable:
    """As `requested_poses`, of a grid each pose made where it is looked at."""
    return machine.pose_table() if poses is None else requested_poses(machine, poses)


def requested_poses(machine: Machine, poses: ArrayLike | None) -> Floats:
    """(n, n_commanded) poses of a run, SI: those given, in any leading shape, or the file's.

    Raises `RequestError` (bad-poses, no-workspace).
    """
    if poses is None:
        return machine.poses()
    count = len(machine.commanded)
    try:
        given = real_numbers("poses", poses)
    except ArgumentError:
        raise _bad_poses(machine, "something that is not an array of numbers") from None
    if given.ndim == 0 or given.shape[-1] != count:
        raise _bad_poses(machine, f"shape {given.shape}")
    table = np.ascontiguousarray(given.reshape(-1, count))
    if len(table) == 0:
        raise _bad_poses(machine, "no pose")
    unfit = np.flatnonzero(~np.isfinite(table).all(axis=1))
    if unfit.size:
        raise _bad_poses(machine, f"{unfit.size} poses with a value not finite, first {unfit[0]}")
    return table


def is_path(machine: Machine) -> bool:
    """Whether the file's poses are passed through in their order."""
    return machine.workspace is not None and machine.workspace.is_path


def _bad_poses(machine: Machine, found: str) -> RequestError:
    expected = f"(..., {len(machine.commanded)}) numbers: {', '.join(machine.commanded)} in m, rad"
    return RequestError(
        Problem("bad-poses", "these are no poses of the machine", found=found, expected=expected)
    )


def required_sources(machine: Machine, condition: Condition) -> tuple[Source, ...]:
    """The sources that act, at least one. Raises `RequestError` (no-source)."""
    sources = acting(machine, condition)
    if sources:
        return sources
    raise RequestError(
        Problem(
            code="no-source",
            message="nothing moves the machine off its nominal parameters",
            file=machine.file,
            found="no error source in the machine file or the condition",
            expected="an error source, such as a tolerance, a temperature or a force",
            hint="give a strut length_tolerance, or [condition] temperature or force; "
            "docs/sources lists all sources",
        )
    )


@dataclass
class SkippedPoses:
    """Poses that cannot be used: their numbers in the poses asked for, and why (`REASONS`)."""

    indices: list[Indices] = field(default_factory=list)
    status: list[np.ndarray] = field(default_factory=list)

    def add(self, indices: Indices, status: np.ndarray) -> None:
        """Set aside the poses numbered `indices` (m,), for the reasons numbered `status` (m,)."""
        if indices.size:
            self.indices.append(indices)
            self.status.append(status)

    def counts(self) -> Counter[str]:
        """How many poses each reason leaves out."""
        return Counter(self.sorted()[1].tolist())

    def sorted(self) -> tuple[Indices, np.ndarray]:
        """Numbers, ascending, and names of the status, both (n_left_out,)."""
        if not self.indices:
            return np.empty(0, np.intp), np.empty(0, dtype="<U16")
        indices = np.concatenate(self.indices)
        names = np.array(REASONS)[np.concatenate(self.status)]
        order = np.argsort(indices)
        return indices[order], names[order]


def _keep_freed_memory() -> None:
    """Let the arrays of one block be made of those of the block before.

    glibc hands freed memory back to the system beyond twice the largest array freed so far (its
    dynamic thresholds, mallopt(3)), and every block would fetch its pages anew: up to a third of
    the time of a budget. One array of the most that it looks at, freed at once, stops that.
    """
    np.empty(31 << 20, np.uint8)


class PoseRun:
    """Iterates over blocks of usable poses; keeps account of those left out.

    A pose is usable when the inverse finds it within travel and the closures are not singular
    there; whoever works on a block may set further poses of it aside with `keep`.
    """

    def __init__(
        self,
        machine: Machine,
        poses: PoseTable,
        condition: Condition,
        progress: Progress | None = None,
        *,
        path: bool = False,
        times: Floats | None = None,
    ) -> None:
        """`path`: the poses are passed through in their order. `times` (n_pose,): s, of each."""
        machine.check_condition(condition)
        self.machine = machine
        self.poses = poses
        self.left_out = SkippedPoses()
        self.condition = condition
        self._progress = progress
        self._times = times
        self._travel = Travel(machine) if path else None

    def __iter__(self) -> Iterator[PoseBlock]:
        return self.between(0, len(self.poses))

    def between(self, start: int, stop: int) -> Iterator[PoseBlock]:
        """The blocks of the poses from number `start`, a block's first, to before `stop`."""
        _keep_freed_memory()
        for first in range(start, stop, BLOCK):
            last = min(first + BLOCK, stop)
            block = self._block(first, self.poses[first:last])
            if block.indices.size:
                yield block
            if self._progress is not None:
                self._progress(last, len(self.poses))

    def arrive(self, travel: Travel | None) -> None:
        """Go on along a path from where another run left off."""
        self._travel = deepcopy(travel)

    def arrivals(self, starts: Iterable[int]) -> Iterator[Travel | None]:
        """How a path comes to each of the poses numbered `starts`, ascending; None of no path."""
        travel, before = deepcopy(self._travel), 0
        for start in starts:
            if travel is not None:
                for first in range(before, start, BLOCK):
                    poses = self.poses[first : min(first + BLOCK, start)]
                    travel.into(self.machine.kernel.place(poses)[0])
            before = start
            yield deepcopy(travel)

    def _block(self, start: int, poses: Floats) -> PoseBlock:
        joints, placements, status = self.machine.kernel.place(poses)
        indices = np.arange(start, start + len(poses), dtype=np.intp)
        block = PoseBlock(
            self.machine,
            self.condition,
            self.poses,
            indices,
            joints,
            placements,
            None if self._travel is None else self._travel.into(joints),
            None if self._times is None else self._times[start : start + len(poses)],
        )
        block = block.select(self.keep(indices, status))
        if not block.indices.size:
            return block
        _, status = block.balance
        return block.select(self.keep(block.indices, status))

    def keep(self, indices: Indices, *statuses: np.ndarray) -> Flags:
        """(n,) whether every status of a pose is ok; the first that is not says why it is out.

        `statuses` are kernel codes, or numbers of other `REASONS`.
        """
        usable = np.ones(indices.size, np.bool_)
        for status in statuses:
            failed = usable & (status != OK)
            self.left_out.add(indices[failed], status[failed])
            usable &= ~failed
        return usable


def finite_or(status: np.ndarray, *values: Floats) -> np.ndarray:
    """(n,) kernel codes: `status`, and not converged where a row of `values` (n, k) has no number.

    The last look at what goes on into results: no infinity reaches one with a status that is ok.
    """
    codes = status
    for rows in values:
        with np.errstate(over="ignore", invalid="ignore"):
            finite = np.isfinite(rows @ np.ones(rows.shape[1]))
        codes = np.where((codes == OK) & ~finite, NOT_CONVERGED, codes).astype(np.uint8)
    return codes


def of_band(status: np.ndarray) -> np.ndarray:
    """(n,) reasons for kernel codes (n,) of machines inside the bands: ok ones stay so."""
    return reason_unless(status == OK, BAND)


def reason_unless(fine: Flags, reason: str) -> np.ndarray:
    """(n,) numbers of reasons: ok where `fine` (n,), else the one of that name."""
    return np.where(fine, OK, REASONS.index(reason)).astype(np.uint8)


def of_correction(status: np.ndarray) -> np.ndarray:
    """(n,) reasons for kernel codes (n,) of corrected commands: ok ones stay so."""
    first = REASONS.index(f"{CORRECTION}ok")
    return np.where(status == OK, OK, first + status.astype(np.uint8)).astype(np.uint8)


def broken(status: np.ndarray) -> Flags:
    """(n,) whether a pose left out for the reason named `status` (n,) belongs to the run.

    There no accuracy is kept: the machine that drawing and shifts describe goes there, but not all
    inside the bands do, or the corrected command leads nowhere.
    """
    names = np.asarray(status, np.str_)
    return np.asarray(~np.isin(names, STATUS), np.bool_)


def reason_text(status: str) -> str:
    """Why a pose is left out, for people."""
    if status == BAND:
        return say("some machines inside the bands cannot be assembled")
    if status.startswith(CORRECTION):
        return say("correction {status}", status=reason_text(status.removeprefix(CORRECTION)))
    words = {
        "out_of_travel": say("out of travel"),
        "unreachable": say("unreachable"),
        "singular": say("singular"),
        "not_converged": say("not converged"),
        "branch_lost": say("branch lost"),
        "joint_limit": say("joint limit"),
    }
    return words.get(status) or status.replace("_", " ")


def not_assembled_text(failed: int, every: int) -> str:
    """How many samples the machine could not follow: "12 of 10,000 could not be assembled"."""
    return say(
        "{failed} of {every} could not be assembled",
        failed=grouped(failed),
        every=grouped(every),
    )


class Travel:
    """Direction in which each joint of a machine last moved, along a path."""

    def __init__(self, machine: Machine) -> None:
        spans = [drive.travel[1] - drive.travel[0] for drive in machine.drives]
        self._still = STILL * np.array(spans)
        self._at = np.full((1, len(spans)), np.nan)
        self._direction = np.zeros((1, len(spans)))

    def into(self, joints: Floats) -> Floats:
        """(n, n_joint) of -1, 0 (not moved yet) and +1 into the next poses, of `joints` there.

        A joint that stands keeps its direction, as the flank on which it lies stays; a pose
        without joints (NaN) is passed over.
        """
        at = _carried_on(np.concatenate([self._at, joints]), np.isfinite)
        steps = np.diff(at, axis=0)
        moved = np.where(np.abs(steps) > self._still, np.sign(steps), 0.0)  # NaN: no step yet
        direction = _carried_on(np.concatenate([self._direction, moved]), np.abs)
        self._at, self._direction = at[-1:], direction[-1:]
        return direction[1:]


def _carried_on(rows: Floats, counts: Callable[[Floats], np.ndarray]) -> Floats:
    """(n, k) each value that does not count replaced by the last one above it that does."""
    own = np.where(counts(rows), np.arange(len(rows))[:, np.newaxis], 0)
    carried: Floats = np.take_along_axis(rows, np.maximum.accumulate(own, axis=0), axis=0)
    return carried


def no_pose_left(
    machine: Machine, poses: PoseTable, left_out: Mapping[str, int], *, of_file: bool
) -> RequestError:
    """The error where no pose can be used: what fails, by how much, where it fails least.

    `left_out`: how many poses for each reason. `of_file`: the poses are those of the machine file.
    """
    names = sorted(left_out)
    reasons = ", ".join(
        f"{left_out[name]} {'where ' if name == BAND else ''}{reason_text(name)}" for name in names
    )
    looked_at = np.unique(np.linspace(0, len(poses) - 1, EXPLAINED).astype(np.intp))
    nearest: tuple[float, str] | None = None
    for pose in poses[looked_at]:
        faults = machine.kernel.explain(pose)
        if not faults:
            continue
        excess = max(abs(float(fault["amount"])) for fault in faults)
        if nearest is None or excess < nearest[0]:
            where = pose_in_words(machine, pose)
            nearest = (excess, f"nearest at {where}: {faults_text(machine, faults)}")
    return RequestError(
        Problem(
            code="no-pose-left",
            message=f"none of the {len(poses)} poses can be used"
            if len(poses) > 1
            else "the only pose cannot be used",
            file=machine.file,
            line=machine.workspace.line if of_file and machine.workspace else None,
            path="workspace" if of_file else None,
            found=reasons + (f"; {nearest[1]}" if nearest else ""),
            expected="poses that the machine can reach, within travel and off singularities",
            hint="move the workspace, or check lengths, travel and working_mode"
            if nearest
            else "narrow the bands of the tolerances, or keep away from singularities and the end "
            "of the reach"
            if set(names) <= {BAND}
            else "the nominal machine reaches them, but not as the error sources move it: look for "
            "a number of the wrong size or unit, or leave more travel for the correction",
        )
    )


def pose_in_words(machine: Machine, pose: Iterable[float]) -> str:
    """A commanded pose (n_commanded,), m and rad, in the file's units: "x = 200 mm, y = 100 mm"."""
    return ", ".join(
        f"{name} = {_in_file_units(machine, value, _dimension_of(name))}"
        for name, value in zip(machine.commanded, pose, strict=True)
    )


def faults_text(machine: Machine, faults: Iterable[dict[str, object]]) -> str:
    """What the kernel's `explain` says of a pose, for people: which part, by how much."""
    return "; ".join(_fault(machine, fault) for fault in faults)


def _fault(machine: Machine, fault: dict[str, object]) -> str:
    what, name, amount = fault["what"], fault["name"], fault["amount"]
    assert isinstance(amount, float | int)
    if what == "singular":
        return say("singular, {share} of the limit", share=marked(f"{amount:.3g}"))
    if what == "travel":
        coordinate = next((d.coordinate for d in machine.drives if d.name == name), "length")
        return say(
            "drive {name} is {amount} out of travel",
            name=name,
            amount=_in_file_units(machine, abs(amount), coordinate),
        )
    if what in ("base_joint", "platform_joint"):
        angle = _in_file_units(machine, amount, "angle")
        if what == "base_joint":
            return say(
                "strut {name} leans {angle} beyond the limit of its base joint",
                name=name,
                angle=angle,
            )
        return say(
            "strut {name} leans {angle} beyond the limit of its platform joint",
            name=name,
            angle=angle,
        )
    return say(
        "strut {name} misses by {length}",
        name=name,
        length=_in_file_units(machine, abs(amount), "length"),
    )


def _dimension_of(freedom: str) -> str:
    return "length" if freedom in ("x", "y", "z") else "angle"


def _in_file_units(machine: Machine, value: float, dimension: str) -> str:
    unit = machine.file_units.get(dimension)
    if unit is None:
        return marked(f"{value:.6g} {'m' if dimension == 'length' else 'rad'}")
    return marked(f"{float(unit.to_file(np.float64(value))):.6g} {unit.label}")
