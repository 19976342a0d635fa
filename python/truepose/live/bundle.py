"""The bundle of a machine: all that the kernel needs, in a page, to evaluate it anew.

The kernel's description, what the sources are known to do as laws, the variables that they leave
unknown, and what sliders and labels take: ranges, targets, units. A source that follows no law is
not left out silently: it is named, with why, and with its largest error over the file's poses in
the file's condition, which is worked out here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Problem, RequestError
from truepose.files.shown_units import ICE_POINT, Shown, shown_units
from truepose.live.laws import LiveLaw, live_law, weight
from truepose.live.unknown import correlated_student, unknown, yields_unsaid
from truepose.machine import Machine
from truepose.runs.controller_geometry import require_known_controller
from truepose.runs.displacement import displacement, sum_deviations
from truepose.runs.poses import OK, PoseRun
from truepose.runs.quantities import quantities
from truepose.sources import PoseBlock, Source
from truepose.uncertainty_analysis.known_shifts import (
    FEWEST,
    NoLawError,
    Term,
    compliance_laws,
    expanding,
    probed_poses,
)
from truepose.version import version

SCHEMA = 1
"""Number of the form in which a bundle is written."""


def bundle(machine: Machine) -> dict[str, Any]:
    """The machine in its file's condition, as docs/live.md describes a bundle; SI, radians.

    Raises `RequestError`: no-workspace; not-live where too few poses about the workspace can be
    used to find how the sources follow from the pose; controller-unsaid, controller-contradicted
    for a calibrated file of which it is not known what its controller works with.
    """
    require_known_controller(machine)
    block, home = _probed(machine), _home(machine)
    laws, refused = _laws(machine, block)
    sources = [law.source for law in laws]
    yields = any(law.under for law in laws)
    own, shared = compliance_laws(block) if yields else ((), ())
    poses = machine.poses()
    condition = machine.condition
    reference = condition.reference_temperature
    parts = expanding(machine)
    kernel = machine.kernel
    return {
        "schema": SCHEMA,
        "version": version(),
        "name": machine.name,
        "file_hash": machine.file_hash,
        "description": _plain(kernel.__reduce__()[1][0]),
        "parameters": list(machine.parameters),
        "reference_temperature": reference,
        "sources": [
            *map(_live, laws),
            *(_not_live(machine, home, source, why) for source, why in refused),
        ],
        "compliance": {
            "own": _rows(own),
            "shared": [list(pair) for pair in shared],
            "limbs": yields and bool(machine.limbs) and not yields_unsaid(machine, sources),
        },
        "weight": weight(machine),
        **unknown(block, laws),
        "condition": {
            "temperature": {
                part: reference + float(np.ravel(condition.temperature_rise(part))[0])
                for part in parts
            },
            "wrench": [float(value) for value in condition.wrench],
        },
        "parts": [{"part": part, "label": part} for part in parts],
        "workspace": {
            "low": poses.min(axis=0).tolist(),
            "high": poses.max(axis=0).tolist(),
            "home": home.requested[home.indices[0]].tolist(),
            "poses": len(poses),
        },
        "target": _target(machine),
        "units": units_for_people(machine),
    }


def middle_pose(machine: Machine) -> Floats:
    """(n_commanded,) SI: the usable pose of the file's nearest to the middle of its workspace.

    Raises `RequestError`: no-workspace; not-live where the machine can reach none of them.
    """
    home = _home(machine)
    pose: Floats = home.requested[home.indices[0]]
    return pose


def _probed(machine: Machine) -> PoseBlock:
    """Where laws are found. Raises `RequestError` (not-live, no-workspace)."""
    if machine.replaced:
        names = ", ".join(sorted(machine.replaced)[:3])
        raise _cannot(
            machine,
            f"values of {names} that were replaced in Python",
            "the values of the file",
            "write them into the file",
        )
    block = probed_poses(machine)
    usable = 0 if block is None else block.indices.size
    if block is None or usable < FEWEST:
        raise _cannot(
            machine,
            f"{usable} usable poses about the workspace",
            f"at least {FEWEST}, from which to find how the sources follow from the pose",
            "truepose check says why poses cannot be used",
        )
    return block


def _cannot(machine: Machine, found: str, expected: str, hint: str) -> RequestError:
    message = "the machine cannot be made into a live page"
    return RequestError(
        Problem("not-live", message, file=machine.file, found=found, expected=expected, hint=hint)
    )


def _sources(machine: Machine) -> tuple[Source, ...]:
    return cast("tuple[Source, ...]", machine.sources)


def _laws(machine: Machine, block: PoseBlock) -> tuple[list[LiveLaw], list[tuple[Source, str]]]:
    """Of what follows laws and does anything, and what follows none, with why."""
    laws: list[LiveLaw] = []
    refused: list[tuple[Source, str]] = []
    for source in _sources(machine):
        try:
            law = live_law(source, block)
            # Asked of each alone, so that one without laws takes no other with it.
            variables = unknown(block, [law])
            if correlated_student(variables):
                raise NoLawError("has correlated variables of Student's distribution")
            shifts = law.shifts.at_reference or any(law.shifts.per_kelvin.values())
            # What does nothing, whatever a slider does, is no row of zeros.
            if (
                shifts
                or variables["variables"]
                or law.under == "tool"
                or source.acts(machine.condition)
            ):
                laws.append(law)
        except NoLawError as failure:
            refused.append((source, str(failure)))
    return laws, refused


def _live(law: LiveLaw) -> dict[str, Any]:
    per_kelvin = law.shifts.per_kelvin.items()
    return {
        "name": law.source.name,
        "doc": law.source.doc,
        "live": True,
        "at_reference": _rows(law.shifts.at_reference),
        "per_kelvin": {part: _rows(added) for part, added in per_kelvin if added},
        "under_wrench": law.under == "tool",
        "under_weight": law.under == "own",
    }


def _rows(terms: Sequence[Term]) -> list[list[Any]]:
    return [[term.parameter, term.constant, term.slope, term.strut] for term in terms]


def _not_live(machine: Machine, home: PoseBlock, source: Source, why: str) -> dict[str, Any]:
    """With its largest error alone at its shift, over the file's poses in the file's condition."""
    largest = dict.fromkeys(quantities(machine.components), 0.0)
    if source.acts(machine.condition):
        for block in PoseRun(machine, machine.poses(), machine.condition):
            deviation = source.deviation(machine, machine.condition, block)
            moved = sum_deviations([(deviation.parameters, deviation.shift)])
            errors, status = displacement(machine, block.joints, block.placements, moved)
            for quantity, columns in quantities(machine.components).items():
                sizes = np.linalg.norm(errors[status == OK][:, columns], axis=1)
                largest[quantity] = max(largest[quantity], float(sizes.max(initial=0.0)))
    return {
        "name": source.name,
        "doc": source.doc,
        "live": False,
        "why": why,
        "largest": largest,
        "banded": source.acts(machine.condition)
        and bool(source.deviation(machine, machine.condition, home).banded.size),
    }


def _home(machine: Machine) -> PoseBlock:
    """The usable pose of the file's nearest to the middle. Raises `RequestError` (not-live)."""
    poses = machine.poses()
    low, high = poses.min(axis=0), poses.max(axis=0)
    span = np.where(high > low, high - low, 1.0)
    away = np.square((poses - 0.5 * (low + high)) / span).sum(axis=1)
    nearest = poses[np.argsort(away, kind="stable")]
    # Most files can use the first; the others are looked at only where it cannot be.
    for some in (nearest[:1], nearest[1:]):
        for block in PoseRun(machine, some, machine.condition) if len(some) else ():
            return block.select(np.arange(block.indices.size) == 0)
    raise _cannot(
        machine,
        "no pose of the workspace that the machine can reach",
        "at least one",
        "truepose check says why poses cannot be used",
    )


def _target(machine: Machine) -> dict[str, float]:
    asked = {"position": machine.accuracy.target, "orientation": machine.accuracy.angle_target}
    return {
        name: value
        for name, value in asked.items()
        if value is not None and name in quantities(machine.components)
    }


def units_for_people(machine: Machine) -> dict[str, dict[str, float | str]]:
    """By dimension: a label, and SI of one unit; a temperature's `offset` is K at its zero."""
    shown = shown_units(machine.file_units)

    def unit(of: Shown) -> dict[str, float | str]:
        return {"label": of.label, "si": 1.0 / of.per_si}

    zero, degree = (ICE_POINT - 32.0 / 1.8, 1.0 / 1.8) if shown.fahrenheit else (ICE_POINT, 1.0)
    label = "°F" if shown.fahrenheit else "°C"
    arm = f"{shown.force.label}·{shown.length.label}"
    return {
        "length": unit(shown.length),
        "angle": unit(shown.angle),
        "small_length": unit(shown.small_length),
        "small_angle": unit(shown.small_angle),
        "force": unit(shown.force),
        "moment": {"label": arm, "si": 1.0 / (shown.force.per_si * shown.length.per_si)},
        "temperature": {"label": label, "si": degree, "offset": zero},
    }


def _plain(value: object) -> Any:
    """The same in values that JSON has."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, np.generic):
        return value.item()
    return value


__all__ = ["SCHEMA", "bundle", "middle_pose", "units_for_people"]
