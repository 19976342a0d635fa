"""Planned poses: against random ones, against simulated calibrations, and what is refused."""

from __future__ import annotations

import dataclasses
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.instruments import REGISTRY, Frame, Instrument
from truepose.calibration.planning import poses as planned_poses
from truepose.calibration.planning.comparison import compare_instruments
from truepose.calibration.planning.exchange import best
from truepose.calibration.planning.plan import MOST_POSES, Field, Plan, plan
from truepose.calibration.planning.poses import (
    CONDITIONED,
    Placed,
    home_of,
    short_way,
    weighed,
    workspace_poses,
)
from truepose.calibration.planning.readings import planned
from truepose.errors import RequestError
from truepose.machine.workspace import GridAxis, Workspace

PAGE = (Path(__file__).parents[3] / "docs" / "planning.md").read_text(encoding="utf-8")


@cache
def machine_of(name: str) -> tp.Machine:
    return tp.load(MACHINES / f"{name}.toml")


def instrument(
    machine: tp.Machine,
    kind: str,
    uncertainty: dict[str, float],
    *,
    unknown: bool = True,
    name: str = "made",
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    target: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Instrument:
    rule = REGISTRY[kind].frame
    assert rule is not None
    frame = Frame(origin)
    if unknown:
        frame = dataclasses.replace(frame, unknown=rule(list(uncertainty), machine.components))
    return Instrument(name, kind, frame, target, uncertainty=uncertainty)


def tracker(machine: tp.Machine, *, unknown: bool = True, sigma: float = 10e-6) -> Instrument:
    axes = [axis for axis in "xyz" if axis in machine.components]
    stated = dict.fromkeys(axes, sigma)
    return instrument(machine, "position", stated, unknown=unknown, name="tracker")


def ball_bar(machine: tp.Machine) -> Instrument:
    return instrument(
        machine, "distance", {"distance": 2e-6}, name="ball-bar",
        origin=(0.1, 0.0, -0.5), target=(0.05, 0.0, 0.02),
    )  # fmt: skip


CASES = {
    "hexapod": tracker,
    "linear_delta": tracker,
    "hexaglide": ball_bar,
}


@pytest.mark.parametrize("name", CASES)
def test_twenty_planned_poses_beat_a_thousand_random_sets_of_twenty(name: str) -> None:
    machine = machine_of(name)
    field = Field(machine, CASES[name](machine))
    generator = np.random.default_rng(20)
    sets = np.array([generator.choice(len(field.placed), 20, replace=False) for _ in range(1000)])
    random = field.candidates.values(sets)
    found = plan(machine, CASES[name](machine), 20)
    assert found.value < random.min()
    # And by the uncertainty itself, of position, at the best of the random sets.
    assert found.rms[-1, 0] < field.after(sets[np.argmin(random)])[0][0]


def test_a_height_probe_gains_from_planning_as_well() -> None:
    machine = machine_of("linear_delta")
    probe = instrument(machine, "coordinate", {"z": 10e-6})
    field = Field(machine, probe)
    generator = np.random.default_rng(4)
    sets = [generator.choice(len(field.placed), 20, replace=False) for _ in range(1000)]
    assert plan(machine, probe, 20).value < field.candidates.values(np.array(sets)).min()


def test_the_uncertainty_told_is_what_simulated_calibrations_show() -> None:
    """Machines drawn from the tolerances, readings with noise, fitted exactly: 1000 data sets."""
    machine = machine_of("tripod")
    found = plan(machine, tracker(machine, unknown=False), 8)
    measurements = planned(machine, found.instruments, Placed(machine, found.poses))
    problem = IdentificationProblem(machine, measurements, found.unknowns)
    generator = np.random.default_rng(8)
    factor = np.linalg.cholesky(found.unknowns.prior_covariance)
    truth = found.unknowns.prior_mean + generator.normal(size=(1000, len(factor))) @ factor.T
    noise = generator.normal(size=(1000, measurements.n_observation)) * measurements.uncertainty
    read = np.array([problem.predict(each) for each in truth]) + noise
    fitted = problem.solve(read)
    over = Placed(machine, workspace_poses(machine))
    sensitivity, _ = machine.kernel.sensitivity_at(
        over.joints, over.placements, found.unknowns.columns
    )
    errors = np.einsum("pck,sk->spc", sensitivity @ found.unknowns.effects, fitted.values - truth)
    rms = np.sqrt(np.mean(np.square(errors).sum(axis=2)))
    assert rms == pytest.approx(found.rms[-1, 0], rel=0.03)
    before = np.einsum(
        "pck,sk->spc", sensitivity @ found.unknowns.effects, found.unknowns.prior_mean - truth
    )
    assert np.sqrt(np.mean(np.square(before).sum(axis=2))) == pytest.approx(
        found.rms[0, 0], rel=0.05
    )


@cache
def small_plan() -> Plan:
    machine = machine_of("linear_delta")
    return plan(machine, tracker(machine), 9)


def test_a_plan_is_made_of_poses_that_can_be_measured() -> None:
    found = small_plan()
    machine = found.machine
    joints, _, status = machine.kernel.place(found.poses)
    assert not status.any()
    np.testing.assert_allclose(joints, found.joints, rtol=1e-12)
    assert len({tuple(pose) for pose in found.poses.tolist()}) == 9
    low, high = machine.poses().min(axis=0), machine.poses().max(axis=0)
    assert ((found.poses >= low) & (found.poses <= high)).all()
    assert sorted(found.rank) == list(range(1, 10))


def test_every_further_pose_buys_something() -> None:
    found = small_plan()
    assert found.rms.shape == (10, 2)
    assert (np.diff(found.rms[:, 0]) <= 1e-12).all()
    assert found.rms[-1, 0] < 0.9 * found.rms[0, 0]
    assert (found.highest >= found.rms).all()
    assert (found.after <= found.before).all()
    assert ((found.from_data >= 0.0) & (found.from_data <= 1.0)).all()
    weak = [found.unknowns.labels[at] for at in np.flatnonzero(found.from_data < 0.5)]
    assert list(found.prior_dominated) == weak


def test_the_curve_is_the_covariance_at_the_tool() -> None:
    """From the readings' derivatives and the prior, without what the plan itself computes."""
    machine = machine_of("tripod")
    found = plan(machine, tracker(machine, unknown=False), 5)
    assert not found.relative
    ordered = found.poses[np.argsort(found.rank)]
    over = Placed(machine, workspace_poses(machine))
    sensitivity, _ = machine.kernel.sensitivity_at(
        over.joints, over.placements, found.unknowns.columns
    )
    tool = sensitivity @ found.unknowns.effects
    for count in range(1, 6):
        measurements = planned(machine, found.instruments, Placed(machine, ordered[:count]))
        rows = IdentificationProblem(machine, measurements, found.unknowns).jacobian(
            found.unknowns.prior_mean
        )
        rows = rows / measurements.uncertainty[:, np.newaxis]
        information = rows.T @ rows + np.linalg.inv(found.unknowns.prior_covariance)
        covariance = np.linalg.inv(information)
        variance = np.einsum("pci,ij,pcj->p", tool, covariance, tool)
        assert found.rms[count, 0] == pytest.approx(np.sqrt(variance.mean()), rel=1e-6)
        assert found.highest[count, 0] == pytest.approx(np.sqrt(variance.max()), rel=1e-6)
    np.testing.assert_allclose(found.after, np.sqrt(np.diagonal(covariance)), rtol=1e-6)


def test_an_unknown_frame_leaves_open_where_the_machine_stands() -> None:
    machine = machine_of("linear_delta")
    known = plan(machine, tracker(machine, unknown=False), 9)
    found = small_plan()
    assert found.relative
    assert not known.relative
    assert found.rms[0, 0] < known.rms[0, 0]
    assert found.unknowns.count == known.unknowns.count + 6


def test_an_unknown_that_no_reading_sees_does_not_hide_where_the_machine_stands() -> None:
    """A pentapod's spindle turns, which no position shows."""
    machine = machine_of("pentapod")
    by_position = plan(machine, tracker(machine), 3, starts=0)
    pose = dict.fromkeys("xyz", 10e-6) | dict.fromkeys("abc", 20e-6)
    by_pose = plan(machine, instrument(machine, "pose", pose), 3, starts=0)
    assert by_position.relative
    np.testing.assert_allclose(by_position.rms[0], by_pose.rms[0], rtol=1e-6)


def test_less_noise_is_never_worse_and_the_criterion_can_be_the_determinant() -> None:
    machine = machine_of("tripod")
    coarse = plan(machine, tracker(machine, sigma=20e-6), 6)
    fine = plan(machine, tracker(machine, sigma=5e-6), 6)
    assert fine.rms[-1, 0] < coarse.rms[-1, 0]
    volume = plan(machine, tracker(machine), 6, criterion="determinant")
    field = Field(machine, tracker(machine))
    chosen = best(field.candidates, 6, criterion="determinant").chosen
    assert volume.value == pytest.approx(field.candidates.value(chosen, "determinant"), rel=1e-12)
    mean = plan(machine, tracker(machine), 6)
    assert mean.value <= field.candidates.value(chosen) * (1.0 + 1e-9)


def test_the_same_seed_gives_the_same_plan() -> None:
    again = plan(small_plan().machine, tracker(small_plan().machine), 9)
    np.testing.assert_array_equal(small_plan().poses, again.poses)


def test_two_instruments_read_at_every_pose() -> None:
    machine = machine_of("hexaglide")
    both = plan(machine, [tracker(machine), ball_bar(machine)], 6)
    alone = plan(machine, tracker(machine), 6)
    assert both.unknowns.count == alone.unknowns.count + 3
    assert both.value < alone.value


def test_what_nothing_determines_is_not_given_a_number() -> None:
    """A strut without a tolerance, one height and no prior: the tool is anywhere."""
    machine = machine_of("tripod")
    probe = instrument(machine, "coordinate", {"z": 10e-6}, unknown=False)
    names = [each.name for each in tolerance_free(machine)]
    found = plan(tolerance_free_machine(machine), probe, 2, identify=names)
    assert np.isinf(found.rms[:2]).all()
    assert np.isinf(found.before).all()


def tolerance_free(machine: tp.Machine) -> list[Instrument]:
    """Names of three lengths, as anything that has a name."""
    lengths = [name for name in machine.parameters if name.endswith((".length", ".offset"))][:3]
    return [Instrument(name, "position", Frame()) for name in lengths]


def tolerance_free_machine(machine: tp.Machine) -> tp.Machine:
    return dataclasses.replace(
        machine, sources=tuple(each for each in machine.sources if each.name != "tolerance")
    )


def test_poses_are_measured_again_only_where_there_are_too_few() -> None:
    machine = machine_of("tripod")
    few = machine.poses()[[0, 40, 80, 124]]
    found = plan(machine, tracker(machine), 6, candidates=few)
    assert found.repeated
    assert {tuple(pose) for pose in found.poses.tolist()} <= {tuple(p) for p in few.tolist()}
    assert not plan(machine, tracker(machine), 4, candidates=few).repeated


def test_candidates_stay_away_from_singularities(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = machine_of("tricept")
    placed = Placed(machine, workspace_poses(machine))
    monkeypatch.setattr(planned_poses, "CONDITIONED", 0.9)
    kept = Placed(machine, workspace_poses(machine)).away_from_singularities()
    assert kept.sum() == (placed.conditioning >= 0.9 * placed.conditioning.max()).sum()
    assert 0 < kept.sum() < len(placed)
    found = plan(machine, tracker(machine), 5)
    assert found.left_out == len(placed) - kept.sum()
    assert found.n_candidate == kept.sum()
    assert CONDITIONED < 0.9


@pytest.mark.parametrize("counts", [(5, 5, 5), (2, 1, 2), (200, 300, 3), (1, 1, 1), (2, 2, 900)])
def test_the_workspace_is_looked_at_finely_enough_and_its_corners_are_there(
    counts: tuple[int, int, int],
) -> None:
    machine = machine_of("linear_delta")
    ends = [(-0.05, 0.05), (-0.03, 0.03), (0.0, 0.2)]
    axes = tuple(
        GridAxis(name, low, high if count > 1 else low, count)
        for name, (low, high), count in zip("xyz", ends, counts, strict=True)
    )
    poses = workspace_poses(dataclasses.replace(machine, workspace=Workspace(axes)))
    assert len(poses) <= planned_poses.MOST_POSES
    assert len(poses) > 200 or counts in ((2, 1, 2), (1, 1, 1))
    for at, axis in enumerate(axes):
        assert {poses[:, at].min(), poses[:, at].max()} == {axis.start, axis.stop}
    corners = {tuple(p) for p in poses.tolist()}
    assert (axes[0].start, axes[1].stop, axes[2].start) in corners


def test_listed_poses_are_thinned_but_not_their_corners() -> None:
    machine = machine_of("linear_delta")
    generator = np.random.default_rng(1)
    listed = generator.uniform(-0.05, 0.05, (5000, 3))
    listed[1234] = 0.06, 0.06, 0.06
    poses = workspace_poses(dataclasses.replace(machine, workspace=Workspace(listed=listed)))
    assert planned_poses.MOST_POSES <= len(poses) <= planned_poses.MOST_POSES + 8
    assert listed[1234].tolist() in poses.tolist()


def test_the_way_through_the_poses_is_short() -> None:
    machine = machine_of("hexapod")
    poses = workspace_poses(machine)[::17][:30]
    way = short_way(machine, poses)
    assert sorted(way) == list(range(30))

    def length(order: np.ndarray) -> float:
        stops = np.concatenate([home_of(machine)[None], poses[order], home_of(machine)[None]])
        steps = np.diff(weighed(machine, stops), axis=0)
        return float(np.linalg.norm(steps, axis=1).sum())

    generator = np.random.default_rng(3)
    assert length(way) < 0.7 * min(length(generator.permutation(30)) for _ in range(200))
    assert short_way(machine, poses[:1]).tolist() == [0]


def test_less_noise_takes_fewer_readings_and_equal_instruments_equal_ones() -> None:
    machine = machine_of("tripod")
    coarse = tracker(machine, sigma=20e-6)
    fine = dataclasses.replace(tracker(machine, sigma=10e-6), name="fine")
    found = compare_instruments(machine, [coarse, fine, coarse], 12)
    assert found.counts[0] == 12
    assert found.counts[1] is not None
    assert found.counts[1] < 12
    assert found.counts[2] is not None
    assert 11 <= found.counts[2] <= 12
    assert (found.rms[1:, 0] <= found.rms[0, 0] * 1.001).all()
    assert found.sentences[0] == (f"{found.counts[1]} fine readings do what 12 tracker readings do")


def test_what_an_instrument_cannot_do_it_cannot_do_with_more_readings() -> None:
    machine = machine_of("linear_delta")
    probe = instrument(machine, "coordinate", {"z": 10e-6}, name="probe")
    found = compare_instruments(machine, [tracker(machine), probe], 6)
    assert found.counts == (6, None)
    assert found.sentences == ("not even 60 probe readings do what 6 tracker readings do",)
    assert found.rms[1, 0] > found.rms[0, 0]
    assert found.rms[1, 0] < found.before[0]


def test_the_dataset_is_what_the_page_says() -> None:
    dataset = small_plan().dataset
    rows = re.findall(r"^\| (\w+) \| ([\w, ]+) \| ([^|]+) \| .+ \|$", PAGE, re.MULTILINE)
    stated = {name: dims.split(", ") for name, dims, _ in rows}
    assert set(stated) - {"name", "pose_F"} == {
        str(name) for name in dataset.variables if not str(name).startswith("pose_")
    }
    for name, dims in stated.items():
        if name not in ("name", "pose_F"):
            assert list(dataset[name].dims) == dims
            assert {"units", "long_name"} <= set(dataset[name].attrs)
    np.testing.assert_array_equal(dataset["pose_z"], small_plan().poses[:, 2])
    assert dataset.attrs["instruments"] == "tracker"
    assert dataset.attrs["machine_hash"] == small_plan().machine.file_hash


@pytest.mark.parametrize("budget", [0, -3, 2.5, MOST_POSES + 1, "many", float("nan")])
def test_a_number_of_poses_that_cannot_be_is_refused(budget: object) -> None:
    machine = machine_of("tripod")
    with pytest.raises(RequestError) as caught:
        plan(machine, tracker(machine), budget)  # type: ignore[arg-type]
    assert [each.code for each in caught.value.problems] == ["plan-budget"]


def test_a_criterion_that_is_none_is_refused() -> None:
    machine = machine_of("tripod")
    with pytest.raises(RequestError) as caught:
        plan(machine, tracker(machine), 3, criterion="best")  # type: ignore[arg-type]
    assert [each.code for each in caught.value.problems] == ["plan-option"]


@pytest.mark.parametrize(
    ("kind", "uncertainty", "said"),
    [
        ("tracker", {"m": 1e-5}, "no such kind"),
        ("contact", {"m": 1e-5}, "nothing is to choose"),
        ("position", {}, "is not said"),
        ("coordinate", dict.fromkeys("xyz", 1e-5), "at most 2"),
        ("position", {"x": 1e-5, "y": 0.0}, "uncertainty of y"),
        ("position", {"x": float("nan")}, "uncertainty of x"),
        ("orientation", {"rad": 1e-5}, "does not move in"),
    ],
)
def test_instruments_that_cannot_be_planned_are_refused(
    kind: str, uncertainty: dict[str, float], said: str
) -> None:
    with pytest.raises(RequestError, match=said) as caught:
        plan(machine_of("tripod"), Instrument("one", kind, Frame(), uncertainty=uncertainty), 3)
    assert [each.code for each in caught.value.problems] == ["plan-instrument"]


def test_no_instrument_and_one_alone_are_refused() -> None:
    machine = machine_of("tripod")
    for call in (
        lambda: plan(machine, [], 3),
        lambda: compare_instruments(machine, [tracker(machine)], 3),
    ):
        with pytest.raises(RequestError) as caught:
            call()
        assert [each.code for each in caught.value.problems] == ["plan-instrument"]


def test_what_a_platform_does_not_move_in_is_not_read() -> None:
    machine = machine_of("planar_two_slider")
    with pytest.raises(RequestError, match="does not move in what it reads"):
        plan(machine, Instrument("probe", "coordinate", Frame(), uncertainty={"z": 1e-5}), 3)


def test_a_reading_near_a_singularity_of_its_own_is_left_out() -> None:
    """The angle of a strut about an axis that it is parallel to says nothing of the machine."""
    machine = machine_of("orthoglide")
    sensor = Instrument("sensor", "joint-angle", Frame(), uncertainty={"rad": 20e-6})
    found = plan(machine, sensor, 4)
    assert found.left_out > 0
    # Nothing was taken for known before that is not.
    known = plan(machine, tracker(machine, unknown=False), 4)
    np.testing.assert_allclose(found.rms[0], known.rms[0], rtol=1e-9)
    assert np.isfinite(found.rms).all()


def test_readings_without_a_derivative_anywhere_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        "truepose.calibration.planning.plan.whitened",
        lambda _machine, _read, unknowns, count: np.full((count, 1, unknowns.count), np.nan),
    )
    machine = machine_of("tripod")
    with pytest.raises(RequestError, match="at none of the poses") as caught:
        plan(machine, ball_bar(machine), 1)
    assert [each.code for each in caught.value.problems] == ["plan-instrument"]


def test_poses_that_are_none_and_out_of_reach_are_refused() -> None:
    machine = machine_of("tripod")
    for candidates, code in (([[1.0, 2.0]], "bad-poses"), ([[9.0, 9.0, 9.0]], "no-pose-left")):
        with pytest.raises(RequestError) as caught:
            plan(machine, tracker(machine), 3, candidates=candidates)
        assert [each.code for each in caught.value.problems] == [code]
