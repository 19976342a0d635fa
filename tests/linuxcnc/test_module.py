"""The exported module by its public entry points and pins, without LinuxCNC running.

halcompile makes it as for a machine, and the host of `benchmarks` answers its HAL calls.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from module_under_test import DEGREE, Rig, clean

from command_line import MACHINES
from sweeps import thinned
from truepose import _kernel

EVERY = [
    "overconstrained",
    "planar_two_slider", "five_bar", "3rpr", "3rrr", "tripod", "linear_delta", "rotary_delta",
    "orthoglide", "3prs", "tricept", "pentapod", "hexapod", "hexapod_telescope", "hexaglide",
    "linapod", "walking_6psu",
]  # fmt: skip
JOINT, WORLD = 1e-9, 1e-8
"""mm, degrees."""
QUICK = {"planar_two_slider", "rotary_delta", "3prs", "hexapod"}
"""Halcompile takes a second a machine: in the quick suite some of all kinds."""
RATE = 1e-3
"""mm a cycle."""

PLANAR, HEXAPOD = "planar_two_slider", "hexapod"
FIRST = "truepose.strut-0-temperature"


@pytest.fixture(scope="module", autouse=True)
def _cleaned() -> Iterator[None]:
    yield
    clean()


def rig(stem: str, **options: str) -> Rig:
    return Rig(MACHINES / f"{stem}.toml", **options)


@pytest.fixture
def planar() -> Rig:
    """Connected and enabled, cold, at home."""
    made = rig(PLANAR)
    made.connect()
    made.set("enable", 1)
    made.update(2)
    made.inverse(made.home)
    return made


def back_and_forth(made: Rig, poses: np.ndarray, joints: np.ndarray) -> None:
    """The inverse gives these joints, and the forward solution from a pose before comes back."""
    for pose, expected in zip(poses, joints, strict=True):
        found = made.inverse(pose)
        assert found is not None
        assert np.abs(found - expected).max() < JOINT
    # Now, so that what the module remembers of the inverse is of another pose.
    for start, pose, expected in zip([made.home, *poses], poses, joints, strict=False):
        back = made.forward(expected, start)
        assert back is not None
        assert np.abs(back[made.columns] - pose).max() < WORLD
        assert not np.delete(back, made.columns).any()


@pytest.mark.parametrize("stem", thinned(["3prs", "tricept"]))
def test_a_strut_that_leans_too_far_has_no_inverse(stem: str) -> None:
    """LinuxCNC knows no such limit, so that joints beyond it must not be given."""
    made = rig(stem)
    poses = made.poses(400)
    centre = poses.mean(axis=0)
    poses = centre + 2.5 * (poses - centre)
    _, status = made.machine.inverse(poses * made.units, status=True)
    names = np.array(_kernel.STATUS)[status]
    assert {"ok", "joint_limit"} <= set(names)
    for pose, name in zip(poses, names, strict=True):
        assert (made.inverse(pose) is not None) == (name in ("ok", "out_of_travel"))


@pytest.mark.parametrize("stem", thinned(EVERY, QUICK))
def test_round_trip_of_the_nominal_machine(stem: str) -> None:
    made = rig(stem)
    assert made.module.kind == 4
    poses = made.poses(60)
    made.set("strut-0-temperature" if FIRST in made.parts else "rate-limit", 90.0)
    back_and_forth(made, poses, made.nominal(poses))
    assert made.get("failures") == 0
    assert made.get("forward-calls") == made.get("inverse-calls") == len(poses)


@pytest.mark.parametrize("stem", thinned(EVERY, QUICK))
def test_round_trip_hot_and_loaded(stem: str) -> None:
    made = rig(stem)
    made.connect()
    rng = np.random.default_rng(3)
    hot = {pin: float(rng.uniform(5.0, 45.0)) for pin in made.parts}
    load = [name for name in made.names if "-x" in name or "-y" in name or "-z" in name]
    wrench = np.zeros(6)
    for pin in load:
        kind, axis = pin.removeprefix("truepose.").split("-")
        at = "xyz".index(axis) + (3 if kind == "moment" else 0)
        wrench[at] = rng.uniform(-40.0, 40.0) if kind == "force" else rng.uniform(-2.0, 2.0)
        made.host.set(pin, wrench[at])
    made.celsius(hot)
    made.set("enable", 1)
    made.let_go()
    assert made.get("fault-code") == 0
    poses = made.poses(40, seed=2)
    expected = made.corrected(poses, hot, wrench)
    assert np.abs((expected - made.nominal(poses)) * made.joint_units).max() > 1e-6
    back_and_forth(made, poses, expected)
    # As from one cycle to the next, at 100 mm/s or 100 degrees/s.
    made.inverse(poses[-1] + 0.1)
    assert made.forward(expected[-1], poses[-1] + 0.1) is not None
    assert 0 < made.get("forward-iterations") < 12


def test_pins_swept_one_by_one() -> None:
    made = rig(HEXAPOD)
    made.connect()
    made.set("enable", 1)
    made.let_go()
    poses = made.poses(3)
    for pin in made.parts:
        for celsius in (0.0, 47.5):
            made.celsius({pin: celsius})
            made.update(2)
            joints = made.corrected(poses, {pin: celsius})
            back_and_forth(made, poses, joints)
            moved = np.abs(joints - made.nominal(poses)).max(axis=0)
            family, _, name = made.parts[pin].partition(".")
            if family == "strut":
                number = [strut.name for strut in made.machine.struts].index(name)
                assert moved[number] > 0.1
                assert np.delete(moved, number).max() < JOINT
            else:
                assert (moved > 0.01).all(), "a body moves the joints of all struts"
        made.celsius({pin: 20.0})
        made.update(2)


@pytest.mark.parametrize("stem", thinned([PLANAR, HEXAPOD, "linear_delta", "rotary_delta"], QUICK))
def test_the_forward_solution_from_anywhere(stem: str) -> None:
    """Starts that are no poses of the machine, or no numbers, are as good as home."""
    made = rig(stem)
    pose = made.poses(1)[0]
    joints = made.inverse(pose)
    assert joints is not None
    for start in (np.full(len(pose), np.nan), np.zeros(len(pose)), np.full(len(pose), 1e9)):
        found = made.forward(joints, start)
        assert found is not None
        assert np.abs(found[made.columns] - pose).max() < WORLD
    assert made.get("failures") == 0


@pytest.mark.parametrize(
    "stem", thinned([PLANAR, "3rrr", "rotary_delta", "tricept", HEXAPOD], QUICK)
)
def test_what_cannot_be_solved_fails(stem: str) -> None:
    made = rig(stem)
    made.connect()
    made.set("enable", 1)
    made.update(2)
    for failures, joint in enumerate((np.nan, np.inf, 1e7), 1):
        assert made.forward(np.full(len(made.machine.joints), joint), made.home) is None
        assert made.get("failures") == failures
    for pose in (np.full(len(made.columns), np.nan), np.full(len(made.columns), 1e7)):
        found = made.inverse(pose)
        assert found is None or np.isfinite(found).all()
    # And what can be solved is, after that.
    pose = made.poses(1)[0]
    joints = made.inverse(pose)
    assert joints is not None
    found = made.forward(joints, made.home)
    assert found is not None
    assert np.abs(found[made.columns] - pose).max() < WORLD


def test_raw_joints_before_homing() -> None:
    """LinuxCNC asks for the pose of joints that are all zero: no pose, and no end of it."""
    made = rig(HEXAPOD)
    assert made.forward(np.zeros(6), np.zeros(6)) is None
    assert made.get("failures") == 1
    assert made.get("forward-iterations") <= 800


def test_without_update_nothing_is_compensated_and_that_is_a_fault() -> None:
    made = rig(PLANAR)
    made.connect()
    made.celsius({FIRST: 45.0})
    made.inverse(made.home)
    assert not made.get("fault")
    made.set("enable", 1)
    joints = made.inverse(made.home)
    assert joints is not None
    assert np.abs(joints - made.nominal(made.home[np.newaxis])).max() < JOINT
    assert made.get("fault")
    assert made.get("fault-code") == 4
    made.update()
    assert not made.get("fault")
    for _ in range(300):  # it was taken off the thread again
        made.forward(joints, made.home)
    assert made.get("fault-code") == 4


def test_compensation_moves_at_the_rate_limit(planar: Rig) -> None:
    expected = planar.corrected(planar.home[np.newaxis], {FIRST: 45.0})[0]
    start = planar.inverse(planar.home)
    planar.celsius({FIRST: 45.0})
    joints = [start]
    while len(joints) < 400:
        planar.update()
        joints.append(planar.inverse(planar.home))
    steps = np.diff(joints, axis=0)
    full = float(np.abs(expected - start).max())
    assert np.abs(joints[-1] - expected).max() < JOINT
    assert steps[:, 0].max() < RATE * (1 + 1e-9)
    assert np.abs(steps[:, 1]).max() < JOINT
    # Steadily, and in no more cycles than it takes.
    moving = np.flatnonzero(np.abs(steps[:, 0]) > 1e-12)
    assert len(moving) == pytest.approx(full / RATE, abs=2)
    assert np.abs(steps[moving[:-1], 0] / RATE - 1).max() < 1e-3


@pytest.mark.parametrize("stem", [PLANAR, HEXAPOD, "linear_delta", "rotary_delta", "tricept"])
def test_whatever_the_pins_do_no_joint_moves_faster(stem: str) -> None:
    """Temperatures, forces, enable and clamp jump about together, NaN among them."""
    made = rig(stem)
    made.connect()
    made.set("force-max", 0.0)
    made.inverse(made.home)
    rng = np.random.default_rng(11)
    arms = np.array([_arm(made, n) for n in range(len(made.machine.joints))])
    last = made.compensation
    farthest = 0.0
    for cycle in range(3000):
        if cycle % 50 == 0:
            made.celsius(
                {pin: float(rng.choice([rng.uniform(-30, 110), np.nan])) for pin in made.parts}
            )
            for pin in (
                name
                for name in made.names
                if name.startswith("truepose.force-") and name[-2] == "-"
            ):
                made.host.set(pin, float(rng.normal(0.0, 300.0)))
            made.set("enable", float(rng.random() < 0.7))
            made.set("clamp", float(rng.choice([0.0, 0.05, 0.3, 50.0])))
        made.update()
        now = made.compensation
        assert np.abs((now - last) * arms).max() < RATE * (1 + 1e-6)
        farthest = max(farthest, float(np.abs(now * arms).max()))
        last = now
    assert farthest > 0.04


def _arm(made: Rig, joint: int) -> float:
    """mm of the end of a joint's arm per mm or degree, by the kernel's joint centres."""
    if made.joint_units[joint] == 1e-3:
        return 1.0
    machine = made.machine
    arm = next(d for d in machine.drives if d.name == machine.joints[joint])
    strut = next(n for n, s in enumerate(machine.struts) if s.drive == arm.name)
    home = made.home * made.units
    joints, placements, _ = machine.kernel.place(home[np.newaxis])
    base = machine.kernel.joint_centres(joints, placements)[0, strut, 0]
    axis = np.array(arm.fields["axis"]) / np.linalg.norm(arm.fields["axis"])
    offset = base - np.array(arm.fields["origin"])
    radius = np.linalg.norm(offset - axis * (offset @ axis))
    return float(radius * DEGREE * 1e3)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 850.0, -60.0])
def test_an_implausible_temperature_holds_the_last_good_one(planar: Rig, bad: float) -> None:
    planar.celsius({FIRST: 31.0})
    planar.update(500)
    before = planar.inverse(planar.home)
    assert np.abs(before - planar.corrected(planar.home[np.newaxis], {FIRST: 31.0})).max() < JOINT
    planar.celsius({FIRST: bad})
    planar.update()
    assert planar.get("fault")
    assert planar.get("fault-code") == 1
    assert planar.get("faulty-temperatures") == 1
    planar.update(500)
    assert np.array_equal(planar.inverse(planar.home), before)
    planar.celsius({FIRST: 30.0})
    planar.update()
    assert not planar.get("fault")
    planar.update(500)
    after = planar.corrected(planar.home[np.newaxis], {FIRST: 30.0})
    assert np.abs(planar.inverse(planar.home) - after).max() < JOINT


def test_a_temperature_pin_taken_off_its_signal(planar: Rig) -> None:
    second = "truepose.strut-1-temperature"
    planar.celsius({second: 31.0})
    planar.update(500)
    before = planar.inverse(planar.home)
    planar.host.disconnect(second)
    planar.update()
    assert planar.get("fault-code") == 1
    assert planar.get("faulty-temperatures") == 2
    planar.host.set(second, 90.0)  # setp on a free pin is no sensor
    planar.update(500)
    assert np.array_equal(planar.inverse(planar.home), before)
    planar.host.set(second, 31.0)
    planar.host.connect(second)
    planar.update()
    assert planar.get("fault-code") == 0


def test_a_sensor_that_was_never_there_counts_as_cold() -> None:
    made = rig(PLANAR)
    made.set("enable", 1)
    made.celsius({FIRST: 80.0})
    made.let_go()
    assert made.get("faulty-temperatures") == 3
    found = made.inverse(made.home)
    assert np.abs(found - made.corrected(made.home[np.newaxis], {})).max() < JOINT


def test_a_jump_is_believed_once_enough_time_has_passed(planar: Rig) -> None:
    planar.set("temperature-slew", 50.0)  # K/s
    planar.celsius({FIRST: 20.04})
    planar.update()
    assert planar.get("fault-code") == 0
    planar.celsius({FIRST: 25.0})
    planar.update(98)
    assert planar.get("fault-code") == 1
    planar.update(3)
    assert planar.get("fault-code") == 0


def test_a_force_that_is_not_measured_is_a_constant(planar: Rig) -> None:
    planar.set("force-x", 400.0)
    planar.update(3000)
    assert planar.get("fault-code") == 0
    expected = planar.corrected(planar.home[np.newaxis], {}, [400.0, 0, 0, 0, 0, 0])
    assert np.abs(planar.inverse(planar.home) - expected).max() < JOINT


@pytest.mark.parametrize("bad", [np.nan, 1e9, None])
def test_a_force_sensor_that_fails_holds_the_last_good_value(
    planar: Rig, bad: float | None
) -> None:
    planar.host.connect("truepose.force-x")
    planar.set("force-x", 400.0)
    planar.update(3000)
    before = planar.inverse(planar.home)
    if bad is None:
        planar.host.disconnect("truepose.force-x")
        planar.set("force-x", 0.0)
    else:
        planar.set("force-x", bad)
    planar.update(1000)
    assert planar.get("fault-code") == 2
    assert np.array_equal(planar.inverse(planar.home), before)


def test_the_clamp(planar: Rig) -> None:
    nominal = planar.nominal(planar.home[np.newaxis])[0]
    full = planar.corrected(planar.home[np.newaxis], {FIRST: 60.0})[0] - nominal
    assert full[0] > 0.2
    planar.set("clamp", 0.1)
    planar.celsius({FIRST: 60.0})
    planar.update(2000)
    assert planar.get("clamped")
    clamped = nominal + np.array([0.1, 0.0])
    assert planar.inverse(planar.home) == pytest.approx(clamped, abs=JOINT)
    assert planar.compensation == pytest.approx([0.1, 0.0], abs=JOINT)
    back = planar.forward(clamped, planar.home)
    assert np.abs(back[planar.columns] - planar.home).max() < WORLD
    planar.set("clamp", 5.0)
    planar.update(2000)
    assert not planar.get("clamped")
    assert planar.inverse(planar.home) == pytest.approx(nominal + full, abs=JOINT)
    for useless in (-1.0, np.nan):
        planar.set("clamp", useless)
        planar.update(2000)
        assert planar.inverse(planar.home) == pytest.approx(nominal, abs=JOINT)


def test_enable_and_disable_fade(planar: Rig) -> None:
    nominal = planar.nominal(planar.home[np.newaxis])[0]
    planar.celsius({FIRST: 45.0})
    planar.update(1000)
    full = planar.inverse(planar.home)
    for enabled, goal in ((0, nominal), (1, full)):
        planar.set("enable", enabled)
        planar.update()
        step = np.abs(planar.inverse(planar.home) - (full if enabled == 0 else nominal)).max()
        assert 0.9 * RATE < step < RATE * (1 + 1e-9)
        planar.update(1000)
        assert planar.inverse(planar.home) == pytest.approx(goal, abs=JOINT)
    assert not planar.get("fault")


@pytest.mark.parametrize(
    ("rate", "code"), [(0.0, 0), (-0.0, 0), (-1e-12, 16), (-1.0, 16), (np.nan, 16), (np.inf, 16)]
)
def test_a_rate_limit_that_is_none_holds_everything(planar: Rig, rate: float, code: int) -> None:
    """Zero may be meant, and is no fault; what is no rate is one, as long as it stands there."""
    planar.celsius({FIRST: 45.0})
    planar.update(50)  # on the way
    before = planar.inverse(planar.home)
    planar.set("rate-limit", rate)
    planar.celsius({FIRST: 47.0})
    planar.update(1000)
    assert np.array_equal(planar.inverse(planar.home), before)
    assert planar.get("fault-code") == code
    assert planar.get("fault") == (code > 0)
    planar.set("enable", 0)
    planar.update(1000)
    assert np.array_equal(planar.inverse(planar.home), before)
    planar.set("enable", 1)
    planar.set("rate-limit", 1.0)
    planar.update()
    assert planar.get("fault-code") == 0
    step = np.abs(planar.inverse(planar.home) - before).max()
    assert 0.9 * RATE < step < RATE * (1 + 1e-9)


def test_fade_takes_the_compensation_out_and_puts_it_back(planar: Rig) -> None:
    nominal = planar.nominal(planar.home[np.newaxis])[0]
    planar.celsius({FIRST: 45.0})
    planar.update(1000)
    full = planar.inverse(planar.home)
    assert not planar.get("faded")
    cycles = int(np.abs(full - nominal).max() / RATE)
    for fade, goal in ((1, nominal), (0, full)):
        joints = [planar.inverse(planar.home)]
        planar.set("fade", fade)
        for _ in range(cycles + 10):
            planar.update()
            joints.append(planar.inverse(planar.home))
            # It is out when it is out to the last digit, and not before.
            assert planar.get("faded") == np.array_equal(planar.compensation, [0.0, 0.0])
        steps = np.abs(np.diff(joints, axis=0)).max(axis=1)
        assert steps.max() < RATE * (1 + 1e-9)
        assert steps[: cycles - 1].min() > 0.99 * RATE
        assert joints[-1] == pytest.approx(goal, abs=JOINT)
    assert planar.get("fault-code") == 0


def test_fade_goes_before_enable_and_waits_for_neither_sensors_nor_time(planar: Rig) -> None:
    planar.celsius({FIRST: 45.0})
    planar.update(1000)
    planar.set("fade", 1)
    planar.celsius({FIRST: np.nan})  # a fault keeps temperatures, and not the share
    planar.update(1000)
    assert planar.get("faded")
    planar.set("enable", 0)
    planar.update(1000)
    planar.set("enable", 1)
    planar.update(1000)
    assert planar.get("faded")
    planar.set("rate-limit", np.nan)  # everything is kept: it does not come back
    planar.set("fade", 0)
    planar.update(1000)
    assert planar.get("faded")


def test_it_is_faded_from_the_start() -> None:
    made = rig(PLANAR)
    assert made.get("faded")
    made.update()
    assert made.get("faded")


@pytest.mark.parametrize("stem", thinned([PLANAR, "3rrr", "rotary_delta", HEXAPOD], QUICK))
def test_homing_again_is_refused_where_it_would_shift_the_zero(stem: str) -> None:
    made = rig(stem)
    made.connect()
    home = made.nominal(made.home[np.newaxis])[0]
    # Each part another: all by as much would hardly turn the arms of some.
    rise = {pin: 21.0 + 3.0 * number for number, pin in enumerate(made.parts)}

    def refused(joints: np.ndarray) -> bool:
        assert made.forward(joints, made.home) is not None
        made.update()
        return bool(made.get("homing-inhibit"))

    elsewhere = made.nominal(made.poses(1))[0]
    assert not refused(elsewhere)  # nothing is homed, and there is no zero to shift
    made.set("homed", 1)
    assert refused(elsewhere)
    assert not refused(home)
    for joint in range(len(home)):
        arm = _arm(made, joint)
        for off in (-1.0, 1.0):  # 0.001 mm, here and at the end of the arm of one that turns
            beside = home.copy()
            beside[joint] += off * 0.99e-3 / arm
            assert not refused(beside)
            beside[joint] += off * 0.02e-3 / arm
            assert refused(beside)
    made.celsius(rise)
    made.set("enable", 1)
    made.let_go()
    assert refused(home), "compensated"
    made.set("fade", 1)
    made.update(2)
    assert not refused(home)
    compensated = made.corrected(made.home[np.newaxis], rise)[0]
    assert refused(compensated), "faded out while the joints stood, as in joint mode"
    made.set("homing-tolerance", np.nan)
    assert refused(home)


def test_kinematics_are_a_function_of_the_pose_between_updates(planar: Rig) -> None:
    """LinuxCNC also asks for the joints of end points, in between and more than once."""
    planar.celsius({FIRST: 45.0})
    planar.update(50)
    one, other = planar.poses(2)
    first = planar.inverse(one)
    planar.inverse(other)
    planar.forward(first, other)
    planar.celsius({FIRST: 20.0})
    assert np.array_equal(planar.inverse(one), first)
