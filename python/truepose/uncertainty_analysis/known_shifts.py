"""How what is known of a machine follows from the pose, where it does by a law of few numbers.

A source's shift follows from the pose by whatever it computes, batch by batch. A controller and a
page have room for these laws:

* a shift that is the same at every pose;
* a shift per kelvin of one part, constant or affine in the length of the strut it lengthens;
* deflection under the wrench on the tool: compliance, constant or affine in a strut's length,
  times load, which the closures give.

They are found by asking the sources, never written a second time; a source that does otherwise is
refused by name.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from truepose.arrays import Floats, Indices
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


class NoLawError(Exception):
    """A source follows none of the laws; the text says what it does instead."""


@dataclass(frozen=True)
class Term:
    """`constant + slope * length of strut` of one parameter, SI; a strut of None: no slope."""

    parameter: int
    constant: float
    slope: float = 0.0
    strut: int | None = None


@dataclass(frozen=True)
class SourceLaw:
    """What one source is known to do: shifts at the reference, and per kelvin of each part.

    `yields`: it is what gives way under the wrench on the tool, by `compliance_laws`, and has no
    shift of its own.
    """

    name: str
    at_reference: tuple[Term, ...]
    per_kelvin: dict[str, tuple[Term, ...]]
    yields: bool


def at_reference(machine: Machine) -> Condition:
    """The machine's condition with every part at the reference temperature and no wrench."""
    reference = machine.condition.reference_temperature
    return machine.condition.replace(temperature=reference, force=(0, 0, 0), moment=(0, 0, 0))


def probed_poses(machine: Machine) -> PoseBlock | None:
    """Usable poses of the workspace and scattered about it, so that no law is one of a grid only.

    In the condition `at_reference`; None where none is usable. Raises `RequestError`
    (no-workspace).
    """
    poses = machine.poses()
    chosen = poses[np.unique(np.linspace(0, len(poses) - 1, POSES).astype(int))]
    length = machine.characteristic_length
    margin = MARGIN * np.array([length if name in "xyz" else 1.0 for name in machine.commanded])
    low, high = poses.min(axis=0) - margin, poses.max(axis=0) + margin
    random = np.random.default_rng(0)
    scattered = low + (high - low) * random.random((SCATTERED, len(low)))
    run = PoseRun(machine, np.concatenate([chosen, scattered]), at_reference(machine))
    return next(iter(run), None)


def source_law(source: Source, block: PoseBlock) -> SourceLaw:
    """The laws that the source follows at the poses of `probed_poses`. Raises `NoLawError`."""
    if getattr(source, "yields_under", None) == "tool":
        return SourceLaw(source.name, (), {}, True)
    cold_shift = _shift(source, block, block.condition)
    _require_no_wrench(source, block, cold_shift)
    parts = expanding(block.machine)
    law = SourceLaw(
        source.name,
        tuple(terms(block, *cold_shift)),
        {part: tuple(_per_kelvin(source, block, cold_shift, part)) for part in parts},
        False,
    )
    require_law(source, law, block, warmed(block, [LARGE * (1 + k) for k in range(len(parts))]))
    return law


def warmed(block: PoseBlock, rises: Sequence[float]) -> Condition:
    """The block's condition with each part of `expanding` (in order) by its own rise, K, warmer."""
    cold = block.condition
    parts = zip(expanding(block.machine), rises, strict=True)
    return cold.replace(
        temperature={part: cold.reference_temperature + rise for part, rise in parts}
    )


def require_law(source: Source, law: SourceLaw, block: PoseBlock, condition: Condition) -> None:
    """Hold the law of a source that does not yield against the source in `condition`, no wrench.

    Parts that are warm together must add; and a temperature may count that no law knows, that of a
    part that does not expand. Raises `NoLawError`, or what the source raises in that condition.
    """
    if law.yields:
        return
    added = [_evaluated(block, law.at_reference)]
    for part, per_kelvin in law.per_kelvin.items():
        columns, values = _evaluated(block, per_kelvin)
        added.append((columns, values * condition.temperature_rise(part)))
    columns, off = _less(_shift(source, block, condition), sum_deviations(added))
    # Parts may cancel each other: each is as exact as its own size.
    sizes = [(of, np.abs(values).max(axis=0, keepdims=True)) for of, values in added]
    known, size = sum_deviations(sizes)
    allowed = np.zeros(columns.size)
    allowed[np.searchsorted(columns, known)] = PROPORTION * size[0]
    if (np.abs(off).max(axis=0) > allowed).any():
        raise NoLawError("follows from temperatures in another way than part by part")


def _evaluated(block: PoseBlock, terms: Sequence[Term]) -> ParameterDeviation:
    """What terms say at the poses of the block: parameters (k,), values (n, k)."""
    values = np.empty((len(block.lengths), len(terms)))
    for at, term in enumerate(terms):
        slope = 0.0 if term.strut is None else term.slope * block.lengths[:, term.strut]
        values[:, at] = term.constant + slope
    return np.array([term.parameter for term in terms], np.intp), values


def expanding(machine: Machine) -> tuple[str, ...]:
    """Parts that grow with their temperature."""
    bodies = (*machine.carriages, machine.frame, machine.platform, machine.tool)
    parts: tuple[Strut | Drive | Body, ...] = (*machine.struts, *machine.drives, *bodies)
    return tuple(part.part for part in parts if part.expansion)


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
        raise NoLawError("is not in proportion to the temperature")
    return terms(block, columns, large / LARGE)


def compliance_laws(
    block: PoseBlock,
) -> tuple[tuple[Term, ...], tuple[tuple[int, int, float], ...]]:
    """Everything that gives way but limbs; nothing where nobody says how stiff it is."""
    machine = block.machine
    if lacking(machine.drives, machine.struts, machine.limbs, ""):
        return (), ()
    given = without_limbs(machine, block.lengths)
    shared = [] if given.shared is None else given.shared[0].tolist()
    columns = given.columns.tolist()
    return tuple(terms(block, given.columns, given.own)), tuple(
        (columns[one], columns[other], value)
        for (one, other), value in zip(given.pairs, shared, strict=True)
    )


def terms(block: PoseBlock, columns: Indices, values: Floats) -> Iterator[Term]:
    """Laws of `values` (n or 1, k) of parameters `columns` (k,), of those that are not zero.

    Raises `NoLawError`.
    """
    of_strut = {int(c): k for k, c in enumerate(block.machine.kernel.length_parameters)}
    for at, column in enumerate(columns.tolist()):
        strut = of_strut.get(column)
        lengths = np.zeros(len(values)) if strut is None else block.lengths[:, strut]
        law = law_of_length(values[:, at], lengths)
        if law is None:
            raise NoLawError("follows from the pose")
        constant, slope, _ = law
        if constant or slope:
            yield Term(column, constant, slope, strut if slope else None)


def _require_no_wrench(source: Source, block: PoseBlock, unloaded: ParameterDeviation) -> None:
    """Raise `NoLawError` for a source that shifts otherwise under a load, as play does."""
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
                raise NoLawError("follows from the wrench")


__all__ = [
    "NoLawError",
    "SourceLaw",
    "Term",
    "at_reference",
    "compliance_laws",
    "expanding",
    "probed_poses",
    "require_law",
    "source_law",
    "terms",
    "warmed",
]
