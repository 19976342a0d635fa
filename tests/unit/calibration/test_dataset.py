"""A calibration as data: docs/results.md and the Dataset say the same, and it is what was found."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import truepose as tp
from build_machine import MACHINES
from made_measurements import made_measurements, poses_within
from truepose.calibration.calibrate import Calibration, calibrate
from truepose.calibration.dataset import SCHEMA, answer_of, covariance_of, dataset_of, verdict_of
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.identification.unknowns import unknowns_of
from truepose.calibration.measurements.read_csv import read_measurements
from truepose.calibration.observables import OBSERVABLES
from truepose.calibration.result.save import save
from truepose.errors import RequestError

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
DATA = ROOT / "examples" / "data"
ROW = re.compile(r"^\| (?P<name>[^|]+) \| (?P<dims>[^|]+) \| (?P<units>[^|]+) \| (?P<text>.+) \|$")


def section(title: str) -> dict[str, tuple[str, str]]:
    """Name -> (dims, units) of the table in a section of the page."""
    text = PAGE.split(f"\n## {title}\n")[1].split("\n## ")[0]
    rows = [ROW.match(line) for line in text.splitlines()]
    found = {row["name"]: (row["dims"], row["units"]) for row in rows if row}
    return {name: cells for name, cells in found.items() if name not in ("variable", "---")}


@cache
def hexapod(held_out: bool = False) -> Calibration:
    """A hexapod, somewhere in its tolerances, that a tracker with a frame of its own measured."""
    machine = tp.load(MACHINES / "hexapod.toml")
    poses = poses_within(machine, 20)
    kept = np.arange(20) >= 15 if held_out else None
    data = made_measurements(machine, "pose", poses, frame="unknown", held_out=kept)
    unknowns = unknowns_of(machine, data)
    rng = np.random.default_rng(5)
    true = np.zeros(unknowns.count)
    sigma = np.sqrt(np.diagonal(unknowns.prior_covariance)[: unknowns.n_machine])
    true[: unknowns.n_machine] = sigma * rng.normal(size=unknowns.n_machine)
    shown = IdentificationProblem(machine, data, unknowns).predict(true)
    noise = data.uncertainty * rng.normal(size=shown.size)
    return calibrate(machine, data.with_values(shown + noise))


@cache
def delta(name: str, use_prior: bool = True) -> Calibration:
    """The delta printer of the examples."""
    machine = tp.load(DATA / "delta_printer.toml")
    return calibrate(machine, DATA / f"delta_{name}.csv", use_prior=use_prior)


def swapped() -> Calibration:
    """The same printer, two columns of its measurements under each other's name."""
    machine = tp.load(DATA / "delta_printer.toml")
    data = read_measurements(DATA / "delta_positions.csv", machine)
    x, y = (OBSERVABLES.index(name) for name in "xy")
    exchanged = {x: y, y: x}
    columns = np.array([exchanged.get(int(each), int(each)) for each in data.observable])
    order = np.lexsort((columns, data.row))
    return calibrate(
        machine,
        replace(data, observable=columns[order], value=data.value[order]),
    )


EVERY = [hexapod, lambda: hexapod(True), lambda: delta("positions"), lambda: delta("heights")]


def test_the_page_has_the_schema() -> None:
    assert section("Calibration") == {
        name: (", ".join(variable.dims), variable.units) for name, variable in SCHEMA.items()
    }


@pytest.mark.parametrize("made", EVERY)
def test_the_dataset_has_what_the_page_says(made: object) -> None:
    dataset = made().dataset  # type: ignore[operator]
    assert list(dataset.data_vars) == list(SCHEMA)
    for name, variable in SCHEMA.items():
        assert dataset[name].dims == variable.dims
    named = section("Coordinates")
    for key in dataset.coords:
        generic = re.sub(r"^(pose|row)_(x|y|z|a|b|c)$", r"\1_F", str(key))
        assert ", ".join(dataset[key].dims) == named[generic][0]
    for variable in {**dataset.data_vars, **dataset.coords}.values():
        assert variable.attrs["long_name"]
        units = variable.attrs["units"].split(", ")
        assert set(units) <= {"m", "rad", "1", "1/K"}
        if len(units) > 1:
            by = dataset[variable.attrs["units_by"]]
            assert set(by.values) == set(units)
            assert by.dims[0] in variable.dims
    page = PAGE.split("\n## Attributes\n")[1]
    assert all(re.search(rf"\b{name}\b", page) for name in dataset.attrs)


@pytest.mark.parametrize("made", EVERY)
def test_a_dataset_is_written_and_read_again(made: object, tmp_path: Path) -> None:
    dataset = made().dataset  # type: ignore[operator]
    dataset.to_netcdf(tmp_path / "result.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "result.nc", engine="h5netcdf") as read:
        for name in dataset.variables:
            np.testing.assert_array_equal(read[name].values, dataset[name].values)
        assert read.attrs == dataset.attrs


def test_it_is_what_the_fit_and_the_gate_found() -> None:
    found = delta("positions")
    shown = found.dataset
    fit, gate = found.fit, found.gate
    np.testing.assert_array_equal(shown["value"], fit.values)
    np.testing.assert_array_equal(shown["residual_after"], fit.residual * shown["uncertainty"])
    np.testing.assert_array_equal(shown["tool_after"], gate.after.standard)
    # The calibrated machine predicts what the residuals say, by its own forward kinematics.
    machine, data = found.calibrated(), found.measurements
    there = machine.forward(data.joints)
    residual = there - data.value.reshape(-1, 3)
    np.testing.assert_allclose(shown["residual_after"].values, residual.ravel(), atol=1e-11)
    identified = dict(
        zip(shown["parameter"].values, shown["parameter_identified"].values, strict=True)
    )
    for name, value in identified.items():
        assert machine.nominal[machine.parameters.index(name)] == value
    rod = shown.sel(unknown="strut.a.length")
    assert rod["nominal"] == 0.28814
    assert rod["identified"] == rod["nominal"] + rod["value"]
    assert np.isnan(shown.sel(unknown="delta radius")["nominal"])


@pytest.mark.parametrize("made", EVERY)
def test_uncertainties_and_correlation_are_one_covariance(made: object) -> None:
    found: Calibration = made()  # type: ignore[operator]
    shown = found.dataset
    covariance = covariance_of(found)
    sigma = np.sqrt(np.diagonal(covariance))
    np.testing.assert_allclose(shown["standard_uncertainty"], sigma, rtol=1e-6)
    assert (np.abs(shown["correlation"].values) <= 1.0 + 1e-9).all()
    np.testing.assert_allclose(
        shown["correlation"] * np.outer(sigma, sigma), covariance, atol=1e-9 * sigma.max() ** 2
    )


def test_rows_that_are_kept_from_the_fit_have_no_residual_of_it() -> None:
    shown = hexapod(True).dataset
    kept = shown["row_held_out"].values[shown["observation_row"].values]
    assert kept.sum() == 5 * 6
    for name in ("residual_after", "normalised_before", "standardised", "weight"):
        np.testing.assert_array_equal(np.isnan(shown[name].values), kept)
    for name in ("held_out_before", "held_out_after"):
        np.testing.assert_array_equal(np.isnan(shown[name].values), ~kept)
    assert shown.attrs["validation"] == "stated set"


def test_what_is_not_determined_is_infinite_and_has_no_correlation(tmp_path: Path) -> None:
    machine = tp.load(DATA / "delta_printer.toml")
    # Heights do not see where the tool is beside the platform's middle.
    asked = ["drive.*.offset", "tool.x"]
    found = calibrate(machine, DATA / "delta_heights.csv", identify=asked, use_prior=False)
    shown = found.dataset
    open_ = shown["unknown"].values == "tool.x"
    np.testing.assert_array_equal(np.isinf(shown["standard_uncertainty"]), open_)
    np.testing.assert_array_equal(np.isinf(shown["parameter_uncertainty"]), open_)
    correlation = shown["correlation"].values
    assert np.isnan(correlation[open_][:, ~open_]).all()
    assert np.isfinite(correlation[~open_][:, ~open_]).all()
    assert not found.accepted
    with pytest.raises(RequestError) as refused:
        save(
            found,
            tmp_path / "calibrated.toml",
            original=DATA / "delta_printer.toml",
            date="2026-01-31",
            force=True,
        )
    assert [each.code for each in refused.value.problems] == ["calibration-undetermined"]


def test_the_verdict_and_its_parts() -> None:
    refused, accepted = delta("heights", use_prior=False), delta("positions")
    assert accepted.external_reliability is not None
    unnoticed = f"{accepted.external_reliability.position * 1e6:.0f} µm"
    assert verdict_of(accepted) == (
        f"{accepted.gate.words} A wrong reading that is not named moves the tool by at most "
        f"{unnoticed}."
    )
    assert answer_of(refused).startswith("No: ")
    assert verdict_of(refused).startswith(answer_of(refused))
    assert refused.gate.remedy is not None
    remedy = json.loads(refused.dataset.attrs["remedy"])
    assert remedy["sentence"] == refused.gate.remedy.sentence
    assert remedy["sentence"][1:] not in answer_of(refused)
    codes = [each["code"] for each in json.loads(refused.dataset.attrs["reasons"])]
    assert "no-gain" in codes


def test_measurements_that_look_wrong_are_the_first_reason() -> None:
    found = swapped()
    (suspicion,) = [each for each in found.suspicions if each.refuses]
    assert not found.accepted
    assert not found.gate.accepted
    assert verdict_of(found).startswith(f"No: the measurements look wrong. {suspicion.sentence}.")
    assert answer_of(found) == verdict_of(found)
    shown = dataset_of(found).attrs
    assert shown["accepted"] == 0
    assert json.loads(shown["reasons"])[0] == {
        "code": "data-look-wrong",
        "sentence": f"the measurements look wrong. {suspicion.sentence}",
    }


def test_the_headline_is_a_number_too() -> None:
    found = delta("positions")
    within = found.dataset.attrs["position_within"]
    assert f"{within * 1e6:.0f} µm at the worst pose (95 %)" in found.gate.answer
    # Of one to three alike directions, of the pose that is worst by either.
    largest = np.sqrt(np.linalg.eigvalsh(found.gate.after.covariance)[:, -1].max())
    assert 1.959 * largest < within < 2.796 * largest
    assert found.dataset.attrs["rotation_within"] == 0.0


def test_what_might_go_unnoticed_is_a_number_too() -> None:
    found = delta("positions")
    said = found.external_reliability
    assert said is not None
    assert found.dataset.attrs["position_unnoticed"] == said.position > 0.0
    assert found.dataset.attrs["rotation_unnoticed"] == said.rotation
    bias = found.dataset["minimal_detectable_bias"].values
    np.testing.assert_array_equal(bias, said.minimal_detectable_bias)
    # Of a reading that the others check fully it is 7.6 of its standard deviations; of none less.
    uncertainty = found.dataset["uncertainty"].values
    assert (bias >= 7.6 * uncertainty).all()
    assert np.isfinite(bias).any()


def test_saving_is_refused_where_the_answer_is_no(tmp_path: Path) -> None:
    found = delta("heights", use_prior=False)
    path, original = tmp_path / "calibrated.toml", DATA / "delta_printer.toml"
    with pytest.raises(RequestError) as refused:
        save(found, path, original=original, date="2026-01-31")
    assert [each.code for each in refused.value.problems] == ["calibration-refused"]
    assert not path.exists()
    forced = save(found, path, original=original, date="2026-01-31", force=True)
    assert forced.calibration is not None
    assert forced.calibration.warning
    assert verdict_of(found).split(" ")[0] == "No:"


def test_what_is_saved_is_the_calibrated_machine(tmp_path: Path) -> None:
    found = delta("positions")
    path = tmp_path / "calibrated.toml"
    written = save(
        found,
        path,
        original=DATA / "delta_printer.toml",
        date="2026-01-31",
        controller_holds="calibrated",
    )
    np.testing.assert_allclose(written.nominal, found.calibrated().nominal, rtol=1e-14)
    uncertainty = tp.uncertainty(written, found.poses)["standard_uncertainty"]
    np.testing.assert_allclose(uncertainty, found.gate.after.standard, rtol=1e-6)
