"""The tolerance source: bands of the file become deviations, and what the file may not say."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import numpy as np
import pytest

from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError
from truepose.machine import Machine
from truepose.sources import UNIFORM, Deviation
from truepose.sources.tolerance import Tolerance

TABLE = "[condition]"


def bands(machine: Machine) -> Deviation:
    (found,) = (source for source in machine.sources if source.name == "tolerance")
    return cast("Tolerance", found).bands


def with_table(*lines: str, text: str = PLANAR) -> str:
    return edited(text, ("[workspace]", "[tolerance]\n" + "\n".join(lines) + "\n[workspace]"))


def by_name(machine: Machine) -> dict[str, tuple[float, float]]:
    """Shift and half band of each parameter, in mm, mrad or 1e-3."""
    found = bands(machine)
    names = [machine.parameters[column] for column in found.parameters]
    assert len(set(names)) == len(names)
    return {
        name: (pytest.approx(1e3 * shift, abs=1e-12), pytest.approx(1e3 * half, abs=1e-12))
        for name, shift, half in zip(names, found.shift[0], found.half[0], strict=True)
    }


def test_an_asymmetric_band_is_a_shift_and_a_half_band(tmp_path: Path) -> None:
    text = edited(PLANAR, ("[-0.3, 0.3]", "[-0.15, 0.45]"))
    assert by_name(load_text(tmp_path, text)) == {"strut.1.length": (0.15, 0.30)}
    assert bands(load_text(tmp_path, text)).edge.tolist() == [True]
    assert bands(load_text(tmp_path, text)).distribution == (UNIFORM,)


@pytest.mark.parametrize(
    ("written", "half"),
    # 500 mm: ISO 2768-1 f above 400 up to 1000 mm, ISO 286-1 IT14 above 400 up to 500 mm.
    [("0.2", 0.2), ('"+-0.02 in"', 0.508), ('"ISO 2768-f"', 0.3), ('"IT14"', 1.55 / 2)],
)
def test_every_way_to_write_a_band(tmp_path: Path, written: str, half: float) -> None:
    text = edited(PLANAR, ("[-0.3, 0.3]", written))
    assert by_name(load_text(tmp_path, text)) == {"strut.1.length": (0.0, half)}


def test_a_telescopic_strut_s_length_is_its_drive_s_offset(tmp_path: Path) -> None:
    text = edited(HEXAPOD, ('name = "3"', 'name = "3"\nlength_tolerance = "ISO 2768-m"'))
    machine = load_text(tmp_path, text)
    # At home the strut is 677 mm long: ISO 2768-1 m above 400 up to 1000 mm.
    assert by_name(machine) == {"drive.d3.offset": (0.0, 0.8)}
    assert bands(machine).edge.tolist() == [True]


def test_patterns_move_any_parameter_in_the_unit_of_its_dimension(tmp_path: Path) -> None:
    machine = load_text(
        tmp_path,
        with_table('"strut.*.base.?" = 0.05', '"drive.d1.axis.u" = [0, 0.1]', '"tool.x" = 0.1'),
    )
    found = by_name(machine)
    assert found.pop("strut.1.length") == (0.0, 0.3)
    mrad = 1e3 * np.deg2rad(0.05)
    assert found.pop("drive.d1.axis.u") == (mrad, mrad)
    assert found.pop("tool.x") == (0.0, 0.1)
    assert found == {f"strut.{n}.base.{axis}": (0.0, 0.05) for n in "12" for axis in "xyz"}
    # Only lengths and offsets go to the edges.
    at_edge = bands(machine).at_edge(1.0)[0] != bands(machine).shift[0]
    assert [machine.parameters[c] for c in bands(machine).parameters[at_edge]] == ["strut.1.length"]


def test_a_full_name_goes_before_a_pattern_wherever_it_stands(tmp_path: Path) -> None:
    lines = ('"strut.*.length" = 0.1', '"strut.2.base.x" = 0.4', '"strut.*.base.x" = 0.05')
    for order in (lines, lines[::-1]):
        assert by_name(load_text(tmp_path, with_table(*order))) == {
            "strut.1.length": (0.0, 0.3),  # the strut's own length_tolerance
            "strut.2.length": (0.0, 0.1),
            "strut.1.base.x": (0.0, 0.05),
            "strut.2.base.x": (0.0, 0.4),
        }


def test_a_class_goes_by_the_size_of_the_parameter(tmp_path: Path) -> None:
    found = by_name(load_text(tmp_path, with_table('"drive.d2.origin.x" = "ISO 2768-f"')))
    assert found["drive.d2.origin.x"] == (0.0, 0.3)  # 600 mm


@pytest.mark.parametrize(
    ("lines", "code", "at", "words"),
    [
        (('"strut.*.lenght" = 0.1',), "tolerance-matches-nothing", 0, "strut.*.length"),
        (('"drive.d3.offset" = 0.1',), "tolerance-matches-nothing", 0, "drive.d"),
        (('"strut.1.length" = 0.1',), "tolerance-twice", 0, "length_tolerance"),
        (('"*.base.x" = 0.1', '"strut.*.x" = 1'), "tolerance-twice", 1, "strut.1.base.x"),
        (('"tool.x" = "0.1 N"',), "wrong-dimension", 0, "a length"),
        (('"drive.d1.axis.u" = "ISO 2768-f"',), None, 0, "ISO 2768-f"),
        (('"strut.1.base.x" = "IT7"',), "tolerance-out-of-range", 0, "0 mm"),
        (('"strut.1.base.x" = [0.2, 0.1]',), "tolerance-reversed", 0, "0.2"),
    ],
)
def test_what_the_table_may_not_say(
    tmp_path: Path, lines: tuple[str, ...], code: str | None, at: int, words: str
) -> None:
    text = with_table(*lines)
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    first = caught.value.problems[0]
    assert code is None or {problem.code for problem in caught.value.problems} == {code}
    assert first.line == line_of(text, lines[at])
    assert words in str(first)


def test_a_pattern_that_is_wrong_is_one_problem_not_one_for_each_parameter(tmp_path: Path) -> None:
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, with_table('"strut.*.base.*" = "0.1 N"'))
    assert len(caught.value.problems) == 1


def test_no_tolerance_is_no_source(tmp_path: Path) -> None:
    machine = load_text(tmp_path, edited(PLANAR, ("length_tolerance = [-0.3, 0.3]\n", "")))
    assert "tolerance" not in {source.name for source in machine.sources}
