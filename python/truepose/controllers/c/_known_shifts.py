"""What is known of a machine, as far as it can be computed in a controller.

By the laws of `truepose.uncertainty_analysis.known_shifts`: a source that follows none of them is
refused, with the way to leave it out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

from truepose.controllers._export import unsupported_machine
from truepose.errors import Problem, RequestError
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Machine
from truepose.sources import PoseBlock, Source
from truepose.uncertainty_analysis.known_shifts import (
    FEWEST,
    NoLawError,
    SourceLaw,
    Term,
    compliance_laws,
    probed_poses,
    source_law,
)


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
    block = _probed(machine)
    laws: list[SourceLaw] = []
    refused: dict[str, str] = {}
    for source in sources:
        if source.name not in without:
            try:
                laws.append(source_law(source, block))
            except NoLawError as failure:
                refused[source.name] = str(failure)
    if refused:
        raise RequestError(*_refusals(machine, refused, without))
    per_kelvin: dict[str, tuple[Term, ...]] = {}
    for law in laws:
        for part, added in law.per_kelvin.items():
            per_kelvin[part] = (*per_kelvin.get(part, ()), *added)
    yields = any(law.yields for law in laws)
    compliance, shared = compliance_laws(block) if yields else ((), ())
    return KnownShifts(
        tuple(term for law in laws for term in law.at_reference),
        per_kelvin,
        compliance,
        shared,
        yields and bool(machine.limbs),
        tuple(source.name for source in sources if source.name in without),
    )


def _probed(machine: Machine) -> PoseBlock:
    """Raises `RequestError`: controller-cannot for too few usable poses, no-workspace."""
    block = probed_poses(machine)
    if block is None or block.indices.size < FEWEST:
        raise unsupported_machine(
            "a controller",
            machine,
            f"{0 if block is None else block.indices.size} usable poses about the workspace",
            f"at least {FEWEST}, from which to find how the sources follow from the pose",
            "truepose check says why poses cannot be used",
        )
    return block


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


__all__ = ["KnownShifts", "known_shifts"]
