"""What is known of a machine, as far as it can be computed in a controller.

A source's shift follows from the pose by laws that the library evaluates, batch by batch. In a
controller there is room for these:

* a shift that is the same at every pose;
* a shift per kelvin of one part, constant or affine in the length of the strut it lengthens;
* deflection under the wrench on the tool: compliance, constant or affine in a strut's length,
  times load, which C works out from the closures.

They are found by asking the sources, never written a second time, and found wrong they are refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.controllers._export import unsupported_machine
from truepose.errors import Problem, RequestError
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Condition, Machine
from truepose.machine.compliances import without_limbs
from truepose.machine.parts import Body, Drive, Strut
from truepose.runs.displacement import ParameterDeviation, sum_deviations
from truepose.runs.poses import PoseRun
from truepose.sources import PoseBlock, Source
from truepose.sources._stiffness import lacking
from truepose.uncertainty_analysis.length_law import law_of_length

POSES, SCATTERED = 150, 150
"""Poses of the workspace, and about it, at which the sources are asked."""

FEWEST = 20
"""Usable poses from which a law is believed."""

MARGIN = 0.05
"""By how much the poses about the workspace go beyond it, in characteristic lengths or rad."""

PROBING = (50.0, 2000.0)
"""N at which a source is asked whether it follows from the wrench; moments by the size."""

SMALL, LARGE = 1.0, 20.0
"""K: rises at which a shift is looked at; it has to be in proportion."""

PROPORTION = 1e-9
"""Of the largest shift of a parameter: by which it may be out of proportion."""


@dataclass(frozen=True)
class Term:
    """`constant + slope * length of strut` of one parameter, SI; a strut of None: no slope."""

    parameter: int
    constant: float
    slope: float = 0.0
    strut: int | None = None


@dataclass(frozen=True)
class KnownShifts:
    """Shifts at the reference, per kelvin of each part, and compliances, term by term.

    `shared`: of two parameters that give way under each other's load. `limbs`: whether limbs give
    way, which the kernel prints. `left_out`: sources that the machine has, and that were asked to
    be left out.
    """

    at_reference: tuple[Term, ...]
    per_kelvin: dict[str, tuple[Term, ...]]
    compliance: tuple[Term, ...]
    shared: tuple[tuple[int, int, float], ...]
    limbs: bool
    left_out: tuple[str, ...]


def known_shifts(machine: Machine, without: Sequence[str] = ()) -> KnownShifts:
    """What is known of `machine` in its condition, but for its temperatures and the wrench.

    `without`: sources, by name, to leave out. Raises `RequestError`: controller-cannot where a
    source follows no law that a controller can compute, or too few poses are usable to find one,
    bad-option for a source in `without` that the machine does not have, no-workspace.
    """
    sources = cast("tuple[Source, ...]", machine.sources)
    _check_names(sources, without)
    reference = machine.condition.reference_temperature
    cold = machine.condition.replace(temperature=reference, force=(0, 0, 0), moment=(0, 0, 0))
    block = _probe(machine, cold)
    asked = [source for source in sources if source.name not in without]
    shifting = [source for source in asked if not _yields(source)]
    parts = tuple(_expanding(machine))
    at_reference: list[Term] = []
    per_kelvin: dict[str, list[Term]] = {part: [] for part in parts}
    refused: dict[str, str] = {}
    for source in shifting:
        try:
            cold_shift = _shift(source, block, cold)
            _require_no_wrench(source, block, cold_shift)
            at_reference += _terms(block, *cold_shift)
            for part in parts:
                per_kelvin[part] += _per_kelvin(source, block, cold_shift, part)
        except _NoLawError as failure:
            refused[source.name] = str(failure)
    if refused:
        raise RequestError(*_refusals(machine, refused, without))
    yields = len(asked) > len(shifting)
    compliance, shared = _compliance(block) if yields else ((), ())
    return KnownShifts(
        tuple(at_reference),
        {part: tuple(terms) for part, terms in per_kelvin.items()},
        compliance,
        shared,
        yields and bool(machine.limbs),
        tuple(source.name for source in sources if source.name in without),
    )


class _NoLawError(Exception):
    """A source follows no law that a controller computes; the text says what it does instead."""


def _yields(source: Source) -> bool:
    """Whether the source is deflection under the wrench on the tool."""
    return getattr(source, "over_region", None) == "wrench"


def _check_names(sources: Sequence[Source], without: Sequence[str]) -> None:
    names = [source.name for source in sources]
    problems = [
        Problem(
            "bad-option",
            f"without: the machine has no source {name!r}",
            found=repr(name),
            expected=one_of(names),
            hint=did_you_mean(name, names),
        )
        for name in without
        if name not in names
    ]
    if problems:
        raise RequestError(*problems)


def _probe(machine: Machine, condition: Condition) -> PoseBlock:
    """Usable poses of the workspace and scattered about it, so that no law is one of a grid only.

    Raises `RequestError`: controller-cannot for too few of them, no-workspace.
    """
    poses = machine.poses()
    chosen = poses[np.unique(np.linspace(0, len(poses) - 1, POSES).astype(int))]
    length = machine.characteristic_length
    margin = MARGIN * np.array([length if name in "xyz" else 1.0 for name in machine.commanded])
    low, high = poses.min(axis=0) - margin, poses.max(axis=0) + margin
    random = np.random.default_rng(0)
    scattered = low + (high - low) * random.random((SCATTERED, len(low)))
    blocks: list[PoseBlock] = list(PoseRun(machine, np.concatenate([chosen, scattered]), condition))
    if not blocks or blocks[0].indices.size < FEWEST:
        raise unsupported_machine(
            "a controller",
            machine,
            f"{blocks[0].indices.size if blocks else 0} usable poses about the workspace",
            f"at least {FEWEST}, from which to find how the sources follow from the pose",
            "truepose check says why poses cannot be used",
        )
    return blocks[0]


def _expanding(machine: Machine) -> Iterator[str]:
    """Parts that grow with their temperature."""
    bodies = (*machine.carriages, machine.frame, machine.platform, machine.tool)
    parts: tuple[Strut | Drive | Body, ...] = (*machine.struts, *machine.drives, *bodies)
    return (part.part for part in parts if part.expansion)


def _shift(source: Source, block: PoseBlock, condition: Condition) -> ParameterDeviation:
    """The shift of every parameter that the source touches, at the poses of the block."""
    if not source.acts(condition):
        return sum_deviations([])
    deviation = source.deviation(block.machine, condition, replace(block, condition=condition))
    return sum_deviations([(deviation.parameters, deviation.shift)])


def _less(moved: ParameterDeviation, other: ParameterDeviation) -> ParameterDeviation:
    """What is moved more than by `other`."""
    return sum_deviations([moved, (other[0], -other[1])])


def _per_kelvin(
    source: Source, block: PoseBlock, cold_shift: ParameterDeviation, part: str
) -> Iterator[Term]:
    """What one kelvin of a part adds, which has to be in proportion to the rise."""
    cold = block.condition

    def added(rise: float) -> ParameterDeviation:
        warm = cold.replace(temperature={part: cold.reference_temperature + rise})
        return _less(_shift(source, block, warm), cold_shift)

    columns, large = added(LARGE)
    every, off = _less((columns, large * (SMALL / LARGE)), added(SMALL))
    allowed = np.zeros(every.size)
    allowed[np.searchsorted(every, columns)] = PROPORTION * np.abs(large).max(axis=0)
    if (np.abs(off).max(axis=0) > allowed).any():
        raise _NoLawError("is not in proportion to the temperature")
    return _terms(block, columns, large / LARGE)


def _compliance(
    block: PoseBlock,
) -> tuple[tuple[Term, ...], tuple[tuple[int, int, float], ...]]:
    """Everything that gives way but limbs; nothing where nobody says how stiff it is."""
    machine = block.machine
    if lacking(machine.drives, machine.struts, machine.limbs, ""):
        return (), ()
    given = without_limbs(machine, block.lengths)
    shared = [] if given.shared is None else given.shared[0].tolist()
    columns = given.columns.tolist()
    return tuple(_terms(block, given.columns, given.own)), tuple(
        (columns[one], columns[other], value)
        for (one, other), value in zip(given.pairs, shared, strict=True)
    )


def _terms(block: PoseBlock, columns: Indices, values: Floats) -> Iterator[Term]:
    of_strut = {int(c): k for k, c in enumerate(block.machine.kernel.length_parameters)}
    for at, column in enumerate(columns.tolist()):
        strut = of_strut.get(column)
        lengths = np.zeros(len(values)) if strut is None else block.lengths[:, strut]
        law = law_of_length(values[:, at], lengths)
        if law is None:
            raise _NoLawError("follows from the pose")
        constant, slope, _ = law
        if constant or slope:
            yield Term(column, constant, slope, strut if slope else None)


def _require_no_wrench(source: Source, block: PoseBlock, unloaded: ParameterDeviation) -> None:
    """Raise `_NoLawError` for a source that shifts otherwise under a load, as play does."""
    size = block.machine.characteristic_length
    for component in block.machine.components:
        direction = np.eye(3)["xyz".index(component[-1])]
        for load in (sign * newtons for newtons in PROBING for sign in (1.0, -1.0)):
            loaded = (
                block.condition.replace(force=(load * direction).tolist())
                if len(component) == 1
                else block.condition.replace(moment=(load * size * direction).tolist())
            )
            if _less(_shift(source, block, loaded), unloaded)[1].any():
                raise _NoLawError("follows from the wrench")


def _refusals(machine: Machine, refused: dict[str, str], without: Sequence[str]) -> list[Problem]:
    """One problem a source, each with the one way to leave all of them out."""
    every = ",".join((*without, *refused))
    problems: list[Problem] = []
    for name, why in refused.items():
        problems += unsupported_machine(
            "a controller",
            machine,
            f"the source {name} {why}",
            "shifts that are constant, or affine in the length of the strut that they lengthen",
            f"leave it out, which the file then says: --option without={every}; or correct "
            "programs, which takes every source: truepose gcode",
        ).problems
    return problems


__all__ = ["KnownShifts", "Term", "known_shifts"]
