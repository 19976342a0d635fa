"""The tolerance source: bands of the file become deviations, and what the file may not say."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import numpy as np
import pytest

import truepose as tp
from build_machine import machine_files
from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError
from truepose.machine import Machine
from truepose.machine.parts import gives_way_only
from truepose.sources import OWN_GROUP, TRIANGULAR, UNIFORM, Deviation, normal
from truepose.sources.tolerance import DimensionalTolerance
from two_slider import displaced

TABLE = "[condition]"


def bands(machine: Machine) -> Deviation:
    (found,) = (source for source in machine.sources if source.name == "tolerance")
    return cast(DimensionalTolerance, found).bands


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


def test_a_pattern_that_names_its_part_goes_before_one_that_does_not(tmp_path: Path) -> None:
    lines = ('"strut.*.base.*" = 0.05', '"strut.2.base.*" = 0.2', '"strut.2.base.z" = 0.4')
    for order in (lines, lines[::-1]):
        found = by_name(load_text(tmp_path, with_table(*order)))
        assert found.pop("strut.1.length") == (0.0, 0.3)
        assert found == {
            **{f"strut.1.base.{axis}": (0.0, 0.05) for axis in "xyz"},
            "strut.2.base.x": (0.0, 0.2),
            "strut.2.base.y": (0.0, 0.2),
            "strut.2.base.z": (0.0, 0.4),
        }


@pytest.mark.parametrize(
    ("written", "half", "distribution"),
    [
        ("{ band = 0.05 }", 0.05, UNIFORM),
        ('{ band = [-0.05, 0.05], distribution = "uniform" }', 0.05, UNIFORM),
        ('{ band = "+-50 um", distribution = "triangular" }', 0.05, TRIANGULAR),
        ('{ band = 0.05, distribution = "normal" }', 0.05, normal(3)),
        ('{ band = 0.05, distribution = "normal", sigmas = 2 }', 0.05, normal(2)),
        ('{ standard_deviation = "4 um" }', 0.012, normal(3)),
        ('{ standard_deviation = "4 um", sigmas = 2 }', 0.008, normal(2)),
        ('{ standard_deviation = 0.004, distribution = "normal" }', 0.012, normal(3)),
    ],
)
def test_a_table_says_how_a_tolerance_is_distributed(
    tmp_path: Path, written: str, half: float, distribution: object
) -> None:
    machine = load_text(tmp_path, with_table(f'"drive.d2.offset" = {written}'))
    assert by_name(machine)["drive.d2.offset"] == (0.0, half)
    at = machine.parameters.index("drive.d2.offset")
    column = bands(machine).parameters.tolist().index(at)
    assert bands(machine).distribution[column] == distribution


def test_a_strut_s_tolerance_and_a_class_may_be_tables_too(tmp_path: Path) -> None:
    given = '{ band = "IT14", distribution = "triangular" }'
    machine = load_text(tmp_path, edited(PLANAR, ("[-0.3, 0.3]", given)))
    assert by_name(machine) == {"strut.1.length": (0.0, 1.55 / 2)}
    assert bands(machine).distribution == (TRIANGULAR,)


def test_what_is_distributed_otherwise_is_as_wide_but_not_as_uncertain(tmp_path: Path) -> None:
    found = [
        tp.budget(load_text(tmp_path, edited(PLANAR, ("[-0.3, 0.3]", given)))).sel(
            source="tolerance"
        )
        for given in ("0.3", '{ band = 0.3, distribution = "triangular" }')
    ]
    assert np.array_equal(found[0].worst, found[1].worst)
    assert np.allclose(found[0].uncertainty, 2**0.5 * found[1].uncertainty, rtol=1e-12)


def test_what_is_made_in_one_set_up_varies_together(tmp_path: Path) -> None:
    """Both rails' carriages off by one y move the tool by just that y; by opposite ones, not."""
    group = 'group = "one set-up"'
    text = edited(PLANAR, ("length_tolerance = [-0.3, 0.3]\n", ""))
    table = with_table(f'"drive.*.origin.y" = {{ band = 0.05, {group} }}', text=text)
    machine = load_text(tmp_path, table)
    assert len(set(bands(machine).variables.tolist())) == 1
    found = tp.budget(machine).sel(source="tolerance")
    assert np.allclose(found.worst, [0.0, 50e-6], rtol=1e-9, atol=1e-18)
    assert np.allclose(found.uncertainty, [0.0, 50e-6 / 3**0.5], rtol=1e-9, atol=1e-18)
    apart = with_table(
        f'"drive.d1.origin.y" = {{ band = 0.05, {group} }}',
        f'"drive.d2.origin.y" = {{ band = 0.05, {group}, sign = -1 }}',
        text=text,
    )
    machine = load_text(tmp_path, apart)
    assert bands(machine).signed_half[0].tolist() == pytest.approx([50e-6, -50e-6])
    most = np.abs(displaced(machine, machine.poses(), joints=np.array([50e-6, -50e-6])))
    found = tp.budget(machine).sel(source="tolerance")
    assert np.abs(found.worst - most).max() < 1e-3 * most.max()
    each = tp.budget(load_text(tmp_path, with_table('"drive.*.origin.y" = 0.05', text=text)))
    assert (each.sel(source="tolerance").worst >= found.worst - 1e-12).all()


def test_a_group_may_have_members_of_several_kinds_and_edges_of_its_lengths(tmp_path: Path) -> None:
    length = '{ band = 0.2, group = "a", sign = -1 }'
    machine = load_text(
        tmp_path,
        with_table(
            '"drive.d1.axis.u" = { band = "20 urad", group = "a" }',
            '"drive.d1.offset" = { band = 0.1, group = "a" }',
            '"tool.x" = { band = 0.3, group = "b" }',
            '"tool.y" = 0.3',
            text=edited(PLANAR, ("[-0.3, 0.3]", length)),
        ),
    )
    found = bands(machine)
    names = [machine.parameters[column] for column in found.parameters]
    groups = dict(zip(names, found.groups.tolist(), strict=True))
    assert groups["drive.d1.axis.u"] == groups["drive.d1.offset"] == groups["strut.1.length"]
    assert groups["tool.x"] not in (groups["strut.1.length"], OWN_GROUP)
    assert groups["tool.y"] == OWN_GROUP
    at_edge = dict(zip(names, found.at_edge(1.0)[0].tolist(), strict=True))
    assert at_edge["strut.1.length"] == pytest.approx(-0.2e-3)
    assert at_edge["drive.d1.offset"] == pytest.approx(0.1e-3)
    assert at_edge["drive.d1.axis.u"] == 0.0


@pytest.mark.parametrize("file", machine_files(), ids=lambda file: file.stem)
def test_every_parameter_of_every_machine_can_have_a_tolerance(file: Path) -> None:
    machine = tp.load(file)
    small = {"m": "1 um", "rad": "1 urad", "1": "1 ppm"}
    every = zip(machine.parameters, machine.units, strict=True)
    named = {name: unit for name, unit in every if not gives_way_only(name)}
    own = {f"strut.{strut.name}.length" for strut in machine.struts} | {
        f"{drive.part}.offset" for drive in machine.drives
    }
    settings = [
        f"tolerance.{name}={small[unit]}" for name, unit in named.items() if name not in own
    ]
    found = bands(tp.load(file, settings=settings))
    shown = {machine.parameters[column] for column in found.parameters}
    assert shown >= named.keys() - own
    given = [machine.parameters[column] in named.keys() - own for column in found.parameters]
    assert np.allclose(found.half[:, given], 1e-6, rtol=1e-12)


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
        (("strut.1.base.x = 0.2",), "tolerance-matches-nothing", 0, "in quotation marks"),
        (('"drive.d1.*" = 0.1',), "tolerance-mixes-kinds", 0, "lengths and angles"),
        (('"drive.d1.origin.*" = 0.1', '"drive.d1.*.x" = 1'), "tolerance-twice", 1, "origin.x"),
        (('"tool.x" = { bnd = 0.1 }',), "unknown-key", 0, 'did you mean "band"?'),
        (('"tool.x" = {}',), "missing-key", 0, "one of band, standard_deviation"),
        (('"tool.x" = { band = 1, standard_deviation = 1 }',), "excluding-keys", 0, "band and st"),
        (('"tool.x" = { band = 1, sigmas = 2 }',), "excluding-keys", 0, "normal"),
        (('"tool.x" = { standard_deviation = 1, distribution = "uniform" }',), "excluding-keys", 0,
         "of a normal or student-t distribution"),
        (('"tool.x" = { standard_deviation = -1 }',), "negative", 0, "standard_deviation: "),
        (('"tool.x" = { standard_deviation = "1 N" }',), "wrong-dimension", 0, "found a force"),
        (('"tool.x" = { band = "1 N" }',), "wrong-dimension", 0, "band: expected a length"),
        (('"tool.x" = { band = 1, distribution = "triangle" }',), "unknown-choice", 0,
         'did you mean "triangular"?'),
        (('"tool.x" = { band = 1, distribution = 3 }',), "wrong-type", 0, "distribution"),
        (('"tool.x" = { band = 1, distribution = "normal", sigmas = 0 }',), "not-positive", 0,
         "above zero"),
        (('"tool.x" = { band = 1, distribution = "normal", sigmas = inf }',), "not-finite", 0,
         "found:    inf"),
        (('"tool.x" = { band = 1, distribution = "normal", sigmas = "2" }',), "wrong-type", 0,
         "a plain number"),
        (('"tool.x" = { band = { band = 1 } }',), "wrong-type", 0, "band: expected a tolerance"),
        (('"tool.x" = { band = 1, sign = -1 }',), "missing-key", 0, "there is no group"),
        (('"tool.x" = { band = 1, group = "a", sign = 2 }',), "unknown-choice", 0, "1 or -1"),
        (('"tool.x" = { band = 1, group = " " }',), "bad-name", 0, "not empty"),
        (('"tool.x" = { band = 1, group = 3 }',), "wrong-type", 0, "group"),
        (('"tool.x" = { band = 1, group = "a" }',
          '"tool.y" = { band = 1, group = "a", distribution = "triangular" }'),
         "group-distributions", 1, "uniform of tolerance.tool.x"),
        (('"tool.x" = { standard_deviation = 1, group = "a" }',
          '"tool.y" = { standard_deviation = 1, sigmas = 2, group = "a" }'),
         "group-distributions", 1, "normal, 3 sigma"),
        (('"tool.x" = { band = "ISO 2768-q" }',), "unknown-tolerance-class", 0, "2768"),
        (('"drive.d2.origin.x" = { band = "IT0" }',), "tolerance-out-of-range", 0, "600 mm"),
    ],
)  # fmt: skip
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
