"""The calibrated machine in memory is the one that is loaded from the file that `save` writes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from machine_texts import PLANAR, edited, load_text
from made_blunders import good
from made_unknowns import PROVENANCE, MadeUnknowns, of_bands, posterior
from sweeps import thinned
from truepose.calibration.calibrate import Calibration
from truepose.calibration.identification.properties import properties_of
from truepose.calibration.result.bands import bands_of, tolerance_covariance
from truepose.calibration.result.calibrated_machine import calibrated_machine
from truepose.calibration.result.file import write_calibrated
from truepose.errors import RequestError
from truepose.machine import Machine

SECOND_ORDER = 1e-6
"""Relative: of bands of tilts, about an old axis and about a new one, 1e-3 rad apart."""

DATA = Path(__file__).parents[3] / "examples" / "data"


def assert_same_bands(ours: Machine, filed: Machine) -> None:
    """Parameters, bands, groups, distributions and correlations of two machines."""
    np.testing.assert_allclose(ours.nominal, filed.nominal, rtol=1e-14)
    one, other = bands_of(ours), bands_of(filed)
    assert one is not None
    assert other is not None
    assert one.parameters.tolist() == other.parameters.tolist()
    np.testing.assert_allclose(one.shift, other.shift, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(one.signed_half, other.signed_half, rtol=1e-9)
    assert one.variables.tolist() == other.variables.tolist()
    assert one.group_names == other.group_names
    assert one.edge.tolist() == other.edge.tolist()
    assert list(map(str, one.distribution)) == list(map(str, other.distribution))
    if other.correlation is None:
        assert one.correlation is None
    else:
        np.testing.assert_allclose(one.correlation, other.correlation, rtol=0.0, atol=1e-12)


def assert_same_uncertainty(ours: Machine, filed: Machine, rtol: float) -> None:
    poses = filed.poses()[::7]
    assert [type(source) for source in ours.sources] == [type(source) for source in filed.sources]
    name = "standard_uncertainty"
    wanted = tp.uncertainty(filed, poses)[name].values
    assert wanted.max() > 0.0
    np.testing.assert_allclose(tp.uncertainty(ours, poses)[name].values, wanted, rtol=rtol)


@pytest.fixture(scope="module")
def delta() -> Calibration:
    machine = tp.load(DATA / "delta_printer.toml")
    return tp.calibrate(machine, DATA / "delta_positions.csv")


def test_it_is_the_machine_that_the_saved_file_is(delta: Calibration, tmp_path: Path) -> None:
    ours = delta.calibrated()
    original = DATA / "delta_printer.toml"
    delta.save(
        tmp_path / "calibrated.toml",
        original=original,
        date="2026-01-31",
        controller_holds="calibrated",
    )
    filed = tp.load(tmp_path / "calibrated.toml")
    assert_same_bands(ours, filed)
    assert_same_uncertainty(ours, filed, 1e-9)
    assert ours.accuracy == filed.accuracy
    # The bands are those found, none of them the file's.
    before = np.diagonal(tolerance_covariance(delta.machine).covariance)
    after = np.diagonal(tolerance_covariance(ours).covariance)
    assert (after[before > 0.0] < before[before > 0.0]).all()
    assert bands_of(ours).correlation is not None  # type: ignore[union-attr]


def test_directions_point_where_the_file_says(tmp_path: Path) -> None:
    """In memory a tilt of the old axis, in the file a new axis: the same machine."""
    original = MACHINES / "orthoglide.toml"
    machine = tp.load(original)
    found = tp.calibrate(machine, good(machine, "pose", seed=3, count=40))
    ours = found.calibrated()
    filed = found.save(
        tmp_path / "calibrated.toml",
        original=original,
        date="2026-01-31",
        controller_holds="calibrated",
        force=True,
    )
    tilts = [at for at, name in enumerate(machine.parameters) if name.endswith(".axis.u")]
    assert ours.nominal[tilts].all()
    joints = machine.inverse(machine.poses()[::11])
    np.testing.assert_allclose(ours.forward(joints), filed.forward(joints), rtol=0.0, atol=1e-12)
    assert_same_uncertainty(ours, filed, SECOND_ORDER)


@pytest.mark.parametrize(
    "path",
    thinned(sorted(MACHINES.glob("*.toml")), quick={MACHINES / "planar_two_slider.toml"}),
    ids=lambda path: path.stem,
)
def test_it_is_of_every_machine(tmp_path: Path, path: Path) -> None:
    machine = tp.load(path)
    unknowns, deviations = of_bands(machine)
    random = np.random.default_rng(5)
    values = random.normal(size=len(deviations)) * deviations
    covariance = posterior(deviations, random, 1e-4)
    ours = calibrated_machine(machine, unknowns, values, covariance)
    filed = write_calibrated(
        tmp_path / "calibrated.toml", machine, unknowns, values, covariance, PROVENANCE,
        original=path, controller_holds="calibrated",
    )  # fmt: skip
    assert_same_uncertainty(ours, filed, SECOND_ORDER)


def test_what_was_not_identified_keeps_its_band_group_and_correlation(tmp_path: Path) -> None:
    text = edited(
        PLANAR,
        ("[condition]",
         '[tolerance]\n"drive.d1.offset" = { band = 0.1, group = "ends" }\n'
         '"drive.d2.offset" = { band = 0.1, group = "ends", sign = -1 }\n'
         '"strut.*.base.x" = 0.2\n"strut.*.base.y" = { standard_deviation = 0.1 }\n'
         '[[correlation]]\nbetween = ["strut.1.base.x", "strut.2.base.x", "strut.1.base.y"]\n'
         "coefficient = 0.5\n[condition]"),
    )  # fmt: skip
    machine = load_text(tmp_path, text)
    names = ["strut.1.length", "strut.2.length", "strut.1.base.y", "strut.2.base.y"]
    columns = np.array([machine.parameters.index(name) for name in names])
    # A length of each strut, and a group whose members go against one another.
    effects = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    unknowns = MadeUnknowns((*names[:2], "turned base"), columns, effects)
    covariance = np.array([[4.0, 1.0, 0.0], [1.0, 9.0, 2.0], [0.0, 2.0, 16.0]]) * 1e-12
    values = np.array([1e-4, -2e-4, 3e-5])
    ours = calibrated_machine(machine, unknowns, values, covariance)
    filed = write_calibrated(
        tmp_path / "calibrated.toml", machine, unknowns, values, covariance, PROVENANCE,
        original=tmp_path / "machine.toml", controller_holds="calibrated",
    )  # fmt: skip
    assert_same_bands(ours, filed)
    assert_same_uncertainty(ours, filed, 1e-9)
    known = tolerance_covariance(ours)
    at = {name: machine.parameters.index(name) for name in machine.parameters}
    kept = known.covariance[at["strut.1.base.x"], at["strut.2.base.x"]]
    assert kept == pytest.approx(0.5 * (0.2e-3) ** 2 / 3.0)
    turned = known.covariance[at["strut.1.base.y"], at["strut.2.base.y"]]
    assert turned == pytest.approx(-16e-12)
    linked = known.covariance[at["strut.2.length"], at["strut.2.base.y"]]
    assert linked == pytest.approx(-2e-12)


def test_an_expansion_that_was_found_is_in_it() -> None:
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    name, expansion = next(iter(properties_of(machine).items()))
    unknowns = MadeUnknowns(
        (name,), np.empty(0, np.intp), np.empty((0, 1)), properties={0: expansion}
    )
    ours = calibrated_machine(machine, unknowns, np.array([2e-6]), np.array([[1e-14]]))
    before = machine.struts[expansion.index].expansion or 0.0
    assert ours.struts[expansion.index].expansion == pytest.approx(before + 2e-6)


def test_what_nothing_determines_is_refused() -> None:
    machine = tp.load(DATA / "delta_printer.toml")
    unknowns, deviations = of_bands(machine)
    open_ = np.diag(np.full(len(deviations), np.inf))
    with pytest.raises(RequestError) as refused:
        calibrated_machine(machine, unknowns, 0.0 * deviations, open_)
    assert [problem.code for problem in refused.value.problems] == ["calibration-undetermined"]
