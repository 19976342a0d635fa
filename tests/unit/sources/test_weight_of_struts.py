"""What a strut's own weight does at its two ends, by free bodies: own statics, no virtual work."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import truepose as tp
from machine_texts import edited, load_text
from truepose.controllers.c._known_shifts import known_shifts
from truepose.errors import RequestError
from truepose.machine import Joint, Machine, Strut
from truepose.runs.poses import PoseRun
from truepose.sources import PoseBlock

Vector = NDArray[np.float64]

G = 9.80665
KILOGRAM = 5.0
SOFT = 50e6  # N/m
CENTRES = (0.2, 0.5, 0.8)

# Six struts, each 40 deg round from its base joint to its platform joint, that hang 400 mm down.
BASE_RADIUS, PLATFORM_RADIUS, HEIGHT = 0.3, 0.2, 0.4
BASES = np.radians([-10, 10, 110, 130, 230, 250])
PLATFORMS = np.radians([-50, 50, 70, 170, 190, 290])


def on_circle(radius: float, angles: Vector) -> Vector:
    """(n, 3) m."""
    return radius * np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)


BASE, PLATFORM = on_circle(BASE_RADIUS, BASES), on_circle(PLATFORM_RADIUS, PLATFORMS)

HEXAPOD = (
    """\
schema = 1
[machine]
name = "hanging hexapod"
dof = ["x", "y", "z", "a", "b", "c"]
[units]
length = "m"
angle = "deg"
[mounting]
a = 180
[each.drive]
kind = "telescopic"
travel = [0.1, 2]
[each.strut]
mass = "5 kg"
base_joint = { stiffness = "50 N/um" }
[workspace]
home = { z = 0.4 }
poses = [[0, 0, 0.4, 0, 0, 0]]
"""
    + "".join(f'[[drive]]\nname = "d{i}"\n' for i in range(6))
    + "".join(
        f'[[strut]]\nname = "{i}"\ndrive = "d{i}"\nbase = {base.tolist()}\n'
        f"platform = {platform.tolist()}\n"
        for i, (base, platform) in enumerate(zip(BASE, PLATFORM, strict=True))
    )
)

# One telescopic strut that stands upright and carries a platform that can only rise.
STANDING = """\
schema = 1
[machine]
name = "standing"
dof = ["z"]
[units]
length = "mm"
angle = "deg"
force = "N"
[[drive]]
name = "d"
kind = "telescopic"
travel = [100, 900]
stiffness = "30 N/um"
[[strut]]
name = "1"
drive = "d"
base = [0, 0, 0]
platform = [0, 0, 0]
mass = "5 kg"
[workspace]
poses = [[500]]
"""

SOFT_ENDS = """mass = "5 kg"
stiffness = "20 N/um"
base_joint = { stiffness = "50 N/um" }
platform_joint = { stiffness = "10 N/um" }
"""

# Two struts side by side that hang on the frame and hold a platform between them.
SIDE_BY_SIDE = """\
schema = 1
[machine]
name = "side by side"
dof = ["z"]
[units]
length = "mm"
angle = "deg"
[mounting]
a = 180
[[drive]]
name = "d"
kind = "slider"
axis = [0, 0, 1]
travel = [-200, 200]
working_mode = "-"
[each.strut]
drive = "d"
base = [0, 0, 0]
platform = [0, 0, 0]
length = 500
base_joint = { stiffness = "50 N/um" }
platform_joint = { stiffness = "80 N/um" }
stiffness = "120 N/um"
[[strut]]
name = "heavy"
mass = "5 kg"
centre_of_mass = 0.3
[[strut]]
name = "light"
[workspace]
poses = [[500]]
"""


@dataclasses.dataclass(frozen=True)
class Lump:
    """A point mass, kg, at a fraction of the way along a strut."""

    mass: float
    at: float


def lumps(mass: float, centre: float) -> tuple[Lump, Lump]:
    """Two halves a fifth of the strut apart, their centre of mass at `centre`."""
    return Lump(mass / 2, centre - 0.1), Lump(mass / 2, centre + 0.1)


def by_free_bodies(machine: Machine, block: PoseBlock) -> Vector:
    """(n, 6) displacement of a hexapod's tool point under its struts' weight, m and rad.

    Each strut is a chain from the base joint over a telescopic drive, ten pieces with point masses
    between them, and the platform joint. Across itself it is a beam on two supports.
    """
    result = []
    gravity = G * machine.down
    for at in range(block.indices.size):
        feet, heads = block.centres[at, :, 0], block.centres[at, :, 1]
        arms = heads - block.placements[at, :3]
        along = heads - feet
        lengths = np.linalg.norm(along, axis=1)
        along /= lengths[:, np.newaxis]
        rows = np.hstack([along, np.cross(arms, along)])
        # The platform: pulled back along every strut, and bent down by what lies on its joint.
        across = np.zeros(6)
        for k, strut in enumerate(machine.struts):
            for lump in lumps(strut.mass, strut.centre_of_mass):
                weight = lump.mass * gravity
                share = lump.at * (weight - (weight @ along[k]) * along[k])
                across += np.r_[share, np.cross(arms[k], share)]
        heads_pull = np.linalg.solve(rows.T, across)
        stretches = [
            stretch(machine, strut, lengths[k], heads_pull[k], gravity @ along[k])
            for k, strut in enumerate(machine.struts)
        ]
        result.append(np.linalg.solve(rows, stretches))
    return np.array(result)


def stretch(machine: Machine, strut: Strut, length: float, pull: float, field: float) -> float:
    """m by which a chain gives way that is pulled at its head and heavy along itself.

    `field`: m/s^2 along it, from foot to head: what lies above a link pulls on it.
    """
    drive = next(drive for drive in machine.drives if drive.name == strut.drive)
    pieces = 10

    def carried(fraction: float) -> float:
        above = [
            lump.mass for lump in lumps(strut.mass, strut.centre_of_mass) if lump.at > fraction
        ]
        return pull + field * sum(above)

    def softness(stiffness: float | None) -> float:
        return 0.0 if stiffness is None else 1.0 / stiffness

    foot = softness(strut.base_joint.stiffness) + softness(drive.stiffness)
    piece = softness(strut.axial_stiffness(length)) / pieces
    middles = (np.arange(pieces) + 0.5) / pieces
    return (
        foot * carried(0.0)
        + sum(piece * carried(middle) for middle in middles)
        + softness(strut.platform_joint.stiffness) * pull
    )


def made(
    machine: Machine, centre: float, soft: str, mounting: ArrayLike = (np.pi, 0, 0)
) -> Machine:
    """The hexapod with its struts' centres of mass, and what of them gives way."""
    joint = Joint(stiffness=SOFT)
    strut: dict[str, object] = {"centre_of_mass": centre, "base_joint": Joint()}
    strut |= {
        "base joint": {"base_joint": joint},
        "platform joint": {"platform_joint": joint},
        "strut": {"stiffness": SOFT},
        "drive": {},
        "all": {
            "base_joint": joint,
            "platform_joint": Joint(stiffness=2 * SOFT),
            "stiffness": 3 * SOFT,
        },
    }[soft]
    drive = {"stiffness": 1.5 * SOFT if soft in ("drive", "all") else None}
    a, b, c = np.asarray(mounting, float).tolist()
    return dataclasses.replace(
        machine,
        mounting=(a, b, c),
        struts=tuple(dataclasses.replace(each, **strut) for each in machine.struts),
        drives=tuple(dataclasses.replace(each, **drive) for each in machine.drives),
    )


def block_of(machine: Machine, poses: ArrayLike) -> PoseBlock:
    (block,) = PoseRun(machine, np.asarray(poses, float), machine.condition)
    return block


def test_a_hanging_hexapod_by_hand(tmp_path: Path) -> None:
    # Each strut leans by theta. Its platform end holds half its weight but for what the strut
    # itself holds: N cos(theta) = m g sin(theta)^2 / 2. Its base end holds m g cos(theta) more.
    distance = np.linalg.norm(BASE - PLATFORM, axis=1)
    assert np.ptp(distance) < 1e-15
    theta = np.arctan2(distance[0], HEIGHT)
    platform_end = KILOGRAM * G / 2 * np.sin(theta) ** 2 / np.cos(theta)
    base_end = platform_end + KILOGRAM * G * np.cos(theta)
    sinks = base_end / SOFT / np.cos(theta)
    assert sinks == pytest.approx(1.097e-6, abs=0.5e-9)
    mean = (platform_end + base_end) / 2
    assert mean / SOFT / np.cos(theta) == pytest.approx(0.607e-6, abs=0.5e-9), "with the mean"

    machine = load_text(tmp_path, HEXAPOD)
    error = tp.budget(machine).error.sel(source="loads").values[0]
    # Upside down the base frame's z points down.
    assert error[:3] == pytest.approx([0.0, 0.0, sinks], rel=1e-5, abs=1e-15)
    forces = block_of(machine, machine.poses()).end_forces
    assert forces == pytest.approx(np.broadcast_to([base_end, platform_end], (1, 6, 2)), rel=1e-9)


@pytest.mark.parametrize("soft", ["base joint", "platform joint", "strut", "drive", "all"])
@pytest.mark.parametrize("centre", CENTRES)
def test_a_hexapod_of_chains(tmp_path: Path, centre: float, soft: str) -> None:
    machine = load_text(tmp_path, HEXAPOD)
    for mounting in ((np.pi, 0.0, 0.0), (0.0, 0.0, 0.0), (0.7, -0.4, 1.0)):
        hung = made(machine, centre, soft, mounting)
        poses = [[0.02, -0.03, 0.38, 0.05, -0.1, 0.2], [0.0, 0.0, 0.4, 0.0, 0.0, 0.0]]
        block = block_of(hung, poses)
        expected = by_free_bodies(hung, block)
        found = tp.budget(hung, poses).error.sel(source="loads").values
        size = np.abs(expected[:, :3]).max()
        assert size > 1e-8
        assert np.abs(found - expected).max() < 1e-4 * size


@pytest.mark.parametrize("centre", CENTRES)
def test_a_platform_joint_below_a_hanging_strut_carries_nothing(
    tmp_path: Path, centre: float
) -> None:
    text = edited(
        STANDING,
        ("[workspace]", "[mounting]\na = 180\n[workspace]"),
        ('mass = "5 kg"', f"centre_of_mass = {centre}\n{SOFT_ENDS}"),
    )
    # It hangs: the drive and the base joint hold all of it, the strut the mean along itself.
    weight = KILOGRAM * G
    sinks = weight / 50e6 + weight / 30e6 + centre * weight / 20e6
    machine = load_text(tmp_path, text)
    error = tp.budget(machine).error.sel(source="loads").values
    assert error == pytest.approx(sinks, rel=1e-9)


def test_a_motor_behind_a_direct_scale_gives_way_for_no_one(tmp_path: Path) -> None:
    text = edited(STANDING, ('stiffness = "30 N/um"', 'stiffness = "30 N/um"\nfeedback = "direct"'))
    machine = load_text(
        tmp_path, edited(text, ('mass = "5 kg"', 'mass = "5 kg"\nstiffness = "1 N/um"'))
    )
    error = tp.budget(machine).error.sel(source="loads").values
    assert error == pytest.approx(-KILOGRAM * G / 2 / 1e6, rel=1e-9)


PULLED = "force = { z = 35 }\n"
"""Up, by 0.71 of the strut's weight: more than the platform's share, less than all."""


def test_play_is_taken_up_by_the_force_at_its_own_end(tmp_path: Path) -> None:
    text = edited(
        STANDING,
        ("platform = [", 'base_joint = { clearance = "6 um" }\nplatform = ['),
        ("platform = [", 'platform_joint = { clearance = "10 um" }\nplatform = ['),
        ('stiffness = "30 N/um"', 'stiffness = "30 N/um"\nbacklash = { play = "8 um" }'),
        ("[workspace]", f"[condition]\n{PULLED}[workspace]"),
    )
    # 35 N lift the head. The foot holds 49 N of strut and stands on its joint with 14 N.
    assert 35.0 < KILOGRAM * G < 70.0
    machine = load_text(tmp_path, text)
    found = tp.budget(machine)
    assert found.error.sel(source="clearance").values == pytest.approx(5e-6 - 3e-6, rel=1e-9)
    assert found.error.sel(source="backlash").values == pytest.approx(-4e-6, rel=1e-9)


def test_two_struts_share_a_platform_by_what_they_stretch(tmp_path: Path) -> None:
    # Chains side by side: the heads pull on each other, and both stretch by the same.
    weight, base, body, head = KILOGRAM * G, 1 / 50e6, 1 / 120e6, 1 / 80e6
    whole = base + body + head
    own = weight * (base + 0.3 * body)  # of the heavy one, were its head free
    pull = own / (2 * whole)  # on the light one
    machine = load_text(tmp_path, SIDE_BY_SIDE)
    assert machine.kernel.overconstrained
    found = tp.budget(machine)
    assert found.error.sel(source="loads").values == pytest.approx(pull * whole, rel=1e-6)
    forces = tp.strain(machine).overall_force.sel(pose=0)
    mean = {"light": pull, "heavy": -pull + 0.3 * weight}
    for name, force in mean.items():
        assert float(forces.sel(closure=name)) == pytest.approx(force, rel=1e-6)


def test_a_controller_takes_it_where_it_is_the_same_at_every_pose(tmp_path: Path) -> None:
    machine = load_text(tmp_path, edited(STANDING, ('mass = "5 kg"', SOFT_ENDS)))
    (term,) = known_shifts(machine).at_reference
    assert machine.parameters[term.parameter] == "drive.d.offset"
    # It stands: the base joint and the drive under all of it, the strut under the mean.
    weight = KILOGRAM * G
    sinks = weight / 50e6 + weight / 30e6 + weight / 2 / 20e6
    assert (term.constant, term.slope) == (pytest.approx(-sinks, rel=1e-9), 0.0)


def test_a_controller_refuses_it_where_the_struts_turn(tmp_path: Path) -> None:
    # All of the mass is at the bases: the tensions are nothing, what the base joints carry is not.
    hung = made(load_text(tmp_path, HEXAPOD), 0.0, "base joint")
    wide = load_text(tmp_path, HEXAPOD, "workspace.poses=[[0,0,0.36,0,0,0],[0,0,0.44,0,0,0]]")
    hung = dataclasses.replace(hung, workspace=wide.workspace)
    with pytest.raises(RequestError, match="loads follows from the pose"):
        known_shifts(hung)
