"""Two files of one machine: what changed beyond uncertainty, and what only seems to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from machine_texts import HEXAPOD, PLANAR, edited, load_text
from made_unknowns import PROVENANCE, of_bands, posterior
from sweeps import thinned
from truepose.calibration.result.bands import tolerance_covariance
from truepose.calibration.result.compare import ALPHA, chi_square_tail, compare
from truepose.calibration.result.file import write_calibrated
from truepose.errors import RequestError
from truepose.machine import Machine, load
from truepose.sources import REGISTRY

MACHINES = Path(__file__).parents[3] / "machines"


def calibrated(folder: Path, name: str, values: np.ndarray, covariance: np.ndarray,
               holds: str = "calibrated") -> Machine:  # fmt: skip
    machine = load(name, registry=REGISTRY)
    return write_calibrated(
        folder / "calibrated.toml",
        machine,
        of_bands(machine)[0],
        values,
        covariance,
        PROVENANCE,
        original=name,
        controller_holds=holds,
    )


@pytest.mark.parametrize("dof", [1, 2, 3, 10, 41, 300])
def test_the_tail_of_chi_square(dof: int) -> None:
    values = np.array([1e-3, 0.5 * dof, dof, 1.5 * dof, 3.0 * dof + 10.0])
    found = [chi_square_tail(float(value), dof) for value in values]
    assert np.allclose(found, stats.chi2.sf(values, dof), rtol=1e-11, atol=1e-300)
    assert chi_square_tail(0.0, dof) == chi_square_tail(1.0, 0) == 1.0


def test_a_machine_did_not_change_from_itself() -> None:
    machine = load(MACHINES / "orthoglide.toml", registry=REGISTRY)
    found = compare(machine, machine, machine.poses()[:5])
    assert found.attrs["changed"] == 0
    assert not found.difference.any()
    assert found.attrs["verdict"] == "No change beyond uncertainty: no parameter differs."
    assert np.abs(found.displacement).max() < 1e-15


@pytest.mark.parametrize("name", thinned(["hexapod", "orthoglide", "tricept", "overconstrained"]))
def test_unchanged_machines_are_told_apart_by_chance_only(tmp_path: Path, name: str) -> None:
    path = MACHINES / f"{name}.toml"
    machine = load(path, registry=REGISTRY)
    deviations = of_bands(machine)[1]
    random = np.random.default_rng(4)
    covariance = posterior(0.1 * deviations, random, 1e-6)
    at_first = random.normal(size=len(deviations)) * deviations
    base = calibrated(tmp_path, path, at_first, covariance)
    spread = tolerance_covariance(base)
    none = np.zeros(len(spread.correlation))

    def drawn() -> Machine:
        error = spread.effects @ random.multivariate_normal(none, spread.correlation)
        values = (base.nominal + error).tolist()
        return base.replace(dict(zip(base.parameters, values, strict=True)))

    poses = machine.poses()[:: len(machine.poses()) // 3]
    changed, normal, at_tool = 0, [], []
    times = 60
    for _ in range(times):
        found = compare(drawn(), drawn(), poses)
        changed += found.attrs["changed"]
        normal.append(found.attrs["chi_square"])
        at_tool.append((found.displacement / found.displacement_uncertainty).values)
    assert changed <= stats.binom.ppf(0.9999, times, ALPHA)
    assert np.mean(normal) == pytest.approx(len(deviations), rel=0.12)
    assert np.nanstd(at_tool) == pytest.approx(1.0, abs=0.3)


def test_no_change_says_why_the_tool_may_be_elsewhere(tmp_path: Path) -> None:
    path = MACHINES / "linear_delta.toml"
    machine = load(path, registry=REGISTRY)
    deviations = of_bands(machine)[1]
    found = calibrated(tmp_path, path, 0.5 * deviations, np.diag((0.5 * deviations) ** 2))
    attrs = compare(machine, found, machine.poses()[:5]).attrs
    assert attrs["changed"] == 0
    said = attrs["verdict"]
    assert "the two files differ at the tool by up to" in said
    assert "which is within their uncertainties" in said
    assert "moves" not in said


@pytest.mark.parametrize("holds", ["calibrated", "drawing"])
def test_a_change_is_found_where_it_is(tmp_path: Path, holds: str) -> None:
    path = MACHINES / "linear_delta.toml"
    machine = load(path, registry=REGISTRY)
    unknowns, deviations = of_bands(machine)
    covariance = np.diag((0.02 * deviations) ** 2)
    random = np.random.default_rng(6)
    first = random.multivariate_normal(np.zeros(len(deviations)), covariance)
    second = random.multivariate_normal(np.zeros(len(deviations)), covariance)
    at = unknowns.names.index("drive.b.offset")
    second[at] += 12 * 0.02 * deviations[at]
    old = calibrated(tmp_path, path, first, covariance)
    new = calibrated(tmp_path, path, second, covariance, holds)
    found = compare(old, new)
    each = found.parameter.values[found.parameter_changed.values]
    assert found.attrs["changed"] == 1
    assert list(each) == ["drive.b.offset"]
    assert found.attrs["verdict"].startswith("The machine changed: drive.b.offset by ")
    moved = dict(zip(machine.parameters, (found.difference).values, strict=True))
    assert moved["drive.b.offset"] == pytest.approx(second[at] - first[at], rel=1e-9)
    # At the tool it is what the kinematics say.
    pose = machine.poses()[int(found.pose[7])]
    joints = old.inverse(pose)
    values = dict(zip(machine.parameters, found.new.values.tolist(), strict=True))
    estimate = new.replace(values) if holds == "drawing" else new
    components = [machine.dof.index(axis) for axis in "xyz"]
    went = (estimate.forward(joints) - old.forward(joints))[components]
    assert np.allclose(found.displacement[7, :3], went, rtol=1e-6, atol=1e-12)


def test_a_change_that_shows_in_differences_only(tmp_path: Path) -> None:
    """Each parameter alone is known badly, what they do together well."""
    text = edited(
        PLANAR,
        ("length_tolerance = [-0.3, 0.3]\n", ""),
        ("[workspace]", '[tolerance]\n"strut.*.length" = { standard_deviation = "10 um" }\n'
         '[[correlation]]\nbetween = ["strut.1.length", "strut.2.length"]\n'
         "matrix = [[0.9999]]\n[workspace]"),
    )  # fmt: skip
    old = load_text(tmp_path, text)
    new = load_text(tmp_path, text, "strut.1.length=500.002", "strut.2.length=499.998")
    found = compare(old, new)
    assert found.attrs["changed"] == 1
    assert not found.parameter_changed.any()
    assert "no parameter stands out by itself" in found.attrs["verdict"]
    both = load_text(tmp_path, text, "strut.*.length=500.005")
    assert compare(old, both).attrs["changed"] == 0


def test_what_has_no_uncertainty_changed_if_it_differs(tmp_path: Path) -> None:
    old, new = (load_text(tmp_path, PLANAR, *more) for more in ([], ["strut.2.length=500.001"]))
    found = compare(old, new)
    assert found.attrs["changed"] == 1
    assert list(found.parameter.values[found.parameter_changed.values]) == ["strut.2.length"]
    wide = load_text(tmp_path, PLANAR, "strut.1.length=500.1")
    assert compare(old, wide).attrs["changed"] == 0
    tied = edited(PLANAR, ("[workspace]", '[tolerance]\n"strut.*.base.x" = { band = 0.1, '
                           'group = "lot" }\n[workspace]'))  # fmt: skip
    alike, apart = (
        load_text(tmp_path, tied, *(f"strut.{n}.base.x={x}" for n, x in zip("12", at, strict=True)))
        for at in ((0.05, 0.05), (0.05, -0.05))
    )
    assert compare(load_text(tmp_path, tied), alike).attrs["changed"] == 0
    assert compare(load_text(tmp_path, tied), apart).attrs["changed"] == 1


def test_directions_are_compared_as_directions(tmp_path: Path) -> None:
    """About another axis the two angles are others; the direction is the same."""
    text = edited(
        PLANAR, ("[workspace]", '[tolerance]\n"drive.*.axis.?" = "0.01 deg"\n[workspace]')
    )
    old = load_text(tmp_path, text)
    near = load_text(tmp_path, text, "drive.d1.axis=[1e-4, 1, 0]")
    found = compare(old, near)
    assert found.attrs["changed"] == 0
    moved = found.difference.values[[old.parameters.index(f"drive.d1.axis.{x}") for x in "uv"]]
    assert np.linalg.norm(moved) == pytest.approx(1e-4, rel=1e-6)
    far = load_text(tmp_path, text, "drive.d1.axis=[1e-3, 1, 0]")
    assert compare(old, far).attrs["changed"] == 1
    across = load_text(tmp_path, text, "drive.d1.axis=[1, 0, 0]")
    with pytest.raises(RequestError, match="not-the-same-machine"):
        compare(old, across)


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (HEXAPOD, "their dof differ"),
        (edited(PLANAR, ('name = "d1"', 'name = "e1"'), ('drive = "d1"', 'drive = "e1"')),
         "their joints differ: d1, e1"),
        (edited(PLANAR, ('name = "1"', 'name = "one"')), "their parameters differ"),
        (edited(PLANAR, ('kind = "slider"', 'kind = "crank"'), ("[0, 900]", "[0, 90]"),
                ("base = [0, 0, 0]", "base = [0, 100, 0]"),
                ("axis = [0, 1, 0]", "axis = [0, 0, 1]")),
         "other kinds"),
    ],
)  # fmt: skip
def test_other_machines_are_refused(tmp_path: Path, other: str, words: str) -> None:
    with pytest.raises(RequestError) as caught:
        compare(load_text(tmp_path, PLANAR), load_text(tmp_path, other))
    (problem,) = caught.value.problems
    assert problem.code == "not-the-same-machine"
    assert words in str(problem.found)


def test_poses_out_of_reach_are_left_out(tmp_path: Path) -> None:
    old, new = (load_text(tmp_path, PLANAR, *more) for more in ([], ["strut.2.length=501"]))
    found = compare(old, new, [[0.3, 0.2], [5.0, 0.2]])
    assert list(found.pose) == [0]
    assert list(found.left_out_index) == [1]
    assert list(found.left_out_status) == ["unreachable"]
    with pytest.raises(RequestError, match="no-pose-left"):
        compare(old, new, [[5.0, 0.2]])
