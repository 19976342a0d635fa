"""A blunder is the answer, not the hint of a solver that gave up."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from made_blunders import column, exchanged, good
from truepose.calibration.calibrate import calibrate
from truepose.calibration.data_checks import suspicions
from truepose.calibration.dataset import verdict_of
from truepose.calibration.identification import rounds
from truepose.calibration.measurements import Measurements
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.spatial import euler_to_matrix


@functools.cache
def machine(name: str) -> Machine:
    return tp.load(MACHINES / f"{name}.toml")


@pytest.fixture(scope="module")
def wide(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    """A hexaglide of which every joint may be 20 mm off."""
    text = (MACHINES / "hexaglide.toml").read_text("utf-8")
    path = tmp_path_factory.mktemp("wide") / "hexaglide.toml"
    path.write_text(text.replace(" = 0.01\n", " = 20\n"), "utf-8")
    return tp.load(path)


def in_another_order(data: Measurements) -> Measurements:
    """The same rotations in angles of R = Rx(a) Ry(b) Rz(c)."""
    places = np.stack([column(data, name) for name in "abc"], axis=1)
    rotation = euler_to_matrix(data.value[places])
    value = data.value.copy()
    value[places] = np.column_stack(
        [
            np.arctan2(-rotation[:, 1, 2], rotation[:, 2, 2]),
            np.arcsin(rotation[:, 0, 2]),
            np.arctan2(-rotation[:, 0, 1], rotation[:, 0, 0]),
        ]
    )
    return data.with_values(value)


def with_columns_exchanged() -> Measurements:
    data = good(machine("linapod"), "position", seed=1, frame="unknown")
    return exchanged(data, column(data, "x"), column(data, "y"))


def test_columns_exchanged_are_a_no_also_where_no_machine_can_be_found() -> None:
    answer = calibrate(machine("linapod"), with_columns_exchanged(), use_prior=False)
    assert answer.failure is not None
    assert answer.failure.code == "no-fit"
    assert not answer.accepted
    verdict = verdict_of(answer)
    assert verdict.startswith("No: the measurements look wrong. made: it looks as if the readings")
    assert "no machine was found that explains the measurements" in verdict
    assert answer.dataset.attrs["accepted"] == 0
    with pytest.raises(RequestError):
        answer.save("never.toml", original=MACHINES / "linapod.toml", date="2026-01-31", force=True)


def test_where_no_machine_can_be_found_nothing_is_known_better(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Within tolerances a machine is found for exchanged columns too: the search is cut short."""
    monkeypatch.setattr(rounds, "SETTLED", ())
    answer = calibrate(machine("linapod"), with_columns_exchanged())
    assert answer.failure is not None
    assert not answer.fit.values[: answer.fit.unknowns.n_machine].any()
    assert answer.gate.before is not None
    np.testing.assert_allclose(answer.gate.after.position, answer.gate.before.position, rtol=1e-9)


def test_angles_in_another_order_are_found_where_tolerances_hide_them(wide: Machine) -> None:
    data = in_another_order(good(wide, "pose", seed=1, count=40))
    assert not [each for each in suspicions(wide, data) if each.refuses]
    answer = calibrate(wide, data)
    assert not answer.accepted
    assert answer.suspicions[0].code == "axis-order"
    assert "Rx(a) Ry(b) Rz(c)" in answer.suspicions[0].sentence
    assert verdict_of(answer).startswith("No: the measurements look wrong. made: it looks as if a")


def test_the_same_data_in_our_order_are_good(wide: Machine) -> None:
    answer = calibrate(wide, good(wide, "pose", seed=1, count=40))
    assert not [each for each in answer.suspicions if each.refuses]
