"""One population: a pose is the same run's in every command, or says why it is not.

The machine as drawn and its sources at their shifts decide whether a pose belongs to a run. What a
command finds inside the bands is its own reason to leave a pose out, or samples that failed, and
never takes the pose out of the population of another.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import truepose as tp
from machine_under_test import OK, MachineUnderTest
from made_source import MadeSource, with_sources
from random_machines import DrawnMachine
from truepose import _kernel
from truepose.sources import Deviation

SAMPLES = 200
SMALL, LARGE = 1e-3, 0.4
"""Of the characteristic length: a change of the lengths with which machines go on, and not."""
HALVINGS = 30

OWN_REASONS = {
    "budget": {"band"},
    "compensate": {"band"} | {f"correction_{name}" for name in _kernel.STATUS},
    "worst_case": {"band"},
    "bounds": {"band"},
    "monte_carlo": {"band"},
    "uncertainty": set(),
    "shares": {"band"},
}


def poses_about_the_limit(machine: MachineUnderTest) -> NDArray[np.float64]:
    """(18, n_commanded): 6 of the workspace, 3 out of reach, 9 just within it."""
    inside, wild = machine.poses[:6], machine.wild_poses

    def good(poses: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.asarray(machine.kernel.place(poses)[2] == OK)

    out = wild[~good(wild)][:9]
    near, far = np.repeat(inside[:1], len(out), axis=0), out.copy()
    for _ in range(HALVINGS):
        middle = 0.5 * (near + far)
        reached = good(middle)[:, np.newaxis]
        near, far = np.where(reached, middle, near), np.where(reached, far, middle)
    # From there 0 to 5 % of the way back.
    back = np.linspace(0.0, 0.05, len(out))[:, np.newaxis]
    return np.concatenate([inside, out[:3], near + back * (inside[:1] - near)])


def known(machine: MachineUnderTest) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What the two known sources make of the lengths at every pose, each (18, n_length), m."""
    size, count = machine.kernel.characteristic_length, len(machine.kernel.length_parameters)
    random = np.random.default_rng(machine.seed + 40)
    one, other = (SMALL * size * random.uniform(-1, 1, (18, count)) for _ in range(2))
    one[1:3] = LARGE * size * random.choice([-1.0, 1.0], count)
    other[1] = -one[1]
    return one, other


def out_of_the_run(machine: MachineUnderTest, poses: NDArray[np.float64]) -> set[int]:
    """Poses to which the kernel does not take the machine as drawn, with one, other or both."""
    kernel = machine.kernel
    columns = np.asarray(kernel.length_parameters, np.intp)
    joints, placements, status = kernel.place(poses)
    good = status == OK
    one, other = known(machine)
    for moved in (one, other, one + other):
        good &= kernel.displacement(joints, placements, columns, moved)[1] == OK
    return set(np.flatnonzero(~good).tolist())


def loosely_made(machine: MachineUnderTest) -> tp.Machine:
    """The machine with three sources of its lengths, of other sizes at every pose.

    Two known ones, which at pose 1 are large and cancel, at pose 2 are large alone and together;
    and a band that grows from pose 3 on until no machine is likely to close.
    """
    loaded = tp.load(machine.path)
    columns = np.asarray(loaded.kernel.length_parameters, np.intp)
    size = loaded.characteristic_length
    one, other = known(machine)
    random = np.random.default_rng(machine.seed + 41)
    growing = np.geomspace(SMALL, 3 * LARGE, 18)[:, np.newaxis]
    half = growing * size * random.uniform(0.5, 1.0, (18, columns.size))
    half[:3] = SMALL * size
    edge = [True] * columns.size
    return with_sources(
        loaded,
        MadeSource("one", of_block=lambda at: Deviation.of(columns, one[at.indices])),
        MadeSource("other", of_block=lambda at: Deviation.of(columns, other[at.indices])),
        MadeSource(
            "band",
            of_block=lambda at: Deviation.of(columns, half=half[at.indices], edge=edge),
            sets_overall_edges=True,
        ),
    )


def results(machine: tp.Machine, poses: NDArray[np.float64]) -> dict[str, xr.Dataset]:
    """What every command says of these poses."""
    found = {
        "budget": tp.budget(machine, poses),
        "compensate": tp.compensate(machine, poses),
        "worst_case": tp.worst_case(machine, poses),
        "monte_carlo": tp.monte_carlo(machine, poses, SAMPLES),
        "uncertainty": tp.uncertainty(machine, poses),
        "shares": tp.shares(machine, poses, samples=8),
    }
    if not machine.kernel.overconstrained:
        found["bounds"] = tp.bounds(machine, poses)
    return found


def reasons(found: xr.Dataset) -> dict[int, str]:
    """Pose -> why it is left out."""
    return dict(
        zip(
            found["left_out_index"].values.tolist(),
            found["left_out_status"].values.tolist(),
            strict=True,
        )
    )


def it_has_one_population(machine: MachineUnderTest) -> None:
    poses = poses_about_the_limit(machine)
    found = results(loosely_made(machine), poses)
    without: dict[str, dict[int, str]] = {}
    for name, result in found.items():
        out, used = reasons(result), result["pose"].values.tolist()
        assert sorted([*out, *used]) == list(range(len(poses)))
        # Every reason is a status of the kernel, or one that the command may have.
        assert set(out.values()) <= {*_kernel.STATUS, *OWN_REASONS[name]} - {"ok"}
        without[name] = {at: why for at, why in out.items() if why in _kernel.STATUS}
    # Outside of the population everywhere with one status, and inside it everywhere.
    first = without["budget"]
    assert all(each == first for each in without.values())
    assert set(first) == out_of_the_run(machine, poses)
    assert 0 < len(first) < len(poses)
    # Where the bands are widest some machines fail, which every command that meets them says.
    assert found["monte_carlo"]["failed"].any()
    assert "band" in reasons(found["worst_case"]).values()
    # A pose that the drawing already excludes has the status of the drawing.
    drawing = np.array(_kernel.STATUS)[machine.kernel.place(poses)[2]]
    assert all(first[at] == why for at, why in enumerate(drawing.tolist()) if why != "ok")
    for result in found.values():
        # Degrees of freedom are infinite where a standard uncertainty is known exactly.
        infinite = {
            str(name)
            for name, each in result.data_vars.items()
            if each.dtype.kind == "f" and np.isinf(each.values).any()
        }
        assert infinite <= {"effective_dof"}
    the_samples_say_so(found["monte_carlo"])
    if "bounds" in found:
        proven = found["bounds"].sel(pose=found["bounds"]["status"] == "proven")["pose"].values
        assert not found["monte_carlo"]["failed"].sel(pose=proven).any()


def the_samples_say_so(found: xr.Dataset) -> None:
    """Where samples failed the intervals are of all, and the numbers say of how many."""
    failed, count = found["failed"].values, found["samples"].values
    assert (failed + count == SAMPLES).all()
    too_many = failed > 0.05 * SAMPLES + 1e-9
    for name in ("lower", "upper", "shortest_lower", "magnitude_upper"):
        assert np.array_equal(np.isnan(found[name].values).all(axis=1), too_many)
    told = found.attrs["not_assembled"]
    if failed.any():
        many = f"{failed.sum():,} of {SAMPLES * failed.size:,} could not be assembled"
        assert told.startswith(many)
    else:
        assert told == "none"


def test_a_pose_has_one_status_in_all_commands_of_machines_shipped(
    shipped: MachineUnderTest,
) -> None:
    it_has_one_population(shipped)


def test_a_pose_has_one_status_in_all_commands_of_machines_drawn(drawn: DrawnMachine) -> None:
    it_has_one_population(drawn)
