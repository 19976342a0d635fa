"""The calibrated machine as a file: it says what was found, and the author's text stays."""

from __future__ import annotations

import dataclasses
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from machine_texts import PLANAR, edited, load_text
from made_unknowns import PROVENANCE, MadeUnknowns, of_bands, posterior
from sweeps import thinned
from truepose.arrays import Floats
from truepose.calibration.identification.properties import properties_of
from truepose.calibration.result.bands import bands_of, tolerance_covariance
from truepose.calibration.result.directions import direction_at, directions
from truepose.calibration.result.file import write_calibrated
from truepose.errors import MachineFileError, RequestError
from truepose.machine import Machine, load
from truepose.sources import REGISTRY

MACHINES = Path(__file__).parents[3] / "machines"
MM = 1e-3


def filed(folder: Path, text: str, *settings: str) -> tuple[Path, Machine]:
    return folder / "machine.toml", load_text(folder, text, *settings)


def unknown(
    machine: Machine, *moves: dict[str, float], names: tuple[str, ...] = ()
) -> MadeUnknowns:
    """Unknowns that move parameters, one for each of `moves`."""
    columns = [machine.parameters.index(name) for move in moves for name in move]
    effects = np.zeros((len(columns), len(moves)))
    at = 0
    for number, move in enumerate(moves):
        for effect in move.values():
            effects[at, number] = effect
            at += 1
    return MadeUnknowns(
        names or tuple(next(iter(move)) for move in moves), np.array(columns), effects
    )


def write(
    folder: Path,
    original: Path,
    machine: Machine,
    unknowns: MadeUnknowns,
    values: list[float],
    covariance: Floats,
    **options: object,
) -> tuple[Machine, str]:
    options.setdefault("controller_holds", "calibrated")
    path = folder / "calibrated.toml"
    written = write_calibrated(
        path,
        machine,
        unknowns,
        np.array(values),
        covariance,
        PROVENANCE,
        original=original,
        **options,  # type: ignore[arg-type]
    )
    return written, path.read_text(encoding="utf-8")


def comments(text: str) -> list[str]:
    return [line[line.index("#") :].strip() for line in text.splitlines() if "#" in line]


def effects_of(machine: Machine, unknowns: MadeUnknowns) -> Floats:
    every = np.zeros((len(machine.parameters), unknowns.n_machine))
    np.add.at(every, unknowns.columns, unknowns.effects)
    return every


@pytest.mark.parametrize("holds", thinned(["calibrated", "drawing"]))
@pytest.mark.parametrize("path", sorted(MACHINES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_machine_comes_back(tmp_path: Path, path: Path, holds: str) -> None:
    machine = load(path, registry=REGISTRY)
    unknowns, deviations = of_bands(machine)
    random = np.random.default_rng(11)
    values = random.normal(size=len(deviations)) * deviations
    covariance = posterior(deviations, random, 1e-4)
    written, text = write(
        tmp_path, path, machine, unknowns, values, covariance, controller_holds=holds
    )
    original = path.read_text(encoding="utf-8")
    found = comments(text)
    for line in comments(original):
        found.remove(line)
    effects = effects_of(machine, unknowns)
    if holds == "drawing":
        assert np.array_equal(written.nominal, machine.nominal)
        shift = tolerance_covariance(written).shift
        assert np.allclose(shift, effects @ values, rtol=1e-9, atol=1e-15)
    else:
        _assert_values(machine, written, effects @ values)
        assert not tolerance_covariance(written).shift.any()
    # A direction counts from its new axis; its two angles together vary as much as before.
    spread, wanted = (
        np.diagonal(tolerance_covariance(written).covariance),
        effects @ covariance @ effects.T,
    )
    for each in directions(machine):
        at = list(each.columns)
        assert spread[at].sum() == pytest.approx(np.diagonal(wanted)[at].sum(), rel=1e-3)
    others = [at for at, name in enumerate(machine.parameters) if name[-2:] not in (".u", ".v")]
    assert np.allclose(spread[others], np.diagonal(wanted)[others], rtol=1e-9, atol=0.0)
    budget = tp.budget(written, machine.poses()[:20])
    assert np.isfinite(budget.uncertainty.sel(source="tolerance")).all()


def _assert_values(machine: Machine, written: Machine, deviation: Floats) -> None:
    axes = {each.columns: each.axis for each in directions(written)}
    rest = np.ones(len(deviation), np.bool_)
    for each in directions(machine):
        at = list(each.columns)
        assert np.allclose(axes[each.columns], direction_at(each.axis, deviation[at]), atol=4e-16)
        assert not written.nominal[at].any()
        rest[at] = False
    wanted = (machine.nominal + deviation)[rest]
    assert np.allclose(written.nominal[rest], wanted, rtol=1e-15, atol=0.0)
    # The same machine by its own kinematics: where the same joints take it.
    moved = machine.replace(dict(zip(machine.parameters, machine.nominal + deviation, strict=True)))
    home = machine.home[[machine.dof.index(freedom) for freedom in machine.commanded]]
    joints = machine.inverse(home)
    assert np.allclose(moved.forward(joints), written.forward(joints), rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("holds", ["calibrated", "drawing"])
def test_the_uncertainty_at_the_tool_is_that_of_the_posterior(tmp_path: Path, holds: str) -> None:
    """It lies in differences of nearly equal numbers: eigenvalues down to 1e-8 of the largest."""
    path = MACHINES / "hexapod.toml"
    machine = load(path, registry=REGISTRY)
    unknowns, deviations = of_bands(machine)
    random = np.random.default_rng(3)
    poses = machine.poses()[::23]
    effects = effects_of(machine, unknowns)
    # The posterior of good measurements on wide priors: what poses show is known, the rest is not.
    sensitivity = machine.sensitivity(poses) @ effects
    rows = (sensitivity * np.array([1, 1, 1, 0.3, 0.3, 0.3])[:, np.newaxis]).reshape(
        -1, len(deviations)
    )
    wide = np.diag((300.0 * deviations) ** -2.0)
    seen = np.linalg.inv(rows.T @ rows / 3e-8**2 + wide)
    seen = 0.5 * (seen + seen.T)
    assert np.linalg.eigvalsh(seen)[[0, -1]] @ [1.0, -1e-5] < 0.0
    for covariance in (seen, posterior(deviations, random, 1e-8)):
        values = random.multivariate_normal(np.zeros(len(deviations)), covariance)
        written, _ = write(
            tmp_path, path, machine, unknowns, values, covariance, controller_holds=holds
        )
        budget = tp.budget(written, poses).sel(source="tolerance")
        slopes = written.sensitivity(poses) @ effects
        wanted = np.sqrt(np.einsum("pcv,vw,pcw->pc", slopes, covariance, slopes))
        # Written as shifts, the slopes are those of the machine that they move.
        close = 1e-4 if holds == "drawing" else 1e-6
        assert np.allclose(budget.uncertainty, wanted, rtol=close, atol=0.0)
        alone = np.sqrt(np.einsum("pcv,v->pc", slopes**2, np.diagonal(covariance)))
        if covariance is seen:
            assert (wanted < 0.1 * alone).all()


def test_groups_stay_one_variable(tmp_path: Path) -> None:
    text = edited(
        PLANAR,
        (
            "[workspace]",
            '[tolerance]\n"drive.d1.origin.x" = { band = 0.3, group = "radius" }\n'
            '"drive.d2.origin.x" = { band = 0.15, group = "radius", sign = -1 } # half\n'
            '"strut.*.base.x" = { band = 0.1, group = "lot" }\n'
            "[workspace]",
        ),
    )
    path, machine = filed(tmp_path, text)
    unknowns, deviations = of_bands(machine)
    assert set(unknowns.names) == {"radius", "lot", "strut.1.length"}
    covariance = np.diag((0.1 * deviations) ** 2)
    covariance[0, 1] = covariance[1, 0] = 0.5 * np.sqrt(covariance[0, 0] * covariance[1, 1])
    values = 0.2 * deviations
    written, said = write(tmp_path, path, machine, unknowns, list(values), covariance)
    again, after = of_bands(written)
    assert sorted(again.names) == sorted(unknowns.names)
    order = [unknowns.names.index(name) for name in again.names]
    assert np.allclose(again.effects, unknowns.effects[:, order])
    assert np.allclose(after, 0.1 * deviations[order])
    effects = effects_of(machine, unknowns)
    assert np.allclose(
        tolerance_covariance(written).covariance, effects @ covariance @ effects.T, atol=1e-24
    )
    assert "# half" in said
    assert "sign = -1" in said


def test_own_tolerances_go_before_patterns_classes_and_shared_ones(tmp_path: Path) -> None:
    text = edited(
        PLANAR,
        ("length_tolerance = [-0.3, 0.3]\n", ""),
        ("length = 500\n", ""),
        ("length = 500\n", ""),
        (
            "[condition]",
            '[each.strut]\nlength = 500 # both\nlength_tolerance = "IT10"\n[condition]',
        ),
        (
            "[workspace]",
            '[tolerance]\n"strut.*.base.?" = "0.1 mm"\n"drive.*.*.x" = 0.2\n'
            '"tool.x" = { values = [0.1, 0.2] } # measured\n[workspace]',
        ),
    )
    path, machine = filed(tmp_path, text)
    unknowns = unknown(
        machine,
        *({name: 1.0} for name in ("strut.1.length", "strut.2.base.y", "tool.x", "tool.y")),
    )
    covariance = np.diag(np.array([3e-6, 2e-6, 0.0, 1e-6]) ** 2)
    values = [1e-4, -2e-4, 3e-4, 0.0]
    written, said = write(tmp_path, path, machine, unknowns, values, covariance)
    found = tomllib.loads(said)
    assert found["strut"][0]["length"] == pytest.approx(500.1)
    assert "length" not in found["strut"][1]
    assert found["strut"][1]["base"][0] == 0
    assert found["machine"]["tool"] == pytest.approx([0.3, 0, 0])
    spread = dict(
        zip(machine.parameters, np.diagonal(tolerance_covariance(written).covariance), strict=True)
    )
    before = dict(
        zip(machine.parameters, np.diagonal(tolerance_covariance(machine).covariance), strict=True)
    )
    assert spread["strut.1.length"] == pytest.approx(9e-12)
    assert spread["strut.2.base.y"] == pytest.approx(4e-12)
    assert spread["tool.x"] == 0.0
    assert before["tool.x"] > 0.0
    assert spread["tool.y"] == pytest.approx(1e-12)
    assert before["tool.y"] == 0.0
    for name in ("strut.2.length", "strut.1.base.y", "drive.d1.origin.x"):
        assert spread[name] == pytest.approx(before[name], rel=1e-12) != 0.0
    assert "# measured" in said
    assert "# both" in said


def test_values_keep_the_units_that_they_were_written_in(tmp_path: Path) -> None:
    text = edited(
        PLANAR,
        ('angle = "deg"\n', ""),
        ("length = 500", 'length = "0.5 m" # a'),
        ("length = 500", "length = 19.685 # b"),
        ('length = "mm"', 'length = "in"'),
        ("travel = [0, 900]", "travel = [0, 36]"),
        ("travel = [0, 900]", "travel = [0, 36]"),
        ("origin = [600, 0, 0]", 'origin = [\n  "600 mm", # c\n  0,\n  0\n]'),
        ("[200, 400, 5], y = [100, 300, 3]", "[8, 16, 5], y = [4, 12, 3]"),
    )
    path, machine = filed(tmp_path, text)
    names = ("strut.1.length", "strut.2.length", "drive.d2.origin.x", "drive.d1.axis.u")
    unknowns = unknown(machine, *({name: 1.0} for name in names))
    values = [1.23456789e-4, -1e-5 / 3.0, 1e-4, 1e-3]
    covariance = np.eye(4) * 1e-10
    written, said = write(tmp_path, path, machine, unknowns, values, covariance)
    assert re.search(r'length = "0\.500123456789\d* m" # a', said)
    assert re.search(r"length = 19\.6848\d+ # b", said)
    assert re.search(r'"600\.[01]\d* mm", # c\n  0,\n  0\n\]', said)
    # The file declares no unit of angles, so that the band names its own.
    assert re.search(r'"drive.d1.axis.[uv]" = \{ standard_deviation = "[\d.e-]+ rad"', said)
    at = [machine.parameters.index(name) for name in names[:3]]
    wanted = machine.nominal[at] + values[:3]
    assert np.abs(written.nominal[at] / wanted - 1.0).max() <= 4.5e-16


def test_correlations_of_what_was_not_identified_stay(tmp_path: Path) -> None:
    text = edited(
        PLANAR,
        (
            "[workspace]",
            '[tolerance]\n"strut.*.base.?" = 0.1\n"drive.*.origin.?" = 0.1\n'
            '[[correlation]] # of the bases\nbetween = ["strut.*.base.x", "drive.d1.origin.x"]\n'
            "coefficient = 0.5\n"
            '[[correlation]]\n# gone, but not forgotten\nbetween = ["drive.d2.origin.*"]\n'
            "coefficient = 0.25\n"
            '[[correlation]]\nbetween = ["strut.1.base.y", "drive.d1.origin.y", "strut.2.base.y"]\n'
            "matrix = [[0.1], [0.2, 0.3]]\n"
            '[[correlation]]\nbetween = ["strut.1.base.z", "strut.2.base.z"]\ncoefficient = 0.75\n'
            "[workspace]",
        ),
    )
    path, machine = filed(tmp_path, text)
    names = ("strut.1.base.x", "drive.d1.origin.y", "drive.d2.origin.x", "drive.d2.origin.y",
             "drive.d2.origin.z")  # fmt: skip
    unknowns = unknown(machine, *({name: 1.0} for name in names))
    covariance = 1e-12 * (np.eye(5) + np.full((5, 5), 0.125))
    _written, said = write(tmp_path, path, machine, unknowns, [1e-5] * 5, covariance)
    rows = tomllib.loads(said)["correlation"]
    assert rows[0] == {"between": ["strut.2.base.x", "drive.d1.origin.x"], "coefficient": 0.5}
    assert rows[1] == {"between": ["strut.1.base.y", "strut.2.base.y"], "matrix": [[0.2]]}
    assert rows[2] == {"between": ["strut.1.base.z", "strut.2.base.z"], "coefficient": 0.75}
    assert rows[3]["between"] == sorted(names, key=machine.parameters.index)
    assert rows[3]["matrix"][3] == pytest.approx([0.125 / 1.125] * 4)
    assert "# gone, but not forgotten" in said
    assert "# of the bases" in said


def test_a_second_calibration_takes_the_place_of_the_first(tmp_path: Path) -> None:
    path = MACHINES / "hexapod.toml"
    machine = load(path, registry=REGISTRY)
    unknowns, deviations = of_bands(machine)
    random = np.random.default_rng(5)
    first, said = write(
        tmp_path,
        path,
        machine,
        unknowns,
        list(deviations),
        posterior(deviations, random),
        warnings=["The tool\nis not better.", "Second."],
    )
    assert said.startswith("# WARNING: The tool is not better.\n# WARNING: Second.\n# Hexapod")
    made = first.calibration
    assert made is not None
    assert made.warning == ["The tool\nis not better.", "Second."]
    assert (made.machine, made.machine_hash) == ("hexapod.toml", machine.file_hash)
    assert (made.date, made.data_hash, made.observations) == ("2026-03-04", "ab" * 32, 300)
    assert made.residual_rms_held_out == 1.5
    again, later = of_bands(first)
    assert again.names == unknowns.names
    once = tmp_path / "once.toml"
    once.write_text(said, encoding="utf-8")
    final, last = write(tmp_path, once, load(once, registry=REGISTRY), again, list(-deviations),
                        posterior(0.1 * later, random))  # fmt: skip
    assert "WARNING" not in last
    assert final.calibration is not None
    assert final.calibration.machine == "once.toml"
    assert not final.calibration.warning
    assert last.count("[[correlation]]") == last.count("[calibration]") == 1
    assert last.count("\n") <= said.count("\n")
    assert np.allclose(final.nominal, machine.nominal, rtol=0.0, atol=1e-15)


def test_settings_and_replaced_values_are_written(tmp_path: Path) -> None:
    path, machine = filed(
        tmp_path,
        PLANAR,
        "strut.*.length=501",
        "condition.temperature=28",
        "strut.2.base.y=0.5",
        "tolerance.tool.x=0.1",
    )
    machine = machine.replace({"drive.d2.origin.x": 0.6001, "drive.d1.axis.v": 1e-3})
    unknowns = unknown(machine, {"strut.1.length": 1.0})
    written, said = write(tmp_path, path, machine, unknowns, [1e-4], np.array([[1e-12]]))
    found = tomllib.loads(said)
    assert [row["length"] for row in found["strut"]] == [pytest.approx(501.1), 501]
    assert found["strut"][1]["base"] == [0, 0.5, 0]
    assert found["drive"][1]["origin"][0] == pytest.approx(600.1)
    assert written.condition == machine.condition
    assert found["tolerance"]["tool.x"] == 0.1
    axis = next(iter(directions(machine))).axis
    assert np.allclose(
        written.drives[0].fields["axis"], direction_at(axis, [0.0, 1e-3]), atol=1e-16
    )


def test_the_condition_is_the_file_s(tmp_path: Path) -> None:
    path, machine = filed(tmp_path, PLANAR)
    elsewhere = machine.with_condition(machine.condition.replace(temperature=300.0))
    unknowns = unknown(machine, {"strut.1.length": 1.0})
    written, _ = write(tmp_path, path, elsewhere, unknowns, [1e-4], np.array([[1e-12]]))
    assert written.condition == machine.condition


def test_a_shift_far_larger_than_its_uncertainty(tmp_path: Path) -> None:
    path, machine = filed(tmp_path, PLANAR)
    unknowns = unknown(machine, {"strut.1.length": 1.0}, {"strut.2.length": 1.0})
    covariance = 1e-24 * np.array([[1.0, 0.5], [0.5, 1.0]])
    for holds in ("calibrated", "drawing"):
        written, _ = write(
            tmp_path, path, machine, unknowns, [1e-3, 1e-3], covariance, controller_holds=holds
        )
        spread = tolerance_covariance(written).covariance
        assert spread[spread != 0.0] == pytest.approx(covariance.ravel(), rel=1e-3)


def test_lines_that_end_in_two_characters(tmp_path: Path) -> None:
    path, machine = filed(tmp_path, PLANAR)
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    machine = load(path, registry=REGISTRY)
    unknowns = unknown(machine, {"strut.1.length": 1.0}, {"drive.d1.axis.u": 1.0})
    covariance = 1e-12 * np.array([[1.0, 0.5], [0.5, 1.0]])
    written, _ = write(tmp_path, path, machine, unknowns, [1e-3, 1e-3], covariance)
    assert written.nominal[machine.parameters.index("strut.1.length")] == 0.501


def test_properties_are_written(tmp_path: Path) -> None:
    path, machine = filed(tmp_path, PLANAR)
    every = properties_of(machine)
    chosen = ("strut.1.expansion", "strut.2.expansion", "strut.1.compliance")
    unknowns = dataclasses.replace(
        unknown(machine, {"strut.1.length": 1.0}),
        names=("strut.1.length", *chosen),
        effects=np.array([[1.0, 0.0, 0.0, 0.0]]),
        properties={at: every[name] for at, name in enumerate(chosen, 1)},
    )
    written, said = write(
        tmp_path, path, machine, unknowns, [0.0, 1e-6, -2e-6, 0.25], np.eye(4) * 1e-12
    )
    assert written.struts[0].expansion == pytest.approx(1.2e-5, rel=1e-15)
    assert 'expansion = "1.2e-05 1/K"' in said
    steel = machine.struts[1].expansion
    assert steel is not None
    assert written.struts[1].expansion == pytest.approx(steel - 2e-6, rel=1e-15)
    assert written.struts[0].modulus == pytest.approx(210e9 / 1.25, rel=1e-15)
    assert 'modulus = "168.0 GPa"' in said


def test_the_compliance_of_a_limb_is_written(tmp_path: Path) -> None:
    path, machine = filed(tmp_path, (MACHINES / "3prs.toml").read_text())
    unknowns = dataclasses.replace(
        unknown(machine, {"drive.d1.offset": 1.0}),
        names=("drive.d1.offset", "limb.2.compliance"),
        effects=np.array([[1.0, 0.0]]),
        properties={1: properties_of(machine)["limb.2.compliance"]},
    )
    written, said = write(tmp_path, path, machine, unknowns, [0.0, 0.25], np.eye(2) * 1e-12)
    assert [limb.compliance for limb in written.limbs] == [1.0, 1.25, 1.0]
    assert "compliance = 1.25" in said
    assert "compliance" not in said.partition('name = "2"')[0].partition("[[limb]]")[2]


def test_data_files_are_found_from_another_folder(tmp_path: Path) -> None:
    text = edited(
        PLANAR, ("[workspace]", '[tolerance]\n"tool.x" = { data = "held.csv" } # x\n[workspace]')
    )
    (tmp_path / "held.csv").write_text("deviation (mm)\n0.1\n0.2\n", encoding="utf-8")
    path, machine = filed(tmp_path, text)
    (tmp_path / "out").mkdir()
    unknowns = unknown(machine, {"strut.1.length": 1.0})
    written, said = write(tmp_path / "out", path, machine, unknowns, [1e-4], np.array([[1e-12]]))
    assert '"../held.csv" } # x' in said
    assert list(written.data_files.values()) == list(machine.data_files.values())


@pytest.mark.parametrize("tilt", [(1e-3, 0.0), (0.0, 1e-3), (-2e-3, 3e-3)])
def test_directions_turn_what_is_known_of_them(tmp_path: Path, tilt: tuple[float, float]) -> None:
    """Even where the tangents of the new axis are others altogether."""
    path, machine = filed(tmp_path, PLANAR)
    names = ("drive.d1.axis.u", "drive.d1.axis.v")
    unknowns = unknown(machine, *({name: 1.0} for name in names))
    covariance = np.array([[4e-12, 1e-12], [1e-12, 1e-12]])
    written, _ = write(tmp_path, path, machine, unknowns, list(tilt), covariance)
    old, new = next(iter(directions(machine))), next(iter(directions(written)))

    def in_space(each: object, at: tuple[float, float], spread: Floats) -> Floats:
        step = 1e-6
        moved = [
            (direction_at(each.axis, np.add(at, e)) - direction_at(each.axis, np.subtract(at, e)))
            / (2 * step)  # type: ignore[attr-defined]
            for e in step * np.eye(2)
        ]
        return np.transpose(moved) @ spread @ np.array(moved)

    found = tolerance_covariance(written).covariance[np.ix_(new.columns, new.columns)]
    assert np.allclose(
        in_space(new, (0.0, 0.0), found), in_space(old, tilt, covariance), rtol=0.0, atol=1e-20
    )


def test_one_tilt_alone_becomes_a_group_where_both_new_ones_move(tmp_path: Path) -> None:
    text = edited(PLANAR, ("axis = [0, 1, 0]", "axis = [0.3, 1, 0.2]"))
    path, machine = filed(tmp_path, text)
    unknowns = unknown(machine, {"drive.d1.axis.v": 1.0}, {"drive.d1.axis.u": 1.0, "tool.x": 0.5})
    covariance = np.array([[1e-12, 3e-13], [3e-13, 4e-12]])
    written, _ = write(tmp_path, path, machine, unknowns, [1e-2, 1e-2], covariance)
    spread = tolerance_covariance(written).covariance
    at = [machine.parameters.index(name) for name in ("tool.x", "drive.d1.axis.u")]
    assert spread[at[0], at[0]] == pytest.approx(1e-12)
    # With the length of strut 1, which keeps its own.
    assert np.linalg.matrix_rank(spread * 1e12, tol=1e-9) == 3
    alone = unknown(machine, {"drive.d1.axis.v": 1.0})
    written, said = write(tmp_path, path, machine, alone, [1e-2], covariance[:1, :1])
    assert said.count('group = "drive.d1.axis.v as calibrated"') == 2
    assert np.linalg.matrix_rank(tolerance_covariance(written).covariance * 1e12, tol=1e-9) == 2


def test_shifts_leave_what_the_controller_has(tmp_path: Path) -> None:
    path, machine = filed(tmp_path, PLANAR)
    unknowns = unknown(machine, {"strut.1.length": 1.0}, {"strut.2.length": 1.0})
    covariance = np.diag([1e-12, 0.0])
    written, said = write(
        tmp_path, path, machine, unknowns, [1e-4, 2e-4], covariance,
        controller_holds="drawing", coverage=3.0,
    )  # fmt: skip
    assert np.array_equal(written.nominal, machine.nominal)
    bands = bands_of(written)
    assert bands is not None
    assert bands.shift[0] == pytest.approx([1e-4, 2e-4])
    assert bands.half[0] == pytest.approx([3e-6, 0.0], abs=1e-20)
    assert bands.distribution[0].sigmas == 3.0
    budget = tp.budget(written).sel(source="tolerance")
    assert np.abs(budget.error).max() > 1e-4
    assert "[[correlation]]" not in said


def test_what_is_refused(tmp_path: Path) -> None:
    path, machine = filed(tmp_path, PLANAR)
    unknowns = unknown(machine, {"strut.1.length": 1.0})
    one = np.array([[1e-12]])

    def code(**changes: object) -> str:
        given = {"values": [1e-4], "covariance": one, "name": "new.toml"} | changes
        with pytest.raises(RequestError) as caught:
            write_calibrated(
                tmp_path / str(given["name"]),
                machine,
                unknowns,
                np.array(given["values"]),
                np.asarray(given["covariance"]),
                PROVENANCE,
                original=path,
                controller_holds="calibrated",
            )
        (problem,) = caught.value.problems
        return problem.code

    assert code(name="machine.toml") == "output-is-input"
    assert code(name="new.json") == "output-ending"
    assert code(values=[np.nan]) == "calibration-undetermined"
    assert code(covariance=[[np.inf]]) == "calibration-undetermined"
    # A length of less than nothing is no machine.
    assert code(values=[-1.0]) == "calibration-not-written"
    before = path.read_text(encoding="utf-8")
    path.write_text(before + "# later\n", encoding="utf-8")
    assert code() == "calibration-file-changed"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["machine.toml"]


CALIBRATION = f"""\
[calibration]
data = "m.csv"
data_hash = "{"0" * 64}"
machine = "a.toml"
machine_hash = "{"0" * 64}"
date = "2026-01-02"
version = "1"
observations = 3
residual_rms_before = 2
residual_rms_after = 1.0
"""


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        (f'data_hash = "{"0" * 64}"', 'data_hash = "12"', "bad-hash"),
        ("observations = 3", "observations = -3", "negative"),
        ("rms_after = 1.0", "rms_after = -1.0", "negative"),
        ("rms_after = 1.0", "rms_after = inf", "not-finite"),
        ('date = "2026-01-02"', 'date = ""', "bad-name"),
        ('date = "2026-01-02"\n', "", "missing-key"),
        ('version = "1"', 'version = "1"\nwarning = "one"', "wrong-type"),
        ('version = "1"', 'version = "1"\nwarnings = []', "unknown-key"),
    ],
)
def test_a_calibration_table_is_checked(tmp_path: Path, old: str, new: str, code: str) -> None:
    assert load_text(tmp_path, PLANAR + CALIBRATION).calibration is not None
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, PLANAR + edited(CALIBRATION, (old, new)))
    (problem,) = caught.value.problems
    assert problem.code == code
    assert problem.line is not None


@pytest.mark.parametrize(
    ("asked", "settings", "wanted"),
    [
        ('[accuracy]\ntarget = "0.5 mm"', (), 0.95),
        ('[accuracy]\ntarget = "0.5 mm" # mine\n\n# below\n[platform]\nmass = "0 kg"', (), 0.95),
        ('[accuracy]\ntarget = "0.5 mm"\nat = "worst"', (), None),
        ('[accuracy]\ntarget = "0.5 mm"\nat = "99 %"', (), 0.99),
        ('[accuracy]\ntarget = "0.5 mm"', ("accuracy.at=worst",), None),
        ('[accuracy]\ntarget = "0.5 mm"', ("accuracy.at=90 %",), 0.9),
        ("", ("accuracy.target=0.5 mm",), 0.95),
        ("[accuracy]", (), None),
        ("", (), None),
    ],
)
def test_what_is_asked_is_asked_at_a_coverage(
    tmp_path: Path, asked: str, settings: tuple[str, ...], wanted: float | None
) -> None:
    """Where the original says nothing of it: normal bands have no ends that a worst case needs."""
    text = edited(PLANAR, ('[accuracy]\ntarget = "0.5 mm"', asked))
    path, machine = filed(tmp_path, text, *settings)
    unknowns = unknown(machine, {"strut.1.length": 1.0})
    written, said = write(tmp_path, path, machine, unknowns, [1e-4], np.eye(1) * 1e-12)
    assert written.accuracy.at == wanted
    assert written.accuracy.target == machine.accuracy.target
    assert written.accuracy.target_text == machine.accuracy.target_text
    found = tomllib.loads(said).get("accuracy", {})
    assert ("at" in found) == (wanted is not None or "worst" in asked + "".join(settings))
    if "below" in asked:
        assert '# mine\nat = "95 %"\n\n# below\n[platform]' in said
