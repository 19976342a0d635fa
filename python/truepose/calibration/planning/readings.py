"""What an instrument would read at poses that are only planned: observations without values."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.identification.problem import IdentificationProblem as Fitted
from truepose.calibration.identification.unknowns import Unknowns
from truepose.calibration.instruments import REGISTRY, Instrument
from truepose.calibration.instruments._base import moved
from truepose.calibration.measurements.measurements import Measurements, unloaded_at_reference
from truepose.calibration.observables import OBSERVABLES, OF_STRUTS
from truepose.calibration.planning.poses import Placed
from truepose.errors import Problem, RequestError
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Condition, Machine


def observed(machine: Machine, instrument: Instrument) -> tuple[str, ...]:
    """What an instrument reads at every pose: that of which it states an uncertainty.

    Raises `RequestError` (plan-instrument) where that is nothing, or too much for its kind, and for
    a contact, whose poses are where the target stays and not a choice.
    """
    kind = REGISTRY.get(instrument.kind)
    if kind is None:
        raise _refusal(
            instrument,
            "there is no such kind of instrument",
            found=instrument.kind,
            expected=one_of(sorted(REGISTRY)),
            hint=did_you_mean(instrument.kind, REGISTRY),
        )
    if kind.fixed:
        raise _refusal(
            instrument,
            "the poses of a contact are those that keep its point in place: nothing is to choose",
            found=instrument.kind,
            expected=one_of(sorted(name for name, kind in REGISTRY.items() if not kind.fixed)),
        )
    if not kind.poses:
        raise _refusal(
            instrument,
            "a dimension of a part is measured without a pose: nothing is to choose",
            found=instrument.kind,
            expected=one_of(sorted(name for name, kind in REGISTRY.items() if kind.poses)),
            hint="measure it at any time, its row joins those of the poses in one file; of a file "
            "that declares others, too, name one of these: FILE.csv:NAME",
        )
    if kind.poses > 1:
        raise _refusal(
            instrument,
            "a plan chooses poses one by one, and this reads between two",
            found=instrument.kind,
            expected=one_of(sorted(name for name, kind in REGISTRY.items() if kind.poses == 1)),
            hint="plan poses with an instrument of another kind, and measure between those; of a "
            "file that declares others, too, name one of these: FILE.csv:NAME",
        )
    readable = tuple(dict.fromkeys(kind.reads.values()))
    possible = tuple(name for name in readable if moved(name, machine.components))
    named = tuple(name for name in possible if name in instrument.uncertainty)
    usual = kind.observed(machine.components)
    reads = named or tuple(name for name in usual if instrument.uncertainty_of(name) is not None)
    stated = [name for name in readable if name in instrument.uncertainty]
    if not possible or (stated and not set(stated) & set(possible)):
        unmoved = ", ".join(stated or readable)
        raise _refusal(
            instrument,
            "this machine does not move in what it reads",
            found=f"{unmoved}, of a platform that moves in {', '.join(machine.components)}",
            expected="an instrument of something that changes with the pose",
        )
    if not reads:
        raise _refusal(
            instrument,
            "how uncertain its readings are is not said",
            found="no uncertainty of " + one_of(possible),
            expected="a standard uncertainty of what it reads, of this machine " + one_of(possible),
        )
    if kind.most is not None and len(reads) > kind.most:
        raise _refusal(
            instrument,
            f"which of its readings it has is not said: a {kind.name} has at most {kind.most}",
            found=", ".join(reads),
            expected="an uncertainty of each that it has, by name, such as z",
        )
    return reads


def planned(
    machine: Machine,
    instruments: Sequence[Instrument],
    placed: Placed,
    condition: Condition | None = None,
) -> Measurements:
    """Measurements at poses, row after row, of value 0: every instrument at each pose in turn.

    The condition is the machine's at reference temperature with nothing on the tool, where none is
    given. Raises `RequestError` (plan-instrument).
    """
    if not instruments:
        raise RequestError(
            Problem(
                "plan-instrument",
                "nothing is measured without an instrument",
                found="none",
                expected="an instrument, or several",
            )
        )
    columns = [_columns(machine, instrument) for instrument in instruments]
    sizes = [len(rows) for rows in columns]
    at_one_pose = np.concatenate([np.array(rows, np.float64) for rows in columns])
    n_pose, n_instrument = len(placed), len(instruments)
    own = np.repeat(np.arange(n_instrument), sizes)
    table = np.tile(at_one_pose, (n_pose, 1))
    state = unloaded_at_reference(machine.condition) if condition is None else condition
    machine.check_condition(state)
    return Measurements(
        instruments=tuple(instruments),
        joints=np.repeat(placed.joints, n_instrument, axis=0),
        placements=np.repeat(placed.placements, n_instrument, axis=0),
        instrument=np.tile(np.arange(n_instrument, dtype=np.intp), n_pose),
        conditions=(state,) * (n_pose * n_instrument),
        held_out=np.zeros(n_pose * n_instrument, np.bool_),
        row=(np.arange(n_pose)[:, np.newaxis] * n_instrument + own).reshape(-1).astype(np.intp),
        observable=table[:, 0].astype(np.intp),
        strut=table[:, 1].astype(np.intp),
        value=np.zeros(len(table)),
        uncertainty=table[:, 2].copy(),
        lines=np.zeros(n_pose * n_instrument, np.intp),
    )


def whitened(
    machine: Machine, measurements: Measurements, unknowns: Unknowns, n_pose: int
) -> Floats:
    """(n_pose, k, n) d(read)/d(unknown) over the standard uncertainty; NaN where unsolved."""
    problem = Fitted(machine, measurements, unknowns)
    rows = problem.jacobian(unknowns.prior_mean) / measurements.uncertainty[:, np.newaxis]
    return np.asarray(rows.reshape(n_pose, -1, rows.shape[1]), np.float64)


def _columns(machine: Machine, instrument: Instrument) -> list[tuple[int, int, float]]:
    """Observable, strut or -1, and uncertainty of everything that is read at a pose."""
    stated = {}
    for name in observed(machine, instrument):
        uncertainty = instrument.uncertainty_of(name)
        assert uncertainty is not None
        if not (np.isfinite(uncertainty) and uncertainty > 0.0):
            raise _refusal(
                instrument,
                f"its uncertainty of {name} is none",
                found=f"{uncertainty:g}",
                expected="a finite number above zero",
            )
        stated[name] = float(uncertainty)
    of_struts = not stated.keys().isdisjoint(OF_STRUTS)
    return [
        (OBSERVABLES.index(name), strut, uncertainty)
        for strut in (range(len(machine.struts)) if of_struts else (-1,))
        for name, uncertainty in stated.items()
    ]


def _refusal(
    instrument: Instrument, message: str, *, found: str, expected: str, hint: str | None = None
) -> RequestError:
    return RequestError(
        Problem(
            "plan-instrument",
            f"instrument {instrument.name}: {message}",
            found=found,
            expected=expected,
            hint=hint,
        )
    )
