"""Temperature logs: interpolation, the parts they name, and what is wrong with them."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from machine_texts import PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError, Problem, RequestError
from truepose.machine import Machine
from truepose.machine.temperature_log import TemperatureLog

LOGGED = edited(PLANAR, ("temperature = 35\n", 'temperature_log = "log.csv"\n'))
LOG = "time (min), default (degC), strut.1 (degC)\n0, 20, 20\n10, 24, 40\n20, 25, 44\n"


def load(folder: Path, log: str, *settings: str, text: str = LOGGED) -> Machine:
    (folder / "log.csv").write_text(log, encoding="utf-8")
    return load_text(folder, text, *settings)


def problems_of(folder: Path, log: str, *settings: str) -> tuple[Problem, ...]:
    with pytest.raises(MachineFileError) as caught:
        load(folder, log, *settings)
    return caught.value.problems


def test_temperatures_are_linear_between_the_rows(tmp_path: Path) -> None:
    machine = load(tmp_path, LOG)
    log = machine.condition.temperature_log
    assert log is not None
    assert log.name == "log.csv"
    assert log.times.tolist() == [0.0, 600.0, 1200.0]
    assert np.allclose(log.at("strut.1", [0.0, 150.0, 900.0]), 273.15 + np.array([20, 25, 42]))
    assert machine.data_files.keys() == {"log.csv"}


def test_a_condition_takes_the_last_moment_or_the_one_it_names(tmp_path: Path) -> None:
    last = load(tmp_path, LOG).condition
    assert last.temperature("strut.1") == pytest.approx(273.15 + 44)
    assert last.temperature("frame") == pytest.approx(273.15 + 25)
    early = load(tmp_path, LOG, "condition.time=5 min").condition
    assert early.temperature("strut.1") == pytest.approx(273.15 + 30)
    assert np.allclose(early.temperature("strut.2", [0.0, 600.0]), [293.15, 297.15])
    fixed = early.replace(temperature={"strut.2": 300.0})
    assert fixed.temperature("strut.2", [0.0, 600.0]) == 300.0


def test_a_log_is_picklable() -> None:
    log = TemperatureLog(np.array([0.0, 1.0]), {"frame": np.array([293.0, 294.0])}, "a.csv")
    again = pickle.loads(pickle.dumps(log))  # noqa: S301
    assert again.at("frame", 0.5) == 293.5
    assert again.names("frame")
    assert not again.names("tool")


@pytest.mark.parametrize("time", [-1e-9, 1.0 + 1e-9, np.nan])
def test_no_time_outside_the_log_is_guessed(time: float) -> None:
    log = TemperatureLog(np.array([0.0, 1.0]), {"frame": np.array([293.0, 294.0])})
    assert log.at("frame", [0.0, 1.0]).tolist() == [293.0, 294.0]
    with pytest.raises(RequestError) as caught:
        log.at("frame", [0.5, time])
    (problem,) = caught.value.problems
    assert problem.code == "outside-log"
    assert "from 0 s to 1 s" in str(problem)


def test_a_time_of_the_file_outside_its_log_is_an_error_of_the_file(tmp_path: Path) -> None:
    text = edited(LOGGED, ("[workspace]", 'time = "21 min"\n[workspace]'))
    with pytest.raises(MachineFileError) as caught:
        load(tmp_path, LOG, text=text)
    (problem,) = caught.value.problems
    assert problem.code == "outside-log"
    assert problem.line == line_of(text, "time = ")
    assert problem.found == "21 min"
    assert problem.expected == "a time from 0 min to 20 min"


@pytest.mark.parametrize(
    ("code", "edit", "line", "words"),
    [
        ("time-backwards", ("20, 25", "5, 25"), 4, "5 min after 10 min in line 3"),
        ("time-backwards", ("20, 25", "10, 25"), 4, "the time stands still"),
        ("not-positive", ("10, 24", "10, -300"), 3, "absolute zero"),
        ("unknown-column", ("strut.1", "strut.3"), 1, "did you mean"),
        ("no-unit", ("strut.1 (degC)", "strut.1"), 1, '"strut.1 (degC)"'),
        ("ragged-row", ("20, 25, 44", "20, 25"), 4, "2 cells"),
        ("missing-column", ("time (min), ", ""), 1, '"time (s)"'),
    ],
)
def test_a_bad_log(code: str, edit: tuple[str, str], line: int, words: str, tmp_path: Path) -> None:
    log = edited(LOG, edit)
    if code == "missing-column":
        log = "default (degC)\n20\n"
    (problem,) = problems_of(tmp_path, log)
    assert problem.code == code
    assert problem.file == str(tmp_path / "log.csv")
    assert problem.line == line
    assert words in str(problem)


def test_a_log_has_a_temperature(tmp_path: Path) -> None:
    (problem,) = problems_of(tmp_path, "time (s)\n0\n1\n")
    assert problem.code == "missing-column"
    assert "no temperature" in str(problem)


def test_problems_of_machine_file_and_log_together(tmp_path: Path) -> None:
    text = edited(LOGGED, ("grid = { x = [200, 400, 5], y = [100, 300, 3] }", 'poses = "no.csv"'))
    (tmp_path / "log.csv").write_text("time\n0\n", encoding="utf-8")
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    assert {problem.code for problem in caught.value.problems} == {"file-missing", "no-unit"}


def test_a_part_has_one_temperature(tmp_path: Path) -> None:
    text = edited(
        LOGGED, ("[workspace]", 'temperature = { "strut.1" = 30, "strut.2" = 31 }\n[workspace]')
    )
    with pytest.raises(MachineFileError) as caught:
        load(tmp_path, LOG, text=text)
    (problem,) = caught.value.problems
    assert problem.code == "excluding-keys"
    assert problem.line == line_of(text, "temperature = {")
    assert "the column strut.1 of log.csv" in str(problem)
    # Beside the default of the log a part may be at another temperature.
    log = "time (min), default (degC)\n0, 20\n20, 25\n"
    machine = load(tmp_path, log, text=text)
    assert machine.condition.temperature("strut.2", [0.0]) == pytest.approx(304.15)
    assert machine.condition.temperature("frame") == pytest.approx(298.15)


@pytest.mark.parametrize("key", ["temperature", "temperature.default"])
def test_a_setting_that_the_log_goes_before_is_refused(key: str, tmp_path: Path) -> None:
    (problem,) = problems_of(tmp_path, LOG, f"condition.{key}=28")
    assert problem.code == "excluding-keys"
    assert f"given by --set condition.{key}=28" in str(problem)
    assert "the column default of log.csv" in str(problem)
    # Beside a log of some parts it is that of the others.
    some = "time (min), strut.1 (degC)\n0, 20\n20, 44\n"
    machine = load(tmp_path, some, f"condition.{key}=28")
    assert machine.condition.temperature("strut.1") == pytest.approx(317.15)
    assert machine.condition.temperature("frame") == pytest.approx(301.15)


def test_the_default_of_a_log_goes_before_that_of_the_file(tmp_path: Path) -> None:
    settings = [[], ["condition.temperature_log=log.csv"]]
    texts = [edited(LOGGED, ("[workspace]", "temperature = 28\n[workspace]")), PLANAR]
    for text, given in zip(texts, settings, strict=True):
        machine = load(tmp_path, LOG, *given, text=text)
        assert machine.condition.temperature("frame") == pytest.approx(298.15)


@pytest.mark.parametrize(
    ("times", "temperatures", "words"),
    [
        ([], [], "no list"),
        ([[0.0, 1.0]], [[1.0, 2.0]], "no list"),
        ([0.0, np.inf], [293.0, 294.0], "no list"),
        ([1.0, 0.0], [293.0, 294.0], "do not ascend"),
        ([0.0, 0.0], [293.0, 294.0], "do not ascend"),
        ([0.0, 1.0], [293.0], "shape (1,)"),
        ([0.0, 1.0], [293.0, 0.0], "above absolute zero"),
        ([0.0, 1.0], [293.0, np.nan], "above absolute zero"),
    ],
)
def test_a_log_made_by_hand_is_checked_too(
    times: list[float], temperatures: list[float], words: str
) -> None:
    with pytest.raises(RequestError) as caught:
        TemperatureLog(np.array(times), {"frame": np.array(temperatures)})
    (problem,) = caught.value.problems
    assert problem.code == "bad-condition"
    assert words in str(problem)
