"""Every distribution that a tolerance may state, in the file; and correlated tolerances."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.stats

import truepose as tp
from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError
from truepose.machine import Machine
from truepose.probability.distributions import discrete, empirical, student_t
from truepose.sources import ARCSINE, TWO_POINT, Deviation, Distribution, normal

MM = 1e-3
PAIR = '"strut.*.base.x" = 0.1'


def bands(machine: Machine) -> Deviation:
    (found,) = (source for source in machine.sources if source.name == "tolerance")
    return found.bands


def with_lines(*lines: str, then: str = "", text: str = PLANAR) -> str:
    """`[tolerance]` of some lines, and whole tables after it."""
    table = "[tolerance]\n" + "\n".join(lines) + "\n" + then
    return edited(text, ("[workspace]", table + "\n[workspace]"))


def correlated(*rows: str, lines: tuple[str, ...] = (PAIR,)) -> str:
    return with_lines(*lines, then="\n".join(f"[[correlation]]\n{row}" for row in rows))


def one(machine: Machine, name: str) -> tuple[float, float, Distribution]:
    """Shift and half in mm, and the distribution."""
    found = bands(machine)
    column = found.parameters.tolist().index(machine.parameters.index(name))
    shift, half = found.shift[0, column] / MM, found.half[0, column] / MM
    return shift, half, found.distribution[column]


@pytest.mark.parametrize(
    ("written", "shift", "half", "distribution"),
    [
        ('{ band = [-0.1, 0.3], distribution = "arcsine" }', 0.1, 0.2, ARCSINE),
        ('{ band = 0.1, distribution = "two-point" }', 0.0, 0.1, TWO_POINT),
        ('{ band = 0.1, distribution = "student-t", dof = 4 }', 0.0, 0.1, student_t(4)),
        (
            '{ standard_deviation = "10 um", distribution = "student-t", dof = 4.5, sigmas = 2 }',
            0.0, 0.02, student_t(4.5, 2),
        ),
        # Of 10 readings with s = 4 um: the mean has a scale of 4 um / sqrt(10); std = scipy's.
        (
            '{ scale = "1.264911064067352 um", dof = 9 }',
            0.0, 3.0 * scipy.stats.t(9, scale=4e-3 / 10**0.5).std(), student_t(9),
        ),
        (
            '{ scale = 0.2, distribution = "student-t", dof = 2.5, sigmas = 2 }',
            0.0, 2.0 * scipy.stats.t(2.5, scale=0.2).std(), student_t(2.5, 2),
        ),
        (
            '{ values = [0, "100 um", 0.5], probabilities = [0.5, 0.3, 0.2] }',
            0.13, 0.37, discrete([0, 1, 5], [0.5, 0.3, 0.2]).distribution,
        ),
        (
            '{ values = [0.1, 0.2, 0.6], distribution = "empirical" }',
            0.3, 0.3, empirical([1, 2, 6]).distribution,
        ),
        ("{ values = [0.2] }", 0.2, 0.0, empirical([1]).distribution),
    ],
)  # fmt: skip
def test_every_distribution_of_the_file(
    tmp_path: Path, written: str, shift: float, half: float, distribution: Distribution
) -> None:
    machine = load_text(tmp_path, with_lines(f'"tool.x" = {written}'))
    found_shift, found_half, found = one(machine, "tool.x")
    assert (found_shift, found_half) == pytest.approx((shift, half), abs=1e-12)
    assert (found.name, found.dof) == (distribution.name, distribution.dof)
    assert found.sigmas == pytest.approx(distribution.sigmas, rel=1e-12)
    assert found.values == pytest.approx(distribution.values, abs=1e-12)
    assert found.probabilities == distribution.probabilities


def test_measured_deviations_of_a_file(tmp_path: Path) -> None:
    (tmp_path / "measured.csv").write_text("deviation (um)\n10\n-20\n30\n40\n")
    for text in (
        with_lines('"tool.x" = { data = "measured.csv" }'),
        with_lines('"tool.x" = { data = "measured.csv", distribution = "empirical" }'),
    ):
        machine = load_text(tmp_path, text)
        shift, half, distribution = one(machine, "tool.x")
        assert (shift, half) == pytest.approx((0.015, 0.035), abs=1e-12)
        assert distribution.sigmas == pytest.approx(35.0 / np.std([10, -20, 30, 40]), rel=1e-12)
        assert list(machine.data_files) == ["measured.csv"]
    length = edited(PLANAR, ("[-0.3, 0.3]", '{ data = "measured.csv" }'))
    shift, half, _ = one(load_text(tmp_path, length), "strut.1.length")
    assert (shift, half) == pytest.approx((0.015, 0.035), abs=1e-12)


def test_the_uncertainty_is_that_of_the_values(tmp_path: Path) -> None:
    values = [-0.1, 0.0, 0.0, 0.3]
    written = f"{{ values = {values} }}"
    found = tp.budget(load_text(tmp_path, edited(PLANAR, ("[-0.3, 0.3]", written))))
    alone = tp.budget(load_text(tmp_path, PLANAR))
    ratio = np.std(values) / (0.3 / np.sqrt(3.0))
    # The slopes are those about their mean, 50 um off.
    assert np.allclose(found.uncertainty[:, 0], ratio * alone.uncertainty[:, 0], rtol=5e-4)


@pytest.mark.parametrize(
    ("written", "code", "words"),
    [
        ('band = 1, distribution = "student-t"', "missing-key", "no dof"),
        ("band = 1, dof = 4", "excluding-keys", "uniform"),
        ('band = 1, distribution = "student-t", dof = 2', "too-few-degrees-of-freedom", "above 2"),
        ("scale = 1, dof = 2", "too-few-degrees-of-freedom", "above 2"),
        ("scale = 1", "missing-key", "no dof"),
        ("scale = -1, dof = 4", "negative", "scale: a scale is zero or more"),
        ("scale = [-1, 1], dof = 4", "wrong-type", "scale: "),
        ('scale = "1 N", dof = 4', "wrong-dimension", "scale: expected a length"),
        ('scale = 1, distribution = "normal"', "excluding-keys", 'distribution = "normal"'),
        ("scale = 1, standard_deviation = 1, dof = 4", "excluding-keys",
         "standard_deviation and scale"),
        ("scale = 1, band = 1, dof = 4", "excluding-keys", "band and scale"),
        ("scale = 1, values = [1]", "excluding-keys", "scale and values"),
        ('band = 1, distribution = "student-t", dof = inf', "not-finite", "dof"),
        ('band = 1, distribution = "student-t", dof = "4"', "wrong-type", "a plain number"),
        ('band = 1, distribution = "arcsine", sigmas = 2', "excluding-keys", "student-t"),
        ('band = 1, distribution = "discrete"', "missing-key", "listed values"),
        ('values = [1], distribution = "uniform"', "excluding-keys", "listed values"),
        ("values = [1], band = 1", "excluding-keys", "band and values"),
        ('values = [1], data = "a.csv"', "excluding-keys", "values and data"),
        ("values = []", "wrong-type", "an empty one"),
        ("values = 0.1", "wrong-type", "values: expected a list of lengths"),
        ('values = ["1 N"]', "wrong-dimension", "values: expected a length"),
        ('values = [1, 2], distribution = "discrete"', "missing-key", "no probabilities"),
        ("band = 1, probabilities = [1]", "excluding-keys", "uniform"),
        ('values = [1], probabilities = [1], distribution = "empirical"', "excluding-keys",
         "empirical"),
        ("values = [1, 2], probabilities = [0.5, 0.4]", "bad-distribution", "add up to 0.9"),
        ("values = [1, 2], probabilities = [1.5, -0.5]", "bad-distribution", "-0.5"),
        ("values = [1, 2], probabilities = [1]", "bad-distribution", "2 values, but 1"),
        ("values = [1, 2], probabilities = 1", "wrong-type", "probabilities: expected a list"),
        ('values = [1, 2], probabilities = ["a", 1]', "wrong-type", "a plain number"),
        ("data = 3", "wrong-type", "name of a CSV file"),
        ('data = "a.csv", probabilities = [1]', "excluding-keys", "is an empirical"),
        ('data = "nothing.csv"', "file-missing", "nothing.csv"),
    ],
)  # fmt: skip
def test_what_the_table_may_not_say(tmp_path: Path, written: str, code: str, words: str) -> None:
    line = f'"tool.x" = {{ {written} }}'
    text = with_lines(line)
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    (problem,) = caught.value.problems
    assert problem.code == code
    assert problem.line == line_of(text, line)
    assert words in str(problem)


def test_a_wrong_data_file_is_told_with_its_own_line(tmp_path: Path) -> None:
    (tmp_path / "measured.csv").write_text("deviation (N)\n10\n")
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, with_lines('"tool.x" = { data = "measured.csv" }'))
    (problem,) = caught.value.problems
    assert problem.code == "wrong-dimension"
    assert problem.file is not None
    assert problem.file.endswith("measured.csv")


def test_a_group_of_listed_values_is_one_variable(tmp_path: Path) -> None:
    written = '{ values = [0.0, 0.1, 0.5], group = "batch" }'
    machine = load_text(tmp_path, with_lines(f'"strut.*.base.x" = {written}'))
    found = bands(machine)
    assert found.group_names == {0: "batch"}
    assert np.count_nonzero(found.groups == 0) == 2


# --- correlation


def coefficients(machine: Machine) -> dict[frozenset[str], float]:
    """Those that are not 0, by the parameters that the variables move first."""
    found = bands(machine)
    if found.correlation is None:
        return {}
    names = [""] * found.n_variable
    for column, number in reversed(list(zip(found.parameters, found.variables, strict=True))):
        names[number] = machine.parameters[column]
    return {
        frozenset((names[i], names[j])): float(found.correlation[i, j])
        for i in range(len(names))
        for j in range(i)
        if found.correlation[i, j] != 0.0
    }


def test_every_two_variables_named_have_the_coefficient(tmp_path: Path) -> None:
    machine = load_text(
        tmp_path,
        correlated(
            'between = ["strut.*.base.x", "tool.x"]\ncoefficient = 0.5',
            'between = ["tool.y", "strut.1.length"]\ncoefficient = -0.25',
            lines=(PAIR, '"tool.*" = 0.2'),
        ),
    )
    assert coefficients(machine) == {
        frozenset(("strut.1.base.x", "strut.2.base.x")): 0.5,
        frozenset(("strut.1.base.x", "tool.x")): 0.5,
        frozenset(("strut.2.base.x", "tool.x")): 0.5,
        frozenset(("strut.1.length", "tool.y")): -0.25,
    }


def test_a_group_is_one_variable(tmp_path: Path) -> None:
    lines = (
        '"strut.*.base.x" = { band = 0.1, group = "batch A" }',
        '"drive.*.offset" = { band = 0.1, group = "batch B" }',
        '"tool.x" = 0.1',
    )
    expected = {frozenset(("strut.1.base.x", "drive.d1.offset")): 0.7}
    for between in ('"batch A", "batch B"', '"strut.1.base.x", "drive.*.offset"'):
        text = correlated(f"between = [{between}]\ncoefficient = 0.7", lines=lines)
        assert coefficients(load_text(tmp_path, text)) == expected


def test_a_matrix_states_each_pair(tmp_path: Path) -> None:
    """Below the diagonal, in the order of the names, whatever that of the parameters is."""
    lines = (PAIR, '"tool.?" = 0.1', '"drive.*.offset" = { band = 0.1, group = "batch" }')
    row = (
        'between = ["tool.x", "batch", "strut.1.base.x"]\n'
        "matrix = [[0.25], [-0.1234567890123456, 0.5]]"
    )
    assert coefficients(load_text(tmp_path, correlated(row, lines=lines))) == {
        frozenset(("tool.x", "drive.d1.offset")): 0.25,
        frozenset(("tool.x", "strut.1.base.x")): -0.1234567890123456,
        frozenset(("strut.1.base.x", "drive.d1.offset")): 0.5,
    }


def test_all_that_is_wrong_with_a_matrix_is_said_at_once(tmp_path: Path) -> None:
    row = 'between = ["strut.[1].base.x", "strut.2.base.x"]\nmatrix = [[2], [0.5]]'
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, correlated(row))
    assert {problem.code for problem in caught.value.problems} == {
        "correlation-matrix-shape",
        "bad-correlation",
        "correlation-pattern",
    }


def test_lengths_of_telescopic_struts_are_their_drives_offsets(tmp_path: Path) -> None:
    text = edited(HEXAPOD, ("[workspace]", "[tolerance]\n" + '"drive.*.offset" = 0.1\n'
                  '[[correlation]]\nbetween = ["drive.*.offset"]\ncoefficient = 0.9\n'
                  "[workspace]"))  # fmt: skip
    assert len(coefficients(load_text(tmp_path, text))) == 15


def test_the_budget_s_uncertainty_heeds_it_and_the_worst_case_does_not(tmp_path: Path) -> None:
    """With all of one sign, the coefficient takes the sum of squares to the square of a sum."""
    lines = ('"drive.*.origin.y" = 0.05',)
    bare = edited(PLANAR, ("length_tolerance = [-0.3, 0.3]\n", ""))

    def found(coefficient: float | None) -> object:
        row = f'[[correlation]]\nbetween = ["drive.*.origin.y"]\ncoefficient = {coefficient}\n'
        text = with_lines(*lines, then="" if coefficient is None else row, text=bare)
        return load_text(tmp_path, text)

    machine = found(None)
    alone = tp.budget(machine).sel(source="tolerance")
    each = bands(machine)
    sensitivity = machine.sensitivity(machine.poses())[:, :, each.parameters]
    effects = sensitivity * each.half / np.sqrt(3.0)
    for coefficient in (0.6, -1.0, 1.0, 0.0):
        together = found(coefficient)
        budget = tp.budget(together).sel(source="tolerance")
        product = 2.0 * coefficient * effects[..., 0] * effects[..., 1]
        variance = np.square(effects).sum(axis=2) + product
        assert np.allclose(budget.uncertainty**2, variance, rtol=1e-9, atol=1e-22)
        # Correlated variables go by their effects, others closure by closure: up to rounding.
        assert np.allclose(budget.worst, alone.worst, rtol=1e-14, atol=0.0)
        assert np.array_equal(tp.compensate(together).bound, tp.compensate(machine).bound)


@pytest.mark.parametrize(
    ("rows", "code", "words"),
    [
        (('between = ["strut.*.base.x"]\ncoefficient = 1.1',), "bad-correlation", "1.1"),
        (('between = ["strut.*.base.x"]\ncoefficient = nan',), "bad-correlation", "from -1"),
        (('between = ["strut.*.base.x"]',), "missing-key", "coefficient"),
        (('between = []\ncoefficient = 0.5',), "wrong-type", "between"),
        (('between = "strut.*.base.x"\ncoefficient = 0.5',), "wrong-type", "a list"),
        (('between = ["strut.*.base.x"]\ncoeficient = 0.5',), "unknown-key", "coefficient"),
        (('between = ["strut.*.base.x", "strut.1.bas.x"]\ncoefficient = 0.5',),
         "correlation-matches-nothing", "strut.1.base.x"),
        (('between = ["strut.*.base.x", "tool.x"]\ncoefficient = 0.5',),
         "correlation-matches-nothing", "tool.x has no tolerance"),
        (('between = ["strut.1.base.x"]\ncoefficient = 0.5',), "correlation-too-few", "1 variable"),
        (('between = ["drive.*.offset"]\ncoefficient = 0.5',), "correlation-too-few", "'batch'"),
        (('between = ["drive.1.offset", "batch"]\ncoefficient = 0.5',), "correlation-twice",
         "one variable"),
        (('between = ["strut.1.base.x", "strut.*.base.x"]\ncoefficient = 0.5',),
         "correlation-twice", "one variable"),
        (('between = ["strut.*.base.x"]\ncoefficient = 0.5',
          'between = ["strut.2.base.x", "strut.1.base.x"]\ncoefficient = 0.5'),
         "correlation-twice", "correlation.#2 and in correlation.#1"),
        (('between = ["strut.*.base.x", "batch"]\ncoefficient = -0.6',),
         "correlation-not-semidefinite", "times 0.833 would hold"),
        (('between = ["strut.1.base.x", "strut.2.base.x"]\ncoefficient = 0.5\nmatrix = [[0.5]]',),
         "excluding-keys", "coefficient and matrix"),
        (('between = ["strut.1.base.x", "strut.2.base.x"]\nmatrix = 0.5',), "wrong-type", "a list"),
        (('between = ["strut.1.base.x", "strut.2.base.x"]\nmatrix = [["1"]]',), "wrong-type",
         "text"),
        (('between = ["strut.1.base.x", "strut.2.base.x"]\nmatrix = [[-1.5]]',), "bad-correlation",
         "strut.2.base.x: a correlation"),
        (('between = ["strut.1.base.x", "strut.2.base.x", "batch"]\nmatrix = [[0.5]]',),
         "correlation-matrix-shape", "1 row for 3 names"),
        (('between = ["strut.1.base.x", "strut.2.base.x", "batch"]\nmatrix = [[0.5], [0, 0, 1]]',),
         "correlation-matrix-shape", "row 2 (batch) has 3 coefficients"),
        (('between = ["strut.1.base.x", "drive.1.*"]\nmatrix = [[0.5]]',),
         "correlation-pattern", "drive.d1.*"),
        (('between = ["batch", "drive.2.offset"]\nmatrix = [[0.5]]',),
         "correlation-twice", "one variable"),
        (('between = ["strut.1.base.x"]\nmatrix = []',), "correlation-too-few", "1 variable"),
        (('between = ["strut.*.base.x"]\ncoefficient = 0.5',
          'between = ["strut.2.base.x", "strut.1.base.x"]\nmatrix = [[0.5]]'),
         "correlation-twice", "correlation.#2 and in correlation.#1"),
        (('between = ["batch", "strut.2.base.x", "strut.1.base.x"]\n'
          "matrix = [[0.9], [0.9, -0.9]]",),
         "correlation-not-semidefinite", "would hold"),
    ],
)  # fmt: skip
def test_what_a_correlation_may_not_say(
    tmp_path: Path, rows: tuple[str, ...], code: str, words: str
) -> None:
    lines = (PAIR, '"drive.*.offset" = { band = 0.1, group = "batch" }')
    for number in "12":
        rows = tuple(row.replace(f"drive.{number}.", f"drive.d{number}.") for row in rows)
    text = correlated(*rows, lines=lines)
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    (problem,) = caught.value.problems
    assert problem.code == code
    assert problem.line is not None
    assert problem.line >= line_of(text, "[[correlation]]")
    assert words.replace("'", "") in str(problem).replace("'", "")


def test_which_variables_clash(tmp_path: Path) -> None:
    lines = (PAIR, '"tool.*" = 0.1')
    rows = (
        'between = ["strut.1.base.x", "strut.2.base.x"]\ncoefficient = 0.9',
        'between = ["strut.1.base.x", "tool.x"]\ncoefficient = 0.9',
        'between = ["strut.2.base.x", "tool.x"]\ncoefficient = -0.9',
        'between = ["tool.x", "tool.y"]\ncoefficient = 0.1',
    )
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, correlated(*rows, lines=lines))
    (problem,) = caught.value.problems
    for name in ("strut.1.base.x", "strut.2.base.x", "tool.x"):
        assert name in problem.message
    assert "tool.y" not in problem.message
    assert "-0.8" in str(problem.found)


def test_correlations_without_a_tolerance(tmp_path: Path) -> None:
    text = edited(
        PLANAR,
        ("length_tolerance = [-0.3, 0.3]\n", ""),
        ("[workspace]", '[[correlation]]\nbetween = ["tool.?"]\ncoefficient = 0.5\n[workspace]'),
    )
    with pytest.raises(MachineFileError, match="correlation-matches-nothing"):
        load_text(tmp_path, text)


def test_a_single_table_is_told_to_be_one_of_several(tmp_path: Path) -> None:
    text = edited(PLANAR, ("[workspace]", "[correlation]\ncoefficient = 0.5\n[workspace]"))
    with pytest.raises(MachineFileError, match=r"\[\[correlation\]\]"):
        load_text(tmp_path, text)


def test_a_coefficient_may_be_set(tmp_path: Path) -> None:
    file = tmp_path / "machine.toml"
    file.write_text(correlated('between = ["strut.*.base.x"]\ncoefficient = 0.5'))
    machine = tp.load(file, settings=["correlation.#1.coefficient=-0.5"])
    assert set(coefficients(machine).values()) == {-0.5}
    with pytest.raises(MachineFileError, match="given by --set"):
        tp.load(file, settings=["correlation.#1.coefficient=2"])


def test_a_normal_and_a_uniform_one_may_be_correlated(tmp_path: Path) -> None:
    lines = ('"tool.x" = { standard_deviation = 0.1 }', '"tool.y" = 0.1')
    text = correlated('between = ["tool.?"]\ncoefficient = 0.5', lines=lines)
    machine = load_text(tmp_path, text)
    assert normal(3.0) in bands(machine).distribution
    assert list(coefficients(machine).values()) == [0.5]
