"""The fit: unknowns, warm and loaded rows, properties, outliers, gauge, and what is refused."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import machine_files
from machine_texts import PLANAR, edited, load_text
from made_measurements import made_measurements, poses_within, reference_condition
from truepose.calibration.identification.fit import Fit, fit
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.identification.robust import outliers
from truepose.calibration.identification.unknowns import Unknowns, unknowns_of
from truepose.calibration.instruments import Frame
from truepose.calibration.measurements import Measurements
from truepose.calibration.measurements.arrays import joined
from truepose.errors import RequestError
from truepose.machine import Condition, Machine
from truepose.machine.chains import Beam
from truepose.machine.limbs import with_limbs

FILES = {path.stem: path for path in machine_files()}
CROSSED = tp.load(FILES["planar_crossed"])


def codes(refused: pytest.ExceptionInfo[RequestError]) -> list[str]:
    return [problem.code for problem in refused.value.problems]


def tracked(machine: Machine, rows: int = 20, **others: object) -> Measurements:
    """Positions in the base frame of the machine as filed, to 10 um."""
    poses = poses_within(machine, rows, seed=3)
    return made_measurements(machine, "position", poses, values="nominal", **others)  # type: ignore[arg-type]


def read_of(
    machine: Machine, data: Measurements, unknowns: Unknowns, truth: np.ndarray, seed: int | None
) -> Measurements:
    """What the machine with `truth` shows, with noise where there is a seed."""
    read = IdentificationProblem(machine, data, unknowns).predict(truth)
    if seed is not None:
        read += data.uncertainty * np.random.default_rng(seed).standard_normal(read.size)
    return data.with_values(read)


def fitted(machine: Machine, data: Measurements, *identify: str, **how: bool) -> Fit:
    return fit(machine, data, unknowns_of(machine, data, identify), **how)


def test_unknowns_are_the_variables_of_the_tolerances() -> None:
    unknowns = unknowns_of(CROSSED, tracked(CROSSED))
    assert len(set(unknowns.names)) == unknowns.count
    for number, name in enumerate(unknowns.names):
        moved = [
            CROSSED.parameters[at] for at in unknowns.columns[unknowns.effects[:, number] != 0]
        ]
        assert name in moved or len(moved) > 1
        assert np.abs(unknowns.effects[:, number]).max() == 1.0
    assert np.isfinite(unknowns.prior_covariance).all()


def test_patterns_choose_unknowns_and_may_bring_a_band() -> None:
    data = tracked(CROSSED)
    lengths = unknowns_of(CROSSED, data, ["strut.*.length=0.3 mm"])
    assert set(lengths.names) == {f"strut.{strut.name}.length" for strut in CROSSED.struts}
    np.testing.assert_allclose(lengths.half, 0.3e-3)
    np.testing.assert_allclose(np.diagonal(lengths.prior_covariance), 0.3e-3**2 / 3.0)
    scale = unknowns_of(CROSSED, data, [f"{CROSSED.drives[0].part}.scale"])
    assert np.isinf(scale.prior_covariance[0, 0])  # without a tolerance: from the data alone


@pytest.mark.parametrize(
    ("identify", "code"),
    [
        ("strut.1.lenght", "unknown-parameter"),
        ("strut.*.length=3 kN", "bad-band"),
        ("strut.*.length=-1 mm", "bad-band"),
        ("strut.*.length=wide", "bad-band"),
    ],
)
def test_what_cannot_be_identified_is_refused(identify: str, code: str) -> None:
    with pytest.raises(RequestError) as refused:
        unknowns_of(CROSSED, tracked(CROSSED), [identify])
    assert codes(refused) == [code]


def test_a_machine_without_tolerances_has_nothing_to_identify() -> None:
    bare = dataclasses.replace(CROSSED, sources=())
    with pytest.raises(RequestError) as refused:
        unknowns_of(bare, tracked(bare))
    assert codes(refused) == ["no-unknowns"]


def test_what_is_another_number_in_every_visit_is_not_found(tmp_path: Path) -> None:
    given = (
        '[tolerance]\n"drive.d1.offset" = { band = 0.1, varies = "visit" }\n'
        '"drive.d2.offset" = { band = 0.1, group = "both", varies = "run" }\n[condition]'
    )
    machine = load_text(tmp_path, edited(PLANAR, ("[condition]", given)))
    assert unknowns_of(machine, tracked(machine)).names == ("strut.1.length",)
    for named, word in (("drive.d1.offset", "visit"), ("drive.*.offset", "run")):
        with pytest.raises(RequestError, match=f'varies = "{word}"') as refused:
            unknowns_of(machine, tracked(machine), [named])
        assert set(codes(refused)) == {"bad-prior"}


def test_a_group_whose_middles_go_their_own_way_is_refused(tmp_path: Path) -> None:
    group = (
        '[tolerance]\n"drive.d1.origin.x" = { band = [-0.1, 0.3], group = "rails" }\n'
        '"drive.d2.origin.x" = { band = [-0.3, 0.1], group = "rails" }\n[condition]'
    )
    machine = load_text(tmp_path, edited(PLANAR, ("[condition]", group)))
    with pytest.raises(RequestError) as refused:
        unknowns_of(machine, tracked(machine))
    assert codes(refused) == ["bad-prior"]
    together = load_text(
        tmp_path, edited(PLANAR, ("[condition]", group.replace("[-0.3, 0.1]", "[-0.1, 0.3]")))
    )
    unknowns = unknowns_of(together, tracked(together))
    rails = unknowns.names.index("rails")
    np.testing.assert_allclose(unknowns.effects[:, rails].sum(), 2.0)
    np.testing.assert_allclose(unknowns.prior_mean[rails], 0.1e-3)


def test_too_few_readings_say_how_many_more() -> None:
    data = tracked(CROSSED, rows=2)
    with pytest.raises(RequestError) as refused:
        fitted(CROSSED, data, use_prior=False)
    (problem,) = refused.value.problems
    assert problem.code == "too-few-measurements"
    assert problem.found == "2 rows with 4 readings"
    assert problem.expected is not None
    assert problem.expected.startswith("2 more readings: 1 more rows")


ALL = ("strut.*.base.*", "strut.*.platform.*", "strut.*.length", "drive.*")


def test_too_few_counts_rank_and_not_unknowns() -> None:
    """Sixty heights of a delta determine no more than some twenty of 66: none more is asked for."""
    machine = tp.load(FILES["linear_delta"])
    poses = poses_within(machine, 60, seed=3)
    data = made_measurements(machine, "coordinate", poses, values="nominal", frame="unknown")
    unknowns = unknowns_of(machine, data, ALL)
    assert unknowns.count > data.n_observation
    found = fit(machine, data, unknowns, use_prior=False)
    slope = found.problem.jacobian(found.values) / data.uncertainty[:, np.newaxis]
    assert np.linalg.matrix_rank(slope * found.scale, tol=1e-6) < 40
    assert len(found.null_space) >= unknowns.count - 40
    # Of six heights none can be spared, and more would see more.
    with pytest.raises(RequestError) as refused:
        fitted(machine, data.select(np.arange(60) < 6), *ALL, use_prior=False)
    assert codes(refused) == ["too-few-measurements"]


@pytest.mark.parametrize(
    ("name", "kind", "use_prior", "identify"),
    [
        ("linear_delta", "coordinate", False, ()),
        ("linear_delta", "plane", False, ()),
        ("five_bar", "contact", True, ALL),
        ("3prs", "pose", True, ALL),
        ("3prs", "distance", False, ()),
    ],
)
def test_directions_that_no_reading_sees_are_held_and_named(
    name: str, kind: str, use_prior: bool, identify: tuple[str, ...]
) -> None:
    """What noise says of them is no way to follow: the search settles, and says what it held."""
    machine = tp.load(FILES[name])
    poses = poses_within(machine, 60, seed=3)
    data = made_measurements(machine, kind, poses, values="nominal", frame="unknown")
    unknowns = unknowns_of(machine, data, identify)
    random = np.random.default_rng(1)
    truth = np.zeros(unknowns.count)
    banded = np.isfinite(unknowns.half)
    truth[banded] = unknowns.half[banded] * random.uniform(-1.0, 1.0, int(banded.sum()))
    truth[~banded] = 1e-4 * random.standard_normal(int((~banded).sum()))
    found = fit(machine, read_of(machine, data, unknowns, truth, 1), unknowns, use_prior=use_prior)
    assert found.noise < 1.5
    assert np.isinf(found.deviations).any()
    # A thousandth of the machine along what is held is less than noise, where the fit ended.
    sizes = {"m": machine.characteristic_length}
    length = np.array([sizes.get(unit, 1.0) for unit in unknowns.units])
    steps = found.null_space * found.scale
    steps /= np.abs(steps / length).max(axis=1, keepdims=True)
    assert np.linalg.norm(found.jacobian @ (1e-4 * steps).T, axis=0).max() < 1.0


def test_readings_of_no_such_machine_are_refused() -> None:
    data = tracked(CROSSED)
    far = data.with_values(data.value + 3.0 * np.sign(data.value))
    with pytest.raises(RequestError) as refused:
        fitted(CROSSED, far, use_prior=False, robust=False)
    assert codes(refused) == ["no-fit"]


def test_warm_and_loaded_rows_give_the_cold_and_free_machine() -> None:
    """Each row at a temperature and a load of its own: the same parameters as cold and free."""
    machine = tp.load(FILES["hexapod"])
    cold = reference_condition(machine)
    conditions = tuple(
        dataclasses.replace(
            cold,
            part_temperatures={"strut.2": 293.15 + row},
            default_temperature=293.15 + 0.3 * row,
            force=(10.0 * row, -40.0, 200.0),
        )
        for row in range(20)
    )
    data = tracked(machine, condition=conditions)
    unknowns = unknowns_of(machine, data)
    truth = 0.5 * unknowns.half * np.random.default_rng(2).uniform(-1.0, 1.0, unknowns.count)
    read = read_of(machine, data, unknowns, truth, None)
    plain = tracked(machine)
    shown = IdentificationProblem(machine, plain, unknowns).predict(truth)
    assert np.abs(read.value - shown).max() > 20e-6  # heat and load do show
    warm = fit(machine, read, unknowns, robust=False)
    free = fit(machine, plain.with_values(shown), unknowns, robust=False)
    np.testing.assert_allclose(warm.values, free.values, atol=0.05 * free.deviations.max())
    assert np.abs(warm.residual).max() < 0.5
    # As if they were cold, the same readings give another machine.
    wrong = fit(machine, plain.with_values(read.value), unknowns, robust=False)
    assert np.abs(wrong.residual).max() > 3.0


def test_expansion_and_compliance_are_found() -> None:
    machine = tp.load(FILES["hexapod"])
    cold = reference_condition(machine)
    random = np.random.default_rng(4)
    conditions = tuple(
        dataclasses.replace(
            cold,
            part_temperatures={
                strut.part: 293.15 + random.uniform(0.0, 20.0) for strut in machine.struts
            },
            force=tuple(random.uniform(-800.0, 800.0, 3).tolist()),
        )
        for _ in range(40)
    )
    data = tracked(machine, rows=40, condition=conditions)
    identify = ("strut.*.expansion", "strut.*.compliance")
    unknowns = unknowns_of(machine, data, identify)
    assert unknowns.units == ("1/K",) * 6 + ("1",) * 6 or set(unknowns.units) == {"1/K", "1"}
    truth = np.array([2e-6 if unit == "1/K" else 0.2 for unit in unknowns.units])
    truth *= random.uniform(-1.0, 1.0, truth.size)
    exact = fit(machine, read_of(machine, data, unknowns, truth, None), unknowns, robust=False)
    np.testing.assert_allclose(exact.values, truth, atol=1e-9 * np.abs(truth).max(), rtol=1e-6)
    noisy = fit(machine, read_of(machine, data, unknowns, truth, 5), unknowns)
    assert (np.abs(noisy.values - truth) < 5.0 * noisy.deviations).all()
    assert (noisy.deviations[np.array(unknowns.units) == "1/K"] < 1e-6).all()


def test_how_much_more_the_beams_of_limbs_give_way_is_found() -> None:
    """A modulus of 168 GPa where 210 was filed is a compliance of 1.25 times as much."""
    machine = tp.load(FILES["3prs"])
    cold = reference_condition(machine)
    random = np.random.default_rng(4)
    conditions = tuple(
        dataclasses.replace(cold, force=tuple(random.uniform(-800.0, 800.0, 3).tolist()))
        for _ in range(40)
    )
    data = tracked(machine, rows=40, condition=conditions)
    unknowns = unknowns_of(machine, data, ("limb.*.compliance", "drive.*.offset"))
    assert unknowns.names[-3:] == ("limb.1.compliance", "limb.2.compliance", "limb.3.compliance")
    truth = np.concatenate([random.uniform(-1e-5, 1e-5, 3), [0.25, -0.1, 0.05]])
    read = read_of(machine, data, unknowns, truth, None)
    exact = fit(machine, read, unknowns, robust=False, use_prior=False)
    np.testing.assert_allclose(exact.values, truth, atol=1e-9, rtol=1e-6)
    # What is read is what a machine of other moduli does: the beams alone, not the joints.
    limbs = tuple(
        dataclasses.replace(
            limb,
            chain=tuple(
                dataclasses.replace(
                    part,
                    modulus=part.modulus / (1.0 + more),
                    shear_modulus=part.shear_modulus / (1.0 + more),
                )
                if isinstance(part, Beam)
                else part
                for part in limb.chain
            ),
        )
        for limb, more in zip(machine.limbs, truth[3:], strict=True)
    )
    pose = machine.poses()[:1]
    by_modulus = with_limbs(machine, limbs).compliance(pose)
    found = machine
    for number, identified in unknowns.properties.items():
        changed = identified.changed(found, float(exact.values[number]))
        assert changed is not None
        found = changed
    np.testing.assert_allclose(found.compliance(pose), by_modulus, rtol=1e-6, atol=1e-18)
    assert np.abs(by_modulus / machine.compliance(pose) - 1.0).max() > 0.05
    noisy = fit(machine, read_of(machine, data, unknowns, truth, 5), unknowns)
    assert (np.abs(noisy.values - truth) < 5.0 * noisy.deviations).all()


def test_an_outlier_is_named_and_moves_nothing_much() -> None:
    data = tracked(CROSSED, rows=30)
    unknowns = unknowns_of(CROSSED, data)
    truth = 0.5 * unknowns.half * np.random.default_rng(1).uniform(-1.0, 1.0, unknowns.count)
    good = read_of(CROSSED, data, unknowns, truth, 7)
    values = good.value.copy()
    values[17] += 0.5e-3  # fifty standard uncertainties
    bad = good.with_values(values)
    (found,) = outliers(CROSSED, fit(CROSSED, bad, unknowns))[:1]
    assert (found.row, found.instrument) == (int(bad.row[17]), "made")
    assert abs(found.sigmas) > 40.0
    assert "sigma off" in found.sentence
    clean, robust = fit(CROSSED, good, unknowns), fit(CROSSED, bad, unknowns)
    plain = fit(CROSSED, bad, unknowns, robust=False)
    assert np.abs((robust.values - clean.values) / clean.deviations).max() < 0.5
    # Counted in full it makes all other readings suspect as well.
    assert robust.birge < 1.3
    assert plain.birge > 4.0
    np.testing.assert_allclose(robust.deviations, clean.deviations, rtol=0.2)
    assert outliers(CROSSED, clean) == ()


def test_what_is_not_determined_stays_as_filed() -> None:
    """An offset and a length that no pose tells apart: only what is seen of them moves."""
    machine = tp.load(FILES["linapod"])
    data = made_measurements(machine, "pose", poses_within(machine, 25, seed=1), values="nominal")
    identify = [f"{machine.drives[0].part}.{name}=0.1 mm" for name in ("offset", "origin.z")]
    identify += [f"{machine.drives[0].part}.origin.{axis}=0.1 mm" for axis in "xy"]
    unknowns = unknowns_of(machine, data, identify)
    free = fit(machine, data, unknowns, use_prior=False)
    assert len(free.null_space) == 1
    assert np.isinf(free.deviations).any()
    direction = free.null_space[0] * free.scale
    np.testing.assert_allclose(free.problem.jacobian(free.values) @ direction, 0.0, atol=1e-9)
    np.testing.assert_allclose(free.null_space @ (free.values / free.scale), 0.0, atol=1e-6)


def test_the_two_signs_of_a_ball_bars_plane_are_both_tried() -> None:
    """Poses in a plane see a centre over it or under it alike: the better one is kept."""
    machine = tp.load(FILES["hexaglide"])
    low = poses_within(machine, 24, seed=6)
    low[:, 2] = low[0, 2]
    for height in (-0.2, 0.2):
        frame = (0.05, -0.1, float(low[0, 2] + height))
        data = made_measurements(machine, "distance", low, frame="unknown")
        (instrument,) = data.instruments
        placed_at = dataclasses.replace(instrument.frame, origin=frame)
        known = dataclasses.replace(
            data, instruments=(dataclasses.replace(instrument, frame=placed_at),)
        )
        unknowns = unknowns_of(machine, data)
        read = IdentificationProblem(machine, known, unknowns).predict(np.zeros(unknowns.count))
        found = fit(machine, data.with_values(read), unknowns)
        assert np.abs(found.before).max() < 1e-3


def test_a_condition_that_asks_for_what_the_machine_does_not_say_is_refused() -> None:
    text = FILES["planar_crossed"].read_text(encoding="utf-8")
    assert "expansion" in text or "material" in text
    silent = dataclasses.replace(
        CROSSED, struts=tuple(dataclasses.replace(s, expansion=None) for s in CROSSED.struts)
    )
    warm = dataclasses.replace(reference_condition(CROSSED), default_temperature=300.0)
    data = tracked(CROSSED, condition=warm)
    with pytest.raises(tp.errors.TrueposeError) as refused:
        fitted(silent, data)
    assert {problem.code for problem in refused.value.problems} == {"no-expansion"}
    assert isinstance(warm, Condition)


def test_several_instruments_are_fitted_together() -> None:
    """A tracker somewhere, a ball bar with a wrong length, a camera: each says what it can."""
    machine = tp.load(FILES["hexaglide"])
    poses = poses_within(machine, 24, seed=8)
    turned = Frame(
        (1.5, -2.0, 0.4),
        (math.cos(1.3), 0.0, 0.6 * math.sin(1.3), 0.8 * math.sin(1.3)),
        (True,) * 6,
    )
    data = joined(
        made_measurements(machine, "position", poses, name="tracker", frame="unknown"),
        made_measurements(machine, "distance", poses, name="bar", bias_unknown=True),
        made_measurements(machine, "strut-direction", poses[:6], name="camera", frame="unknown"),
    )
    # Where the tracker and the camera really are nobody tells the fit.
    instruments = tuple(
        dataclasses.replace(each, frame=dataclasses.replace(turned, unknown=each.frame.unknown))
        if each.name != "bar"
        else each
        for each in data.instruments
    )
    really = dataclasses.replace(data, instruments=instruments)
    unknowns = unknowns_of(machine, data)
    assert {"tracker.frame.rx", "bar.bias.distance", "camera.frame.rz"} <= set(unknowns.names)
    truth = np.zeros(unknowns.count)
    truth[: unknowns.n_machine] = 0.5 * np.sqrt(
        np.diagonal(unknowns.prior_covariance)[: unknowns.n_machine]
    )
    truth[unknowns.names.index("bar.bias.distance")] = 35e-6
    read = data.with_values(IdentificationProblem(machine, really, unknowns).predict(truth))
    found = fit(machine, read, unknowns, robust=False)
    assert np.abs(found.residual).max() < 0.2  # nothing but the pull of the tolerances
    assert abs(found.values[unknowns.names.index("bar.bias.distance")] - 35e-6) < 5e-6
    tracker = found.measurements.instruments[0].frame
    assert np.linalg.norm(np.subtract(tracker.origin, turned.origin)) < 1e-3


def test_noise_larger_than_stated_is_found_and_believed() -> None:
    """Of 30 machines read with five times the stated noise the errors are as large as stated."""
    data = tracked(CROSSED, rows=25)
    unknowns = unknowns_of(CROSSED, data)
    random = np.random.default_rng(11)
    known = np.diagonal(np.sqrt(unknowns.prior_covariance))
    quotients, noise = [], []
    for seed in range(30):
        truth = known * random.standard_normal(unknowns.count)
        read = read_of(CROSSED, data, unknowns, truth, None)
        wide = 5.0 * data.uncertainty * np.random.default_rng(seed).standard_normal(len(read.value))
        found = fit(CROSSED, read.with_values(read.value + wide), unknowns)
        quotients.append((found.values - truth) / found.deviations)
        noise.append(found.noise)
    assert abs(np.mean(noise) - 5.0) < 0.3
    assert abs(np.sqrt(np.mean(np.square(quotients))) - 1.0) < 0.15


def test_what_is_seen_too_little_to_be_followed_counts_as_undetermined() -> None:
    """A target on a platform that hardly tilts: held where it starts, and said to be open."""
    machine = tp.load(FILES["linear_delta"])
    data = tracked(machine, rows=30, frame="unknown", target_unknown=True)
    unknowns = unknowns_of(machine, data)
    truth = np.zeros(unknowns.count)
    known = unknowns.has_prior
    truth[known] = 0.5 * np.sqrt(np.diagonal(unknowns.prior_covariance)[known])
    found = fit(machine, read_of(machine, data, unknowns, truth, 3), unknowns)
    at = [number for number, name in enumerate(unknowns.names) if ".target." in name]
    assert np.isinf(found.deviations[at]).any()
    assert np.abs(found.values[at]).max() < 1e-3


def test_variables_that_are_one_have_a_prior_all_the_same(tmp_path: Path) -> None:
    tolerance = (
        '[tolerance]\n"drive.d1.origin.x" = 0.1\n"drive.d2.origin.x" = 0.1\n'
        '[[correlation]]\nbetween = ["drive.*.origin.x"]\ncoefficient = 1.0\n[condition]'
    )
    machine = load_text(tmp_path, edited(PLANAR, ("[condition]", tolerance)))
    found = fitted(machine, tracked(machine))
    rails = [number for number, name in enumerate(found.unknowns.names) if "origin" in name]
    assert abs(found.values[rails[0]] - found.values[rails[1]]) < 1e-9


def test_what_nothing_checks_does_not_look_odd() -> None:
    """As many unknowns as readings: residuals are rounding, over a deviation that is none."""
    file = Path(__file__).parents[3] / "examples" / "data" / "printer.cfg"
    rods = ["family.effector_radius=33", "family.spacing=45"]
    found = tp.import_machine(file, settings=rods)
    result = tp.calibrate(found.machine, found.measurements, use_prior=False)
    assert result.fit.unknowns.n_machine >= result.fit.measurements.n_observation
    assert result.fit.redundancy.max() < 1e-6
    assert (result.fit.standardised == 0.0).all()
    told = tp.calibrate(found.machine, found.measurements)
    assert told.fit.redundancy.max() > 0.1
    assert np.abs(told.fit.standardised).max() > 0.01
