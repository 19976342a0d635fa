"""The thermal source: expansion times temperature rise times present length."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError, TrueposeError
from truepose.machine import Machine
from truepose.sources import acting
from truepose.sources.thermal import Thermal

EXPANSION = "1.1e-5 1/K"


def shifts(machine: Machine, condition: tp.Condition) -> tuple[np.ndarray, np.ndarray]:
    """Growth of the struts at the home pose by the source, and their lengths there, m."""
    from truepose.runs.poses import PoseRun

    at = [machine.dof.index(name) for name in machine.commanded]
    (block,) = PoseRun(machine, machine.home[at][np.newaxis, :], condition)
    deviation = Thermal(requested=True).deviation(machine, condition, block)
    assert np.array_equal(deviation.parameters, machine.kernel.length_parameters)
    assert not deviation.half.any()
    return deviation.shift[0], block.lengths[0]


def test_a_warm_strut_is_longer(tmp_path: Path) -> None:
    machine = load_text(
        tmp_path,
        edited(PLANAR, ('material = "steel"', f'modulus = "210 GPa"\nexpansion = "{EXPANSION}"')),
    )
    found, lengths = shifts(machine, machine.condition)
    assert np.allclose(lengths, 0.5, rtol=1e-12)
    assert np.allclose(found, 1.1e-5 * 15 * 0.5, rtol=1e-12)


def test_each_strut_has_its_own_temperature_and_a_telescopic_one_its_present_length(
    tmp_path: Path,
) -> None:
    text = HEXAPOD.replace("platform = [", f'expansion = "{EXPANSION}"\nplatform = [')
    machine = load_text(tmp_path, text)
    condition = machine.condition.replace(temperature={"default": 293.15, "strut.2": 303.15})
    found, lengths = shifts(machine, condition)
    assert 0.65 < lengths.min() < lengths.max() < 0.75
    expected = np.zeros(6)
    expected[1] = 1.1e-5 * 10 * lengths[1]
    assert np.allclose(found, expected, rtol=1e-9, atol=1e-18)


def test_it_acts_where_the_file_asks_or_the_condition_leaves_the_reference(tmp_path: Path) -> None:
    named = [source.name for source in acting(load_text(tmp_path, PLANAR))]
    assert named == ["tolerance", "thermal", "elastic"]
    # Asked for by the file, were it at the reference: a row of zeros.
    cold = load_text(tmp_path, PLANAR, "condition.temperature=20")
    errors = tp.budget(cold).error.sel(source="thermal")
    assert not errors.values.any()
    silent = load_text(tmp_path, edited(PLANAR, ("temperature = 35\n", "")))
    assert "thermal" not in {source.name for source in acting(silent)}
    warm = silent.condition.replace(temperature=308.15)
    assert "thermal" in {source.name for source in acting(silent, warm)}
    both = tp.budget(silent, condition=warm).error.sel(source="thermal")
    asked = tp.budget(load_text(tmp_path, PLANAR)).error.sel(source="thermal")
    assert np.array_equal(both, asked)


def test_a_strut_that_does_not_say_how_it_expands_is_refused(tmp_path: Path) -> None:
    text = edited(PLANAR, (f'expansion = "{EXPANSION}"\n', ""))
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    (problem,) = caught.value.problems
    assert problem.code == "no-expansion"
    assert problem.line == line_of(text, "[[strut]]")
    # Nobody asks for it at the reference temperature.
    load_text(tmp_path, text, "condition.temperature=20")


def test_a_condition_that_asks_for_what_no_strut_says_is_refused(tmp_path: Path) -> None:
    machine = load_text(tmp_path, HEXAPOD)
    with pytest.raises(TrueposeError) as caught:
        tp.budget(machine, condition=machine.condition.replace(temperature={"strut.2": 300.0}))
    (problem,) = caught.value.problems
    assert problem.code == "no-expansion"
    assert problem.path == "strut.2"
    with pytest.raises(TrueposeError) as caught:
        tp.budget(machine, condition=machine.condition.replace(temperature=300.0))
    assert [problem.path for problem in caught.value.problems] == [
        f"strut.{n}" for n in range(1, 7)
    ]
