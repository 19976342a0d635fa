"""The machine with all that acts on it, turned in space, gives the turned error.

Its geometry, its mounting, forces, gradients and directions turn and shift; the machine stays what
it is, and so does every error as a vector. A planar machine turns in its plane. What is told along
axes does not turn: bands of coordinates, whose boxes become others, are left out here, as are
stiffnesses along x, y and z.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Literal

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import truepose as tp
from drawn_sweeps import spread
from machine_file import File, loaded, rows_of
from machine_file_units import bare
from machine_under_test import MachineUnderTest
from random_machines import DRAWN, DrawnMachine
from reference_kinematics import angles_of, rotation_by_vector, rotation_of_quaternion
from truepose.machine import Machine
from turned_machine import turned

Floats = NDArray[np.float64]

Envelope = Literal["as filed", "none", "one"]

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
INVARIANT = ("length", "offset", "scale", "ring_radius")
"""Parameters that no frame has to do with."""

ROUNDING = 2e-13
"""m or rad: a difference of positions of a metre or two, each good to some 1e-16, and amplified."""
RELATIVE = 1e-9
SAMPLES = 64


@pytest.fixture(params=spread(DRAWN), ids=lambda machine: f"drawn-{machine.name}")
def drawn(request: pytest.FixtureRequest) -> DrawnMachine:
    """One of the 100 random machines, of which the CI takes one in five."""
    found: DrawnMachine = request.param
    return found


def without_axes(file: File, *, undirected: bool, envelope: Envelope) -> File:
    """The file without what is told along the axes of a frame.

    A guideway that may lean any way leans along two axes across it, by as much and as likely: the
    same spread in all directions, but as a worst case a square, and drawn one by one; `undirected`
    keeps it. So is a force of any direction: left out, or there although the file has none.
    """
    result = copy.deepcopy(file)
    kept = {
        key: band
        for key, band in result.pop("tolerance", {}).items()
        if key.rsplit(".", 1)[-1] in INVARIANT
    }
    result |= {"tolerance": kept} if kept else {}
    for strut in rows_of(result, "strut"):
        stiffness = strut.get("base_stiffness")
        if isinstance(stiffness, list):
            strut["base_stiffness"] = stiffness[0]
    if envelope == "none":
        result.get("condition", {}).pop("envelope", None)
    elif envelope == "one":
        across = {} if "z" in file["machine"]["dof"] else {"normal": [0.0, 0.0, 1.0]}
        # Every shipped machine has its stiffnesses; a drawn one where something acts on it.
        result.setdefault("condition", {}).setdefault("envelope", {"force": "100 N"} | across)
    for drive in rows_of(result, "drive"):
        guideway = drive.get("guideway", {})
        for key in ("squareness", "parallelism"):
            if not (undirected or isinstance(guideway.get(key), dict)):
                guideway.pop(key, None)
        if not guideway:
            drive.pop("guideway", None)
    return result


@dataclass(eq=False)
class Turned:
    """A machine, and the same one elsewhere."""

    machine: MachineUnderTest
    undirected: bool = True
    envelope: Envelope = "as filed"

    def __post_init__(self) -> None:
        random = np.random.default_rng(self.machine.seed + 40)
        turn, shift, other = random.uniform(-0.8, 0.8, 3), *random.uniform(-0.5, 0.5, (2, 3))
        if "z" not in self.machine.kernel.dof:
            turn[:2], shift[2], other[2] = 0.0, 0.0, 0.0
        self.rotation = rotation_by_vector(turn)
        file = without_axes(self.machine.file, undirected=self.undirected, envelope=self.envelope)
        file = bare(file, self.machine.parameter_units)
        self.one = loaded(file)
        file["workspace"]["home"] = attained_home(self.one)
        self.other = loaded(turned(file, self.rotation, shift, other))
        self.poses = self.machine.three_poses
        placements = self.machine.placed[1][self.machine.three]
        points = placements[:, :3] @ self.rotation.T + shift
        angles = [
            angles_of(self.rotation @ rotation_of_quaternion(each[3:]) @ self.rotation.T)
            for each in placements
        ]
        at = ["xyzabc".index(name) for name in self.other.commanded]
        self.other_poses = np.c_[points, angles][:, at]

    @cached_property
    def budgets(self) -> tuple[xr.Dataset, xr.Dataset]:
        return tp.budget(self.one, self.poses), tp.budget(self.other, self.other_poses)

    def vectors(self, errors: xr.DataArray) -> Floats:
        """(..., 6) displacement and rotation, those held by the frame at 0, as first turned."""
        return whole(errors) @ np.kron(np.eye(2), self.rotation).T

    def tensors(self, covariance: xr.DataArray) -> Floats:
        """(..., 6, 6) the same of a covariance."""
        turn = np.kron(np.eye(2), self.rotation)
        return np.asarray(turn @ whole_tensor(covariance) @ turn.T)


@cache
def turned_without_axes(machine: MachineUnderTest, envelope: Envelope) -> Turned:
    """Nothing is told along axes that a worst case or a sample would see."""
    return Turned(machine, undirected=False, envelope=envelope)


@cache
def turned_as_filed(machine: MachineUnderTest) -> Turned:
    """With guideways that lean either way."""
    return Turned(machine)


def attained_home(machine: Machine) -> dict[str, float]:
    """Home by freedom, SI: the commanded ones as filed, the parasitic ones as they follow."""
    home = dict(zip(machine.dof, machine.kernel.home.tolist(), strict=True))
    _, placement, status = machine.kernel.place([[home[name] for name in machine.commanded]])
    assert not status.any()
    return dict(zip(machine.dof, machine.kernel.pose_of(placement)[0].tolist(), strict=True))


def whole(errors: xr.DataArray) -> Floats:
    found = np.zeros((*errors.shape[:-1], 6))
    found[..., [COMPONENTS.index(name) for name in errors.component.values]] = errors.values
    return found


def whole_tensor(covariance: xr.DataArray) -> Floats:
    at = [COMPONENTS.index(name) for name in covariance.component.values]
    found = np.zeros((*covariance.shape[:-2], 6, 6))
    found[..., np.array(at)[:, None], at] = covariance.values
    return found


def assert_close(found: Floats, expected: Floats, what: str, rounding: float = ROUNDING) -> None:
    gap = np.abs(found - expected).max(initial=0.0)
    size = np.abs(expected).max(initial=0.0)
    assert gap <= rounding + RELATIVE * size, f"{what}: off by {gap:.3g} of {size:.3g}"


def what_is_known_turns(machine: MachineUnderTest) -> None:
    """Every source alone, and all together; joints and forces have no axes."""
    case = turned_as_filed(machine)
    first, second = case.budgets
    for name in first.source.values:
        before, after = (each.error.sel(source=name) for each in (first, second))
        assert_close(whole(after), case.vectors(before), f"error of {name}")
    assert_close(whole(second.overall_error), case.vectors(first.overall_error), "overall error")
    assert_close(second.joint_nominal.values, first.joint_nominal.values, "joints", 1e-11)
    tensions = slice(len(machine.kernel.length_parameters))  # the guides' are along their own axes
    before, after = (each.force.values[:, tensions] for each in (first, second))
    assert_close(after, before, "tensions", 1e-9)


def spread_turns(machine: MachineUnderTest) -> None:
    """The first-order covariance, each source's own trace, and the exact samples' moments."""
    case = turned_as_filed(machine)
    first, second = case.budgets
    for name in first.source.values:
        before, after = (
            (whole(each.uncertainty.sel(source=name)) ** 2).reshape(-1, 2, 3).sum(axis=2) ** 0.5
            for each in (first, second)
        )
        assert_close(after, before, f"uncertainty of {name}")
    first, second = (
        tp.uncertainty(case.one, case.poses),
        tp.uncertainty(case.other, case.other_poses),
    )
    gap = np.abs(whole_tensor(second.covariance) - case.tensors(first.covariance)).max()
    assert gap <= RELATIVE * np.abs(first.covariance.values).max() + ROUNDING**2


def largest_error_has_no_axes(machine: MachineUnderTest) -> None:
    """The longest error vector, to first order and at a corner."""
    case = turned_without_axes(machine, "none")
    first = tp.worst_case(case.one, case.poses[:1])
    second = tp.worst_case(case.other, case.other_poses[:1])
    for name in ("magnitude_linear", "magnitude_exact"):
        assert_close(second[name].values, first[name].values, name)


def a_force_of_any_direction_has_no_axes(machine: MachineUnderTest) -> None:
    """The longest error vector to first order where a force of known size may point anywhere.

    Its direction may be looked for, so that a millionth is as good as equal; a box would be off by
    up to sqrt 3.
    """
    case = turned_without_axes(machine, "one")
    first = tp.worst_case(case.one, case.poses[:1]).magnitude_linear.values
    second = tp.worst_case(case.other, case.other_poses[:1]).magnitude_linear.values
    off = float(np.abs(second / first - 1.0).max())
    assert off <= 1e-6, f"longest error: off by {off:.3g} of it"


def samples_turn(machine: MachineUnderTest) -> None:
    """Sample by sample."""
    case = turned_without_axes(machine, "none")
    found = []
    for one, poses in ((case.one, case.poses), (case.other, case.other_poses)):
        found.append(tp.monte_carlo(one, poses[:1], SAMPLES, machine.seed))
    first, second = found
    assert_close(whole(second["mean"]), case.vectors(first["mean"]), "mean")
    assert_close(whole_tensor(second.covariance), case.tensors(first.covariance), "covariance")
    for name in ("magnitude_mean", "magnitude_maximum"):
        assert_close(second[name].values, first[name].values, name)


def commands_are_the_same(machine: MachineUnderTest) -> None:
    """Corrected joints, of a machine that commands whole vectors."""
    case = turned_as_filed(machine)
    first = tp.compensate(case.one, case.poses)
    second = tp.compensate(case.other, case.other_poses)
    assert_close(
        second["joint_corrected"].values, first["joint_corrected"].values, "corrected joints", 1e-11
    )
    before, after = first.residual_middle, second.residual_middle
    assert_close(whole(after), case.vectors(before), "residual")


def commands_whole_vectors(machine: Machine) -> bool:
    """Whether it commands all or none of its displacement, and of its rotation."""
    free, commanded = set(machine.dof), set(machine.commanded)
    return all(
        not commanded & each or free & each <= commanded for each in map(set, ("xyz", "abc"))
    )


def test_known_errors_of_a_shipped_machine_turn_with_it(shipped: MachineUnderTest) -> None:
    what_is_known_turns(shipped)


def test_known_errors_of_a_drawn_machine_turn_with_it(drawn: DrawnMachine) -> None:
    what_is_known_turns(drawn)


def test_the_spread_of_a_shipped_machine_turns_with_it(shipped: MachineUnderTest) -> None:
    spread_turns(shipped)


def test_the_spread_of_a_drawn_machine_turns_with_it(drawn: DrawnMachine) -> None:
    spread_turns(drawn)


def test_the_largest_error_of_a_shipped_machine_has_no_axes(shipped: MachineUnderTest) -> None:
    largest_error_has_no_axes(shipped)


def test_the_largest_error_of_a_drawn_machine_has_no_axes(drawn: DrawnMachine) -> None:
    largest_error_has_no_axes(drawn)


def test_a_force_of_any_direction_on_a_shipped_machine_has_no_axes(
    shipped: MachineUnderTest,
) -> None:
    a_force_of_any_direction_has_no_axes(shipped)


def test_a_force_of_any_direction_on_a_drawn_machine_has_no_axes(drawn: DrawnMachine) -> None:
    a_force_of_any_direction_has_no_axes(drawn)


def test_samples_of_a_shipped_machine_turn_with_it(shipped: MachineUnderTest) -> None:
    samples_turn(shipped)


def test_samples_of_a_drawn_machine_turn_with_it(drawn: DrawnMachine) -> None:
    samples_turn(drawn)


def test_commands_of_a_turned_shipped_machine_are_the_same(shipped: MachineUnderTest) -> None:
    if commands_whole_vectors(shipped.loaded):
        commands_are_the_same(shipped)


def test_commands_of_a_turned_drawn_machine_are_the_same(drawn: DrawnMachine) -> None:
    if commands_whole_vectors(drawn.loaded):
        commands_are_the_same(drawn)
