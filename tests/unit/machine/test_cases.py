"""`[case.NAME]`: further conditions, which take what they do not write from `[condition]`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from truepose.errors import MachineFileError

MACHINE = Path(__file__).parents[3] / "machines" / "planar_two_slider.toml"
KIENZLE = (
    'kienzle = { specific_force = "1500 N/mm^2", exponent = 0.25, chip_thickness = 0.1, '
    "width = 3, direction = [1, 0, 0] }\n"
)


def loaded(folder: Path, cases: str, *settings: str, condition: str = "") -> tp.Machine:
    path = folder / "m.toml"
    text = MACHINE.read_text().replace("\n[condition]\n", f"\n[condition]\n{condition}")
    path.write_text(f"{text}\n{cases}")
    return tp.load(path, settings)


def codes(folder: Path, cases: str) -> list[tuple[str, str | None]]:
    with pytest.raises(MachineFileError) as caught:
        loaded(folder, cases)
    return [(problem.code, problem.path) for problem in caught.value.problems]


def test_what_is_not_written_is_that_of_the_condition(tmp_path: Path) -> None:
    machine = loaded(
        tmp_path, "[case.hot]\ntemperature = 45\n[case.same]\n[case.idle]\nforce = {}\n"
    )
    assert list(machine.cases) == ["hot", "same", "idle"]
    hot, same, idle = machine.cases.values()
    assert hot.default_temperature == pytest.approx(318.15)
    assert hot.force == machine.condition.force == (1200.0, -1500.0, 0.0)
    assert same == machine.condition
    assert idle.force == (0.0, 0.0, 0.0)
    assert idle.default_temperature == machine.condition.default_temperature


def test_a_force_takes_the_place_of_another(tmp_path: Path) -> None:
    machine = loaded(tmp_path, f"[case.cut]\n{KIENZLE}")
    assert machine.cases["cut"].force[0] == pytest.approx(800.2257, rel=1e-6)
    assert machine.cases["cut"].force[1] == 0.0


def test_a_temperature_takes_the_place_of_a_log(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("time (s), default (degC)\n0, 20\n60, 25\n")
    machine = loaded(
        tmp_path,
        "[case.hot]\ntemperature = 45\n[case.logged]\n",
        condition='temperature_log = "log.csv"\ntime = "60 s"\n',
    )
    assert machine.cases["hot"].temperature("strut.1") == pytest.approx(318.15)
    assert machine.cases["logged"].temperature("strut.1") == pytest.approx(298.15)


def test_settings_of_a_condition_and_of_a_case(tmp_path: Path) -> None:
    settings = ("condition.force.x=7", "case.hot.temperature=50")
    machine = loaded(tmp_path, "[case.hot]\ntemperature = 45\n", *settings)
    assert machine.cases["hot"].force[0] == 7.0
    assert machine.cases["hot"].default_temperature == pytest.approx(323.15)


def test_a_case_is_a_condition(tmp_path: Path) -> None:
    machine = loaded(tmp_path, "[case.hot]\ntemperature = 45\n")
    as_case = tp.budget(machine, condition=machine.cases["hot"])
    as_set = tp.budget(tp.load(MACHINE, ["condition.temperature=45"]))
    np.testing.assert_array_equal(as_case["overall_error"], as_set["overall_error"])


def test_other_commands_read_the_condition(tmp_path: Path) -> None:
    with_case = tp.budget(loaded(tmp_path, "[case.hot]\ntemperature = 45\n"))
    np.testing.assert_array_equal(
        with_case["overall_error"], tp.budget(tp.load(MACHINE))["overall_error"]
    )


def test_bad_cases(tmp_path: Path) -> None:
    assert codes(tmp_path, "[case.hot]\ntemperatur = 45\n") == [
        ("unknown-key", "case.hot.temperatur")
    ]
    assert codes(tmp_path, "[case.hot.temperature]\n'strut.9' = 45\n") == [
        ("unknown-part", "case.hot.temperature.strut.9")
    ]
    assert codes(tmp_path, "[case.hot]\ngradient = { platform = 4 }\n")[0][0] == "no-unit"
    assert codes(tmp_path, "[case]\nhot = 4\n") == [("wrong-type", "case.hot")]
    assert codes(tmp_path, "[[case]]\nhot = 4\n") == [("wrong-type", "case")]
    assert codes(tmp_path, "[case.'hot.day']\n") == [("bad-name", "case.hot.day")]


def test_what_is_wrong_with_the_condition_is_told_once(tmp_path: Path) -> None:
    with pytest.raises(MachineFileError) as caught:
        loaded(tmp_path, "[case.hot]\n[case.cold]\n", "condition.temperature=x")
    assert [problem.path for problem in caught.value.problems] == ["condition.temperature"]
