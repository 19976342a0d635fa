"""A witness as a machine file: the original's text, every band of it the one value that it has.

Before compensation nominal values stay, and all that is known stays as it is said: temperatures,
forces, weights. After compensation the command differs, by what the offsets of the drives say: the
offset of the file is the one at which the controller, with the dimensions as they are, commands the
corrected joints, and what it is more than the original's is part of that offset's deviation. The
machine itself is the same. Any other command could be written so, whatever it was computed from.

What a draft of the file makes of the parameters is asked of the sources, and what is still wanting
is written as tolerances of equal limits: so the file says every deviation, whatever follows what.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import tomlkit

from truepose._kernel import STATUS
from truepose.arrays import Floats
from truepose.calibration.result.toml_edits import MachineText
from truepose.errors import Problem, RequestError, TrueposeError
from truepose.files.dimensions import BY_UNIT
from truepose.files.writing import replacing, require_writable
from truepose.machine import Machine, load
from truepose.machine.temperature_log import TemperatureLog
from truepose.runs.displacement import at_shifts, displacement, sum_deviations
from truepose.runs.poses import OK, REASONS, PoseRun, pose_in_words
from truepose.sources import REGISTRY, acting
from truepose.verdict.one_values import OneValues
from truepose.verdict.witness import Witness
from truepose.version import version

ENDING = ".toml"

SAME_SIZE = 1e-9
"""Relative to the witness's size: what a budget of the file may differ by."""

ROUNDING = 1e-13
"""Of the machine's size: what the solution of a pose may differ by besides, in m or rad."""

NO_DIFFERENCE = 1e-12
"""Of a source's largest deviation of one unit: a difference that is rounding."""

NOTHING_LEFT = 1e-15
"""Of the sum of what several sources do to a parameter: what is left is rounding."""

SAME_JOINT = 1e-14
"""Of a drive's travel: a joint coordinate that is the same."""

_ONE_CAUSE = {"elastic": "loads"}
"""Sources between which a force passes when its direction becomes known."""

_ANY = "all"
"""What deviates, where the file says it by tolerances alone."""


def write_witness(
    machine: Machine, witness: Witness, path: str | Path, *, original: str | Path
) -> Machine:
    """Write the witness to `path` and return the machine as it is read from there.

    `original`: the file that `machine` was read from; its text, in its order and with its comments,
    is the one written. `truepose.budget` of the file gives the witness's size as the length of its
    `overall_error`, or leaves the pose out with the witness's status. Causes that are known stay
    as the file says them; where the run's condition is not the file's, or only so the file says
    the same, they are switched off and what they do is part of the tolerances.

    Raises `RequestError` (`output-*`, machine-file-changed, witness-not-written), and writes the
    file whole or not at all.
    """
    path, original = Path(path), Path(original)
    require_writable(path, [ENDING], [original])
    why = ""
    with replacing(path) as temporary:
        for causes_stay in (True, False):
            writing = _Writing(machine, witness, original, path, temporary, causes_stay)
            why = writing.written()
            if not why:
                break
        if why:
            raise _not_written(path, why)
    return load(path, registry=REGISTRY)


class _Writing:
    """One try, with the causes that are known as they are, or all as tolerances."""

    def __init__(
        self,
        machine: Machine,
        witness: Witness,
        original: Path,
        path: Path,
        temporary: Path,
        causes_stay: bool,
    ) -> None:
        self._machine, self._witness = machine, witness
        self._path, self._temporary = path, temporary
        self._causes_stay = causes_stay
        self._text = MachineText(original, machine, file_changed(original, machine))
        # One machine has joint centres, which need not be those of any family.
        self._text.write_rows_for_family()
        self._edits = OneValues(self._text, machine, witness.by_source)

    def written(self) -> str:
        """Write the temporary file; empty where it is the witness, else why it is not."""
        text, edits, machine = self._text, self._edits, self._machine
        if self._causes_stay:
            edits.bands_of_keys()
            force = self._witness.force
            if force is None:
                edits.no_envelope()
            else:
                edits.force(force + np.array(machine.condition.force))
        else:
            edits.no_sources()
        for name, value in machine.replaced.items():
            if not name.endswith((".u", ".v")):
                text.set_parameter(name, value)
        edits.pose(self._witness.pose)
        text.move_to(self._path)
        try:
            draft = self._draft()
            if self._causes_stay and not self._same_condition(draft):
                return "the condition is not the file's"
            edits.tolerances(self._wanting(draft))
            self._head(draft)
            return self._difference(self._load())
        except TrueposeError as error:
            # Of an error in a file that nobody has seen the reason is enough.
            return f"{error.problems[0].code}: {error.problems[0].message}"

    def _load(self) -> Machine:
        self._temporary.write_text(self._text.text(), encoding="utf-8")
        return load(self._temporary, registry=REGISTRY)

    def _untoleranced(self) -> Machine:
        """The machine of the text without its tolerances, which stay in the text."""
        text = self._text.text()
        self._edits.tolerances({})
        draft = self._load()
        self._text.toml = tomlkit.parse(text)
        return draft

    def _draft(self) -> Machine:
        """The file without tolerances, whose command is the witness's."""
        draft = self._untoleranced()
        joints, _, status = draft.kernel.place(self._witness.pose[np.newaxis])
        commanded = np.asarray(self._witness.joints, np.float64)
        spans = np.array([drive.travel[1] - drive.travel[0] for drive in draft.drives])
        if STATUS[status[0]] not in ("ok", "out_of_travel", "joint_limit"):
            return draft
        other = np.abs(joints[0] - commanded) > SAME_JOINT * spans
        if not other.any():
            return draft
        values = dict(zip(draft.parameters, draft.nominal.tolist(), strict=True))
        for joint in np.flatnonzero(other):
            drive = draft.drives[joint].part
            change = values[f"{drive}.scale"] * float(joints[0, joint] - commanded[joint])
            self._text.set_parameter(f"{drive}.offset", values[f"{drive}.offset"] + change)
        return self._untoleranced()

    def _same_condition(self, draft: Machine) -> bool:
        """Whether the file says the condition of the run, its force of unknown direction known."""
        given, force = self._machine.condition, self._witness.force
        wanted = np.array(given.force) + (0.0 if force is None else force)
        condition = draft.condition
        off = np.abs(np.array(condition.force) - wanted).max()
        return bool(
            off <= ROUNDING * np.abs(wanted).max()
            and _same_log(given.temperature_log, condition.temperature_log)
            and replace(given, force=condition.force, temperature_log=None, envelope=None)
            == replace(condition, temperature_log=None)
        )

    def _wanting(self, draft: Machine) -> dict[str, float]:
        """What the draft lacks to be the witness, SI, by parameter; where bands were, zeros too."""
        wanted, present = self._deviations(self._witness.by_source), self._deviations(_known(draft))
        total, parts = np.zeros((2, len(draft.parameters)))
        units = np.array(draft.units)
        for name in dict.fromkeys([*wanted, *present]):
            nothing = np.zeros(len(total))
            one, other = wanted.get(name, nothing), present.get(name, nothing)
            difference = one - other
            for unit in BY_UNIT:
                of_unit = units == unit
                largest = np.maximum(np.abs(one), np.abs(other))[of_unit].max(initial=0.0)
                small = of_unit & (np.abs(difference) <= NO_DIFFERENCE * largest)
                if name in present:
                    difference[small] = 0.0
            total += difference
            parts += np.abs(difference)
        total += self._machine.nominal - draft.nominal
        total[np.abs(total) <= NOTHING_LEFT * parts] = 0.0
        bands = {
            int(column)
            for column, variable in zip(
                self._witness.spread.columns, self._witness.spread.variable_of, strict=True
            )
            if self._witness.spread.sources[variable] == "tolerance"
        }
        columns = sorted(bands | set(np.flatnonzero(total).tolist()))
        if not columns and not acting(draft, draft.condition):
            columns = [0]
        return {draft.parameters[column]: float(total[column]) for column in columns}

    def _deviations(self, by_source: Mapping[str, Floats]) -> dict[str, Floats]:
        """The same with sources together between which causes pass."""
        wanting: dict[str, Floats] = {}
        for name, values in by_source.items():
            key = _ONE_CAUSE.get(name, name) if self._causes_stay else _ANY
            wanting[key] = wanting.get(key, 0.0) + values
        return wanting

    def _difference(self, written: Machine) -> str:
        """Empty where a budget of the file is the witness; else what is not."""
        witness = self._witness
        sources = acting(written, written.condition)
        walk = PoseRun(written, written.poses(), written.condition)
        status, error = "", np.zeros((1, len(written.components)))
        for block in walk:
            deviations = [source.deviation(written, written.condition, block) for source in sources]
            banded = [
                source.name
                for source, deviation in zip(sources, deviations, strict=True)
                if deviation.banded.size
            ]
            if banded:
                return f"{', '.join(banded)} still has a band"
            alone = [(deviation.parameters, deviation.shift) for deviation in deviations]
            status = STATUS[at_shifts(written, block, alone, sum_deviations(alone))[0]]
            error, _ = displacement(written, block.joints, block.placements, sum_deviations(alone))
        if not status:
            status = REASONS[walk.left_out.status[0][0]]
        if status != witness.status:
            return f"its pose is {status}, the witness's {witness.status}"
        if STATUS.index(status) != OK:
            return ""
        size = float(np.linalg.norm(error[0][witness.components]))
        length = written.characteristic_length if witness.quantity == "position" else 1.0
        if abs(size - witness.size) <= SAME_SIZE * witness.size + ROUNDING * length:
            return ""
        return f"its {witness.quantity} error is {size:.12g}, the witness's {witness.size:.12g}"

    def _head(self, draft: Machine) -> None:
        """Lines at the top that say what the file is."""
        machine, witness = self._machine, self._witness
        shown = machine.shown.error(witness.quantity)
        size = shown.text(witness.size, 6) if witness.error is not None else "none, "
        if witness.error is None:
            size += f"it cannot be assembled ({witness.status.replace('_', ' ')})"
        settings = "".join(f", {key}={value}" for key, value in machine.settings.items())
        lines = [
            f"A witness: one machine inside the tolerances, written by truepose {version()}.",
            f"Of {machine.file}{settings} (SHA-256 {machine.file_hash}).",
            f"State: {witness.state}. Pose {witness.number}: "
            f"{pose_in_words(machine, witness.pose)}.",
            f"Error of the {witness.quantity} there: {size}.",
            "Every band is the one value that this machine has: a tolerance of two equal limits.",
        ]
        if (draft.nominal != machine.nominal).any():
            lines += [
                "The drives' offsets are those with which the controller commands the corrected",
                "joints there; what they are more is part of the deviation of the offsets.",
            ]
        if not self._causes_stay:
            lines += ["What temperatures, forces and all else do there is in the tolerances."]
        elif witness.spread.sources:
            lines += ["What follows the pose (play, phases, resolution) is its deviation there."]
        head = "".join(f"# {line}\n" for line in lines)
        self._text.toml = tomlkit.parse(f"{head}\n{self._text.text()}")


def _same_log(one: TemperatureLog | None, other: TemperatureLog | None) -> bool:
    if one is None or other is None:
        return one is other
    return bool(
        np.array_equal(one.times, other.times)
        and one.temperatures.keys() == other.temperatures.keys()
        and all(
            np.array_equal(values, other.temperatures[part])
            for part, values in one.temperatures.items()
        )
    )


def _known(draft: Machine) -> dict[str, Floats]:
    """(n_parameter,) deviations of a file at its one pose by source, at their shifts."""
    sources = acting(draft, draft.condition)
    by_source = {source.name: np.zeros(len(draft.parameters)) for source in sources}
    for block in PoseRun(draft, draft.poses(), draft.condition):
        for source in sources:
            deviation = source.deviation(draft, draft.condition, block)
            np.add.at(by_source[source.name], deviation.parameters, deviation.shift[0])
    return by_source


def file_changed(original: Path, machine: Machine) -> RequestError:
    """That the machine file is another one by now (machine-file-changed)."""
    return RequestError(
        Problem(
            "machine-file-changed",
            "the machine file is not the one that was read",
            str(original),
            found="another content than when it was read",
            expected=f"the file with the SHA-256 {machine.file_hash[:12]}...",
            hint="ask again with the file as it is now",
        )
    )


def _not_written(path: Path, why: str) -> RequestError:
    return RequestError(
        Problem(
            "witness-not-written",
            f"the witness's file, read again, is not the witness: {why}",
            str(path),
            found=why,
            expected="the same machine at the same pose",
            hint="nothing was written; please report it with the machine file",
        )
    )


__all__ = ["file_changed", "write_witness"]
