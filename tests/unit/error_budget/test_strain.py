"""Internal forces: what each source makes of them, and what clearances leave."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES, description_of
from machine_under_test import MachineUnderTest
from reference_kinematics import Reference, rotation_of_quaternion
from truepose.error_budget.strain import ABSORBED, strain
from truepose.errors import RequestError, TrueposeError
from truepose.machine import Machine
from truepose.sources import Deviation, PoseBlock
from truepose.sources.clearance import half_clearances

FILE = MACHINES / "overconstrained.toml"
POSES = np.array([[-0.1, 0.0], [0.03, 0.11], [0.1, 0.3]])
CLOSURES = ["l1", "l2", "r1", "r2"]
STIFFNESS = 5e7
# A force's second-order part over its first: the platform's turn and shift over a rod's length.
SECOND_ORDER = 2e-3
COLD = "condition.temperature=20"


@cache
def machine(*settings: str) -> Machine:
    return tp.load(FILE, list(settings))


def play(micrometres: float) -> str:
    """A diametral clearance at the base end of every rod; half of it is the dead zone."""
    return f'each.strut.base_joint.clearance="{micrometres} um"'


def stress(commanded: np.ndarray) -> np.ndarray:
    """(4,) the state of self-stress: forces that balance each other on the platform, of length 1.

    From the rods' lines, in NumPy, of the nominal machine.
    """
    reference = Reference(description_of(FILE))
    joints, point, rotation = reference.inverse(commanded)
    rows = reference.rows(joints, point, rotation)[:, [0, 1, 5]]
    return np.asarray(np.linalg.svd(rows.T)[2][-1])


def forces_of(residuals: np.ndarray, commanded: np.ndarray) -> np.ndarray:
    """(4,) N: rods of one stiffness share a misfit out along the state of self-stress."""
    state = stress(commanded)
    return np.asarray(STIFFNESS * (residuals @ state) * state)


def test_one_warm_rod_by_hand() -> None:
    """Rod l1 grows by 1.15e-5/K x 3 K x 0.5 m more than the others, which alone would fit."""
    found = strain(machine(), POSES).sel(source="thermal")
    expansion = machine().struts[0].expansion
    assert expansion is not None
    for at, pose in enumerate(POSES):
        growth = expansion * 0.5 * np.array([6.0, 3.0, 3.0, 3.0])
        expected = forces_of(-growth, pose)
        assert expected[0] < 0.0, "the warm rod is pressed"
        np.testing.assert_allclose(found.force_rigid[at], expected, rtol=1e-6)
        np.testing.assert_allclose(found.force[at], expected, rtol=SECOND_ORDER)
        np.testing.assert_allclose(found["strain"][at], expected / STIFFNESS, rtol=SECOND_ORDER)
    assert not found.absorbed.values.any()
    assert str(found.verdict.values) == "strains"
    assert float(found.remaining) == pytest.approx(1.0, abs=SECOND_ORDER)


def test_without_clearance_the_force_is_the_rigid_one_to_first_order() -> None:
    found = strain(machine(), POSES)
    scale = np.abs(found.force_rigid.values).max(axis=2, keepdims=True)
    assert (np.abs(found.force - found.force_rigid) < SECOND_ORDER * scale).all()
    assert (np.abs(found.force - found.force_rigid) > 0).any()


def test_the_rest_is_of_second_order() -> None:
    """Ten times the tolerance: ten times the force, a hundred times the difference."""
    names = ("tolerance.strut.*.base.y", "tolerance.strut.*.platform.y", "tolerance.drive.*.offset")
    left = {}
    for micrometres in (4, 40):
        given = [f'{name}="{micrometres} um"' for name in names]
        given.append(f'each.strut.length_tolerance="{micrometres} um"')
        found = strain(machine(COLD, *given), POSES).sel(source="tolerance")
        left[micrometres] = np.abs(found.force - found.force_rigid).values.max()
        assert left[micrometres] > 0.0
    assert left[40] / left[4] == pytest.approx(100.0, rel=0.2)


def test_corners_are_the_worst_of_all_corners() -> None:
    """The force at the corner taken, against every corner of the length tolerances."""
    only = machine(
        COLD,
        'tolerance.strut.*.base.y="0 um"',
        'tolerance.strut.*.platform.y="0 um"',
        'tolerance.drive.*.offset="0 um"',
    )
    found = strain(only, POSES).sel(source="tolerance")
    kernel = only.kernel
    joints, placements, _ = kernel.place(POSES)
    forces = np.array(
        [
            kernel.settle_at(
                joints,
                placements,
                kernel.length_parameters,
                2e-5 * np.array([signs]),
                np.zeros((1, 4)),
                np.zeros((1, 6)),
            )[1]
            for signs in itertools.product((-1.0, 1.0), repeat=4)
        ]
    )
    highest = forces.max(axis=0)
    np.testing.assert_allclose(found.force, highest, rtol=1e-9)
    assert (found.force > 0.0).all(), "a band alone: the corner that pulls"


@dataclass(frozen=True)
class Made:
    """A source of one deviation, told by the test."""

    name: ClassVar[str] = "made"
    doc: ClassVar[str] = "made"
    tables: ClassVar[dict[str, Any]] = {}
    sets_overall_edges: ClassVar[bool] = False

    made: Deviation

    def acts(self, condition: object) -> bool:
        return True

    def deviation(self, machine: Machine, condition: object, block: PoseBlock) -> Deviation:
        return self.made


def strained_by(made: Deviation, monkeypatch: pytest.MonkeyPatch) -> Any:
    import truepose.runs.run as module

    monkeypatch.setattr(module, "required_sources", lambda *_: (Made(made),))
    return strain(machine(), POSES).sel(source="made")


def test_groups_move_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both rods of a pair longer by one amount fit; one longer and one shorter do not."""
    lengths = machine().kernel.length_parameters[:2]
    pair = {"half": 2e-5, "groups": 0}
    same = strained_by(Deviation.of(lengths, **pair, sign=[[1.0, 1.0]]), monkeypatch)
    assert str(same.verdict.values) == "fits"
    assert float(same.highest_force_rigid) < 1e-6
    other = strained_by(Deviation.of(lengths, **pair, sign=[[1.0, -1.0]]), monkeypatch)
    assert str(other.verdict.values) == "strains"
    alone = strained_by(Deviation.of(lengths, half=2e-5), monkeypatch)
    np.testing.assert_allclose(other.force_rigid, alone.force_rigid, rtol=1e-9)
    misfit = np.array([2e-5, -2e-5, 0.0, 0.0])
    expected = max(np.abs(forces_of(misfit, pose)).max() for pose in POSES)
    assert float(other.highest_force) == pytest.approx(expected, rel=SECOND_ORDER)


def test_the_shift_decides_on_the_side(monkeypatch: pytest.MonkeyPatch) -> None:
    lengths = machine().kernel.length_parameters[:1]
    found = strained_by(Deviation.of(lengths, shift=1e-5, half=5e-6), monkeypatch)
    for at, pose in enumerate(POSES):
        expected = forces_of(np.array([-1.5e-5, 0.0, 0.0, 0.0]), pose)
        np.testing.assert_allclose(found.force_rigid[at], expected, rtol=1e-6)
        np.testing.assert_allclose(found.force[at], expected, rtol=SECOND_ORDER)


def test_a_source_may_touch_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    found = strained_by(Deviation.of(np.empty(0, np.intp)), monkeypatch)
    assert str(found.verdict.values) == "fits"
    assert float(found.highest_force) < 1e-6


def test_clearance_takes_its_part() -> None:
    """One state of self-stress: clearances take the sum of their halves along it."""
    found = strain(machine(play(4.0)), POSES)
    for at, pose in enumerate(POSES):
        state = stress(pose)
        taken = STIFFNESS * 2e-6 * np.abs(state).sum() * np.abs(state)
        expected = np.abs(found.force_rigid.values[at]) - taken
        assert (expected > 0.0).all()
        np.testing.assert_allclose(np.abs(found.force.values[at]), expected, rtol=SECOND_ORDER * 2)
    np.testing.assert_allclose(np.abs(found.absorbed), 2e-6, rtol=1e-9)
    assert [str(verdict) for verdict in found.verdict.values] == ["partly", "partly"]
    assert (found.remaining.values < 1.0).all()
    assert "clearance" not in found.source.values


def test_wide_clearances_absorb_everything() -> None:
    found = strain(machine(play(400.0)), POSES)
    assert np.abs(found.force.values).max() < 1e-3
    assert [str(verdict) for verdict in found.verdict.values] == ["absorbed", "absorbed"]
    assert (found.remaining.values <= ABSORBED).all()
    assert (np.abs(found["strain"].values) < 1e-10).all()
    assert (np.abs(found.absorbed.values) <= 2e-4 * (1 + 1e-9)).all()


def test_what_fits_strains_nothing() -> None:
    """All rods as warm as one another: the platform moves, and nothing is forced."""
    found = strain(machine("condition.temperature=35"), POSES).sel(source="thermal")
    assert str(found.verdict.values) == "fits"
    assert float(found.remaining) == 0.0
    assert np.abs(found.force.values).max() < 1e-3


def test_overall_is_the_sum_to_first_order() -> None:
    """Forces under the wrench and from the misfits at their shifts add up without clearance."""
    found = strain(machine(), POSES)
    thermal = found.force.sel(source="thermal").values  # tolerance has no shift
    elastic = tp.budget(machine(), POSES).force.values
    scale = np.abs(found.overall_force.values).max()
    np.testing.assert_allclose(
        found.overall_force, thermal + elastic, rtol=0, atol=SECOND_ORDER * scale
    )
    np.testing.assert_allclose(
        found["overall_strain"], found.overall_force / STIFFNESS, rtol=0, atol=1e-12
    )


def test_overall_balances_what_acts() -> None:
    """With clearances too: W^T force = wrench, at the nominal pose to first order."""
    found = strain(machine(play(5.0)), POSES)
    reference = Reference(description_of(FILE))
    for at, pose in enumerate(POSES):
        joints, point, rotation = reference.inverse(pose)
        rows = reference.rows(joints, point, rotation)[:, [0, 1, 5]]
        balance = rows.T @ found.overall_force.values[at]
        np.testing.assert_allclose(balance, [200.0, -150.0, 0.0], atol=1.0)


def upright(tmp_path: Path, strut: str, *keys: str) -> Machine:
    """The machine standing up, with more keys of its drives and its first strut, and no load."""
    text = FILE.read_text("utf-8")
    text = text.replace(
        "[each.drive]", "\n".join(["[mounting]\na = 90\n", "[each.drive]", *keys]), 1
    )
    text = text.replace('name = "l1"', f'name = "l1"\n{strut}', 1)
    path = tmp_path / "machine.toml"
    path.write_text(without(text, "force = {"), encoding="utf-8")
    return tp.load(path, [COLD])


def test_the_platforms_weight_is_in_the_overall_force(tmp_path: Path) -> None:
    upright(tmp_path, "")
    path = tmp_path / "machine.toml"
    platform = '[platform]\nmass = "10 kg"\n'
    path.write_text(path.read_text("utf-8").replace("[platform]\n", platform), encoding="utf-8")
    heavy = tp.load(path, [COLD])
    found = strain(heavy, POSES)
    reference = Reference(description_of(FILE))
    for at, pose in enumerate(POSES):
        rows = reference.rows(*reference.inverse(pose))[:, [0, 1, 5]]
        balance = rows.T @ found.overall_force.values[at]
        np.testing.assert_allclose(balance[:2], 10 * 9.80665 * heavy.down[:2], atol=0.05)
    assert np.abs(heavy.down[1]) == pytest.approx(1.0)


def test_weight_that_bends_one_base_strains(tmp_path: Path) -> None:
    """Half a carriage of 40 kg on a soft base joint of rod l1: it sinks, and its pair does not."""
    soft = upright(tmp_path, 'base_stiffness = "10 N/um"', 'mass = "40 kg"')
    found = strain(soft, POSES)
    reference = Reference(description_of(FILE))
    for at, pose in enumerate(POSES):
        joints, point, rotation = reference.inverse(pose)
        rows = reference.rows(joints, point, rotation)[:, [0, 1, 5]]
        stiffness = np.diag([1 / (1 / STIFFNESS + 1 / 1e7), *[STIFFNESS] * 3])
        sunk = 20 * 9.80665 * soft.down / 1e7
        misfit = np.array([-rows[0, :2] @ sunk[:2], 0.0, 0.0, 0.0])
        spread = np.linalg.solve(rows.T @ stiffness @ rows, rows.T @ stiffness)
        expected = stiffness @ (misfit - rows @ spread @ misfit)
        assert np.abs(expected).max() > 50.0
        np.testing.assert_allclose(found.overall_force[at], expected, rtol=SECOND_ORDER)


def test_half_clearances_add_up_over_both_joints() -> None:
    both = machine(
        'each.strut.base_joint={ clearance = "10 um" }',
        'each.strut.platform_joint={ kind = "revolute", axis = [0, 0, 1], clearance = "6 um", '
        'axial_clearance = "50 um" }',
    )
    kernel = both.kernel
    joints, placements, _ = kernel.place(POSES)
    block = PoseBlock(both, both.condition, POSES, np.arange(3), joints, placements)
    np.testing.assert_allclose(half_clearances(block), 8e-6, rtol=1e-12)


def test_a_machine_that_does_not_fit_as_drawn_is_forced_in_every_row() -> None:
    """Rod l1 longer by 0.1 mm on the drawing."""
    found = strain(machine("strut.l1.length=500.1", COLD), POSES)
    assert float(found.highest_force.sel(source="tolerance")) > 1500.0
    scale = np.abs(found.force_rigid.values).max()
    assert (np.abs(found.force - found.force_rigid) < 5 * SECOND_ORDER * scale).all()
    (thermal,) = found.verdict.sel(source="thermal").values.reshape(-1)
    assert thermal == "fits", "nothing is warm: what is there is not from this source"


def without(text: str, *keys: str) -> str:
    """A machine file's text without the lines that write these keys."""
    return "\n".join(line for line in text.splitlines() if not line.startswith(keys))


def test_only_loads_and_clearance_leave_no_row(tmp_path: Path) -> None:
    """The forces under load are there all the same."""
    path = tmp_path / "machine.toml"
    text = FILE.read_text("utf-8")
    path.write_text(
        without(text, "length_tolerance", '"strut', '"drive', "temperature = {"), encoding="utf-8"
    )
    found = strain(tp.load(path, [play(5.0)]), POSES)
    assert found.sizes["source"] == 0
    assert np.abs(found.overall_force.values).max() > 50.0
    path.write_text(
        without(text, "length_tolerance", '"strut', '"drive', "temperature = {", "force = {"),
        encoding="utf-8",
    )
    with pytest.raises(RequestError) as caught:
        strain(tp.load(path), POSES)
    assert [problem.code for problem in caught.value.problems] == ["no-source"]


def test_a_machine_with_as_many_closures_as_freedoms_is_refused() -> None:
    hexapod = tp.load(MACHINES / "hexapod.toml")
    with pytest.raises(RequestError) as caught:
        tp.strain(hexapod)
    (problem,) = caught.value.problems
    assert problem.code == "nothing-strains"
    assert problem.message.startswith("nothing strains: ")
    assert problem.found == "6 closures for 6 freedoms"
    assert problem.file == "hexapod.toml"


def test_poses_and_conditions_are_as_in_a_budget() -> None:
    found = strain(machine(), [[0.0, 0.1], [5.0, 0.0]])
    assert found.sizes["pose"] == 1
    assert list(found.left_out_status.values) == ["unreachable"]
    assert strain(machine()).sizes["pose"] == 25
    with pytest.raises(RequestError) as caught:
        strain(machine(), [[5.0, 0.0]])
    assert [problem.code for problem in caught.value.problems] == ["no-pose-left"]
    cold = machine().condition.replace(temperature=293.15, force=(0, 0, 0))
    quiet = strain(machine(), POSES, cold)
    assert np.abs(quiet.overall_force.values).max() < 1e-3
    accelerated = machine().condition.replace(acceleration=(1.0, 0.0, 0.0))
    with pytest.raises(TrueposeError) as refused:
        strain(machine(), POSES, accelerated)
    assert [problem.code for problem in refused.value.problems] == ["no-mass"]


def test_progress_is_told() -> None:
    told: list[tuple[int, int]] = []
    strain(machine(), POSES, progress=lambda done, total: told.append((done, total)))
    assert told == [(3, 3)]


def test_a_spatial_machine() -> None:
    """Eight rods for six freedoms: without clearance the forces of each corner balance."""
    path = Path(__file__).parents[2] / "machines" / "overconstrained_body.toml"
    case = MachineUnderTest(path)
    body = tp.load(path, ["each.strut.length_tolerance=0.01"])
    found = strain(body, case.poses[:4])
    joints, placements, _ = body.kernel.place(case.poses[:4])
    for at in range(4):
        rotation = rotation_of_quaternion(placements[at, 3:])
        rows = case.reference.rows(joints[at], placements[at, :3], rotation)
        stiffness = np.diag(case.reference.stiffness)
        spread = np.linalg.solve(rows.T @ stiffness @ rows, rows.T @ stiffness)
        slopes = stiffness @ (np.eye(8) - rows @ spread)
        expected = 1e-5 * np.abs(slopes).sum(axis=1)
        np.testing.assert_allclose(found.force_rigid.values[at, 0], expected, rtol=1e-7)
    scale = np.abs(found.force_rigid.values).max()
    assert (np.abs(found.force - found.force_rigid) < SECOND_ORDER * scale).all()
