"""The witness of a part that is out of tolerance: one machine inside the bands, as files.

The machine file is the original's text with every tolerance the one value that it has; what else is
unknown (play, ripple, the direction of a force, ...) stands in a second file, `along_file`.
`truepose part` of both gives the value again: it is tried before they get their names.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.result.toml_edits import MachineText
from truepose.errors import Problem, RequestError
from truepose.files.writing import replacing, written_together
from truepose.machine import Machine, load
from truepose.runs.poses import OK
from truepose.runs.variables import Variables
from truepose.sources import REGISTRY, acting
from truepose.sources.tolerance import DimensionalTolerance
from truepose.verdict.one_values import OneValues
from truepose.verdict.witness_file import file_changed
from truepose.workpiece.along_file import fixed, text_of
from truepose.workpiece.evaluation import NOT_MET, Characteristic, PartEvaluation
from truepose.workpiece.reached import ReachedValue
from truepose.workpiece.states import PartState, part_states

SAME = 1e-9
"""Relative to the value: what the files may differ by."""

ROUNDING = 1e-12
"""m or rad: the same of a value that is nothing."""


def first_broken(evaluation: PartEvaluation) -> int | None:
    """Number of the characteristic that is NOT met as commanded and is broken the most; else None.

    In shares of its tolerance.
    """
    before = evaluation.before()
    worst, most = None, 0.0
    for at, (of, answer) in enumerate(zip(evaluation.characteristics, before.answers, strict=True)):
        if answer.verdict != NOT_MET:
            continue
        beyond = _beyond(of, _breaking(evaluation, at).value)
        if beyond > most:
            worst, most = at, beyond
    return worst


def write_part_witness(
    evaluation: PartEvaluation, at: int, path: Path, along: Path, original: Path
) -> tuple[Path, ...]:
    """Write the witness of characteristic number `at`; which files were written.

    `along` is written only where the machine file cannot say all. Raises `RequestError`
    (machine-file-changed, witness-not-written).
    """
    machine, state = evaluation.machine, evaluation.before().state
    reached = _breaking(evaluation, at)
    with written_together():
        with replacing(path) as temporary:
            text = MachineText(original, machine, file_changed(original, machine))
            text.write_rows_for_family()
            edits = OneValues(text, machine, {})
            for name, value in machine.replaced.items():
                if not name.endswith((".u", ".v")):
                    text.set_parameter(name, value)
            edits.tolerances(_tolerances(state, reached.t))
            text.move_to(path)
            temporary.write_text(_head(evaluation, at, reached) + text.text(), encoding="utf-8")
            written = load(temporary, registry=REGISTRY)
            states, status = part_states(
                written,
                written.condition,
                acting(written, written.condition),
                evaluation.walked.poses,
                evaluation.walked.travel,
            )
            if (status != OK).any():
                raise _not_written(path, "the machine cannot go to all points")
            t = _matched(state.variables, states[0].variables, reached.t)
            _require_same(
                evaluation, at, fixed(states[0], _everywhere(states[0], t)), reached, path
            )
        if not states[0].variables.names:
            return (path,)
        with replacing(along) as temporary:
            temporary.write_text(text_of(states[0].variables, t), encoding="utf-8")
    return (path, along)


def _breaking(evaluation: PartEvaluation, at: int) -> ReachedValue:
    """The end that is farther beyond its limit."""
    of, search = evaluation.characteristics[at], evaluation.before().answers[at].search
    return max((search.lower, search.upper), key=lambda one: _beyond(of, one.value))


def _beyond(of: Characteristic, value: float) -> float:
    """By how much a value is outside of the limits, in shares of what they leave."""
    quantity = of.quantity
    width = quantity.upper - quantity.lower
    beyond = max(value - quantity.upper, quantity.lower - value)
    return float(beyond / width if np.isfinite(width) and width > 0.0 else beyond)


def _tolerances(state: PartState, t: Floats) -> dict[str, float]:
    """The deviation that each toleranced parameter has, SI."""
    variables, machine = state.variables, state.machine
    values = t if t.ndim == 1 else t[0]
    own = np.array(variables.sources, dtype=np.str_) == DimensionalTolerance.name
    columns = np.flatnonzero(own[variables.variable_of])
    deviations = np.zeros(len(machine.parameters))
    for source, (parameters, shift) in zip(
        acting(machine, machine.condition), variables.alone, strict=True
    ):
        if source.name == DimensionalTolerance.name:
            np.add.at(deviations, parameters, shift[0])
    half = variables.half_width[0, columns]
    moved = half * values[variables.variable_of[columns]]
    np.add.at(deviations, variables.columns[columns], moved)
    named = np.unique(np.concatenate([variables.columns[columns], np.flatnonzero(deviations)]))
    return {machine.parameters[column]: float(deviations[column]) for column in named.tolist()}


def _matched(original: Variables, written: Variables, t: Floats) -> Floats:
    """The values of the written machine's variables, which are those of the original's."""
    place = {
        identity: number
        for number, identity in enumerate(
            zip(original.streams.tolist(), original.numbers.tolist(), strict=True)
        )
    }
    chosen = [
        place[identity]
        for identity in zip(written.streams.tolist(), written.numbers.tolist(), strict=True)
    ]
    matched: Floats = t[..., chosen]
    return matched


def _everywhere(state: PartState, t: Floats) -> Floats:
    return np.broadcast_to(t, (state.block.indices.size, t.shape[-1]))


def _require_same(
    evaluation: PartEvaluation, at: int, state: PartState, reached: ReachedValue, path: Path
) -> None:
    value = float(evaluation.values((state.points + state.known_error)[np.newaxis])[0, at])
    if abs(value - reached.value) > SAME * abs(reached.value) + ROUNDING:
        raise _not_written(
            path, f"its value is {value:.12g} m or rad, the witness's {reached.value:.12g}"
        )


def _head(evaluation: PartEvaluation, at: int, reached: ReachedValue) -> str:
    machine: Machine = evaluation.machine
    of = evaluation.characteristics[at]
    shown = evaluation.shown.small(of.quantity.si)
    off = shown.text(reached.value - of.quantity.nominal, 6)
    lines = [
        "A witness: one machine inside the tolerances, for which a part is out of tolerance.",
        f"Of {machine.file} (SHA-256 {machine.file_hash}).",
        f"{of.label} is off its nominal value by {off}.",
        "Every tolerance is the one value that this machine has: two equal limits.",
    ]
    return "".join(f"# {line}\n" for line in lines) + "\n"


def _not_written(path: Path, why: str) -> RequestError:
    return RequestError(
        Problem(
            "witness-not-written",
            f"the witness's files, read again, are not the witness: {why}",
            str(path),
            found=why,
            expected="the same machine",
            hint="nothing was written; please report it with the machine file",
        )
    )


__all__ = ["first_broken", "write_part_witness"]
