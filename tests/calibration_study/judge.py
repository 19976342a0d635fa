"""The answer of a calibration, held against the machine that was built.

`stated_95` is the one place that knows how a calibration says how well the tool is known.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import norm  # type: ignore[import-untyped]

import truepose as tp
from build_machine import deviated
from calibration_study.kinematics import NoRootError, Placed
from calibration_study.truth import Floats, Twin
from reference_kinematics import Reference, rotation_of_quaternion, vector_of
from truepose.calibration.calibrate import Calibration
from truepose.errors import TrueposeError

POSITION, ROTATION = "xyz", "abc"
QUANTILE = float(norm.ppf(0.975))
STEP = 1e-6
"""m and rad, of a central difference of closures to a parameter."""


@dataclass(frozen=True, eq=False)
class Answer:
    """What is told: `code` and `sentence` that come first, and all `codes` with their `sentences`.

    `found` None where nothing was found: the exception's code and words are the first then.
    """

    accepted: bool
    code: str
    sentence: str
    codes: tuple[str, ...]
    sentences: tuple[str, ...]
    found: Calibration | None

    @property
    def first(self) -> str:
        return f"{self.code}: {self.sentence}"

    def mentions(self, pattern: str) -> bool:
        """Whether any of what is told matches."""
        told = zip(self.codes, self.sentences, strict=True)
        return any(re.search(pattern, f"{code}: {sentence}", re.I) for code, sentence in told)

    def named_rows(self) -> set[int]:
        """Rows that are said not to fit, as outliers or by a suspicion of some rows."""
        if self.found is None:
            return set()
        rows = {int(each.row) for each in self.found.outliers}
        return rows | {int(row) for each in self.found.suspicions for row in each.rows}


def answer_of(twin: Twin, data: Path, poses: Floats) -> Answer:
    """What a person is told of these measurements, most important first."""
    try:
        found = tp.calibrate(twin.loaded, data, poses=poses)
    except TrueposeError as failure:
        told = [(problem.code, problem.message) for problem in failure.problems]
        return _answer(False, told, None)
    refusing = [each for each in found.suspicions if each.refuses]
    others = [each for each in found.suspicions if not each.refuses]
    told = [(each.code, each.sentence) for each in (*refusing, *found.gate.reasons, *others)]
    told += [("outlier", each.sentence) for each in found.outliers]
    told += [(each.code, each.sentence) for each in found.gate.warnings]
    return _answer(found.accepted, told, found)


def _answer(accepted: bool, told: list[tuple[str, str]], found: Calibration | None) -> Answer:
    code, sentence = told[0] if told else ("", "")
    codes, texts = tuple(code for code, _ in told), tuple(text for _, text in told)
    return Answer(accepted, code, sentence, codes, texts, found)


@dataclass(frozen=True, eq=False)
class Tool:
    """`off` (n_pose,) and `stated` (n_pose,) 95 % of it, m or rad, of "position" or "rotation"."""

    quantity: str
    off: Floats
    stated: Floats

    @property
    def ratio(self) -> float:
        """How far it is off at the headline's pose, the worst stated one, over what is stated.

        Above one in 5 % of good calibrations.
        """
        worst = int(np.argmax(self.stated))
        return float(self.off[worst] / self.stated[worst]) if self.stated[worst] > 0 else np.inf

    @property
    def share_beyond(self) -> float:
        """Of all poses, each against its own."""
        return float((self.off > self.stated).mean())


def tools(twin: Twin, found: Calibration) -> list[Tool]:
    """Of commanded freedoms, at all poses that the calibrated machine reaches."""
    return tools_of(twin, found, tool_errors(twin, found))


def tools_of(twin: Twin, found: Calibration, errors: Floats | None) -> list[Tool]:
    """Errors (n_pose, 6) against what is stated; None is as far off as can be."""
    stated = stated_95(found, commanded_of(twin))
    return [
        Tool(
            quantity,
            np.full(each.shape, np.inf) if errors is None else _size(twin, errors, quantity),
            each,
        )
        for quantity, each in stated.items()
    ]


def commanded_of(twin: Twin) -> list[str]:
    """Components of the commanded freedoms, x y z a b c."""
    return list(twin.description["commanded"])


def stated_95(found: Calibration, commanded: list[str]) -> dict[str, Floats]:
    """(n_pose,) what the tool is said to be within in 95 % of cases, by quantity, m and rad.

    Today the gate states the root sum of squares of the standard uncertainties of all components,
    not the length's quantile. 1.96 of that is what it can mean at most: where all lies along one
    line. Components of freedoms that are not commanded are left out.
    """
    after = found.gate.after
    stated = {}
    for quantity, names in (("position", POSITION), ("rotation", ROTATION)):
        at = [i for i, name in enumerate(after.components) if name in names and name in commanded]
        if at:
            stated[quantity] = QUANTILE * np.linalg.norm(after.standard[:, at], axis=1)
    return stated


def tool_errors(twin: Twin, found: Calibration) -> Floats | None:
    """(n_pose, 6) where the built machine is, less where the calibrated one says, m and rad.

    Both are driven with the joints that the calibrated machine has for the pose.
    None where the machine cannot be there.
    """
    joints, _ = said_by(found)
    return errors_at(twin, found, joints)


def said_by(found: Calibration) -> tuple[Floats, Floats]:
    """Joints (n_pose, n_drive) and placements (n_pose, 7) of the calibrated machine."""
    joints, placements, _ = found.calibrated().kernel.place(found.poses[found.usable])
    return joints, placements


def errors_at(twin: Twin, found: Calibration, joints: Floats) -> Floats | None:
    """(n_pose, 6) the built machine's tool at joints (n_pose, n_drive), less where it should be.

    Freedoms that follow from the others should be where the calibrated machine has them. Where the
    answer leaves out where the machine stands in the room, what moves it there is taken out as
    well. None where the machine cannot be there.
    """
    errors, places = [], []
    for at, said in zip(joints, said_by(found)[1], strict=True):
        near = (said[:3], rotation_of_quaternion(said[3:]))
        try:
            point, rotation = twin.reached(at, near)
        except NoRootError:
            return None
        errors.append(np.concatenate([point - near[0], vector_of(rotation @ near[1].T)]))
        places.append((at, (point, rotation)))
    array = np.array(errors)
    if not found.gate.relative:
        return array
    return array - _of_gauge(twin, found, array, places)


def _of_gauge(
    twin: Twin, found: Calibration, errors: Floats, places: list[tuple[Floats, Placed]]
) -> Floats:
    """The part of the errors (n_pose, 6) that directions of the gauge make, by least squares.

    Linearised: what a direction does at the tool is worked out on the built machine's closures.
    Rotations count as lengths by the reach of the poses, as the gate has it.
    """
    effects = found.fit.unknowns
    fields = []
    for direction in found.gate.directions:
        if direction.kind != "gauge":
            continue
        change = effects.effects[:, : effects.n_machine] @ direction.effects
        names = [found.machine.parameters[column] for column in effects.columns]
        fields.append(_field(twin.built, dict(zip(names, change, strict=True)), places))
    if not fields:
        return np.zeros_like(errors)
    middle = np.array([place[0] for _, place in places])
    reach = float(np.sqrt(np.mean(np.sum((middle - middle.mean(axis=0)) ** 2, axis=1)))) or 1.0
    weight = np.tile([1.0, 1.0, 1.0, reach, reach, reach], len(places))
    basis = np.array([field.ravel() for field in fields]).T * weight[:, np.newaxis]
    # Directions may do nearly the same at the tool: a slight rest is rounding, not a field.
    part, *_ = np.linalg.lstsq(basis, errors.ravel() * weight, rcond=1e-3)
    removed: Floats = (basis @ part / weight).reshape(errors.shape)
    return removed


def _field(
    machine: Reference, change: dict[str, float], places: list[tuple[Floats, Placed]]
) -> Floats:
    """(n_pose, 6) how the tool moves with parameters: closures by differences, rows by formula."""
    size = max(abs(value) for value in change.values())
    step = STEP / size
    ends = [moved(machine, change, sign * step) for sign in (1.0, -1.0)]
    names = ("x", "y", "z", "a", "b", "c")
    moves = [at for at, name in enumerate(names) if name in machine.dof]
    field = np.zeros((len(places), 6))
    for row, (joints, placed) in enumerate(places):
        ahead, behind = (end.closures(joints, *placed) for end in ends)
        slope = (ahead - behind) / (2.0 * step)
        rows = machine.rows(joints, *placed)[:, moves]
        field[row, moves] = -np.linalg.lstsq(rows, slope, rcond=None)[0]
    return field


def moved(machine: Reference, change: dict[str, float], share: float) -> Reference:
    """The machine with its parameters moved by a share of the change, by name."""
    description = {
        "dof": machine.dof,
        "commanded": machine.commanded,
        "home": machine.home,
        "tool": machine.tool.tolist(),
        "characteristic_length": machine.characteristic_length,
        "drives": machine.drives,
        "struts": machine.struts,
        "guides": machine.guides,
    }
    return Reference(deviated(description, {n: share * v for n, v in change.items() if v != 0.0}))


def _size(twin: Twin, errors: Floats, quantity: str) -> Floats:
    names = ("x", "y", "z", "a", "b", "c")
    own = POSITION if quantity == "position" else ROTATION
    at = [i for i, n in enumerate(names) if n in own and n in commanded_of(twin)]
    size: Floats = np.linalg.norm(errors[:, at], axis=1)
    return size
