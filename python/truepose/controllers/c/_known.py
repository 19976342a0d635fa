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

from truepose.budget.exact import Moved, together
from truepose.budget.length_law import law_of_length
from truepose.budget.poses import Walk, no_pose_left
from truepose.controllers._export import cannot
from truepose.errors import Problem, RequestError
from truepose.machine import Condition, Machine
from truepose.machine.parts_of_machine import Body, Drive, Strut
from truepose.machine.suggestion import did_you_mean, one_of
from truepose.sources import Block, Source, acting
from truepose.sources._base import Floats, Indices
from truepose.sources._stiffness import lacking

POSES = 200
"""Poses of the workspace at which the sources are asked."""

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
class Known:
    """Shifts at the reference, per kelvin of each part, and compliances, term by term.

    `left_out`: sources that act and are not in it.
    """

    at_reference: tuple[Term, ...]
    per_kelvin: dict[str, tuple[Term, ...]]
    compliance: tuple[Term, ...]
    left_out: tuple[str, ...]


def known_of(machine: Machine, without: Sequence[str] = ()) -> Known:
    """What is known of `machine` in its condition, but for its temperatures and the wrench.

    `without`: sources, by name, to leave out. Raises `RequestError`: controller-cannot where a
    source follows from the pose in a way that a controller cannot compute, bad-option for a source
    in `without` that the machine does not have, no-workspace, no-pose-left.
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
    problems: list[Problem] = []
    for source in shifting:
        try:
            at_reference += _at_reference(source, block)
            for part in parts:
                per_kelvin[part] += _per_kelvin(source, block, part)
        except RequestError as refusal:
            problems += refusal.problems
    if problems:
        raise RequestError(*problems)
    return Known(
        tuple(at_reference),
        {part: tuple(terms) for part, terms in per_kelvin.items()},
        _compliance(block) if len(asked) > len(shifting) else (),
        tuple(s.name for s in acting(machine) if s.name in without),
    )


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


def _probe(machine: Machine, condition: Condition) -> Block:
    """Some usable poses, over the whole workspace."""
    poses = machine.poses()
    table = poses[np.unique(np.linspace(0, len(poses) - 1, POSES).astype(int))]
    walk = Walk(machine, table, condition)
    for block in walk:
        return block
    raise no_pose_left(machine, table, walk.left_out, of_file=True)


def _expanding(machine: Machine) -> Iterator[str]:
    """Parts that grow with their temperature."""
    bodies = (machine.frame, machine.platform, machine.tool)
    parts: tuple[Strut | Drive | Body, ...] = (*machine.struts, *machine.drives, *bodies)
    return (part.part for part in parts if part.expansion)


def _shift(source: Source, block: Block, condition: Condition) -> Moved:
    """The shift of every parameter that the source touches, at the poses of the block."""
    if not source.acts(condition):
        return together([])
    deviation = source.deviation(block.machine, condition, replace(block, condition=condition))
    return together([(deviation.parameters, deviation.shift)])


def _at_reference(source: Source, block: Block) -> Iterator[Term]:
    columns, values = _shift(source, block, block.condition)
    return _terms(source.name, block, columns, values)


def _per_kelvin(source: Source, block: Block, part: str) -> Iterator[Term]:
    """What one kelvin of a part adds, which has to be in proportion to the rise."""
    cold = block.condition

    def at(rise: float) -> Moved:
        warm = cold.replace(temperature={part: cold.reference_temperature + rise})
        columns, values = _shift(source, block, cold)
        return together([_shift(source, block, warm), (columns, -values)])

    columns, large = at(LARGE)
    small = dict(zip(*[list(each) for each in _by_column(at(SMALL))], strict=True))
    for column, values in zip(*_by_column((columns, large)), strict=True):
        off = np.abs(values * (SMALL / LARGE) - small.get(column, 0.0)).max()
        if off > PROPORTION * np.abs(values).max():
            raise _cannot(block.machine, source.name, "is not in proportion to the temperature")
    return _terms(source.name, block, columns, large / LARGE)


def _by_column(moved: Moved) -> tuple[list[int], list[Floats]]:
    return moved[0].tolist(), list(moved[1].T)


def _compliance(block: Block) -> tuple[Term, ...]:
    """Everything that gives way; nothing where the machine does not say how stiff it is."""
    machine = block.machine
    if lacking(machine.drives, machine.struts, ""):
        return ()
    columns, values = machine.compliances(block.lengths)
    return tuple(_terms("elastic", block, columns, values))


def _terms(name: str, block: Block, columns: Indices, values: Floats) -> Iterator[Term]:
    of_strut = {int(c): k for k, c in enumerate(block.machine.kernel.length_parameters)}
    for at, column in enumerate(columns.tolist()):
        strut = of_strut.get(column)
        lengths = np.zeros(len(values)) if strut is None else block.lengths[:, strut]
        law = law_of_length(values[:, at], lengths)
        if law is None:
            raise _cannot(block.machine, name, "follows from the pose")
        constant, slope, _ = law
        if constant or slope:
            yield Term(column, constant, slope, strut if slope else None)


def _cannot(machine: Machine, name: str, why: str) -> RequestError:
    return cannot(
        "C",
        machine,
        f"the source {name} {why}",
        "shifts that are constant, or affine in the length of the strut that they lengthen",
        f"leave it out, which the file then says: --option without={name}; or correct programs, "
        "which takes every source: truepose gcode",
    )


__all__ = ["Known", "Term", "known_of"]
