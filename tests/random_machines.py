"""Random machines for laws: five in the neighbourhood of each machine shipped, 100 in all.

    from random_machines import DRAWN, TOPICS, DrawnMachine

`MORE` are 100 besides, for laws that ask for 200.

Every one of `DRAWN` is a `MachineUnderTest` (`.path`, `.kernel`, `.poses`, ...; `.three_poses` are
enough for a law) that is drawn when it is first used, from a seed of its own: its name, such as
`hexapod-3`. `DrawnMachine("hexapod", 17)` is one more. `tests/laws/conftest.py` has them as the
fixture `drawn`, beside `shipped`; a law that serves both takes its machine from two tests:

    def test_it_holds_for_machines_shipped(shipped): it_holds(shipped)
    def test_it_holds_for_machines_drawn(drawn): it_holds(drawn)

Each is machine-file text that goes through `tp.load`:

    machine.text            the file with the topics that were drawn for it
    machine.file            the same as plain tables (machine_file.py), for a test to change
    machine.file_with(*topics)  with these topics and no others, whatever was drawn
    machine.loaded          tp.load of the file

Topics are what a file may say beside its geometry, and each has random numbers of its own, so that
leaving one out changes no other. `GEOMETRIC` ones are bands of dimensions: no loads, no
temperatures, nothing that changes with the pose. For other wishes (no gradient, every expansion
given, one material) change the tables: `for strut in rows_of(file, "strut"): ...`, then `loaded`.

The geometry has been moved by some per cent, made larger or smaller, turned, and told in other
frames, with offsets, scales and travels to match; it is verified to reach its home and all poses of
its workspace as far from singular as the machine shipped is, but for a factor, and drawn again
where it does not. What must keep its shape (more closures than freedoms) keeps it.
"""

from __future__ import annotations

import atexit
import copy
import shutil
import tempfile
import zlib
from functools import cache, cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from build_machine import MACHINES, PER_METRE, machine_files
from drawn_topics import GEOMETRIC, LOADED, TOPICS, add_topic, too_many
from drive_kinds import drive_fields, fields_of, is_strut, lengths_of, turns
from machine_file import File, file_at, loaded, rows_of, text_of
from machine_under_test import OK, MachineUnderTest
from reference_kinematics import rotation_by_vector
from truepose.errors import MachineFileError
from truepose.machine import Machine
from turned_machine import home_of, turned

Random = np.random.Generator

EACH = 5
"""Machines drawn for each shipped one."""

LEFT_OUT = 0.25
"""Share of the topics that a machine's file does not have."""

MOST_ATTEMPTS = 40
REGULAR = 0.3
"""Of the shipped machine's least conditioning, which a drawn one keeps at its poses."""

MOVED = 0.015
"""Standard deviation of a coordinate, of the machine's characteristic length."""


class DrawnMachine(MachineUnderTest):
    """The machine of this number in the neighbourhood of a shipped one."""

    like: str
    number: int

    def __init__(self, like: str, number: int) -> None:
        # The file is written when somebody asks for its path, which a test's name does not.
        object.__setattr__(self, "like", like)
        object.__setattr__(self, "number", number)

    @property
    def name(self) -> str:
        """As tests show it, and the seed of all that is drawn."""
        return f"{self.like}-{self.number}"

    def __repr__(self) -> str:
        return f"DrawnMachine({self.like!r}, {self.number})"

    @cached_property
    def path(self) -> Path:  # type: ignore[override]
        path = _folder() / f"{self.name}.toml"
        path.write_text(self.text, encoding="utf-8")
        return path

    @cached_property
    def text(self) -> str:
        return text_of(self.file)

    @cached_property
    def loaded(self) -> Machine:
        return loaded(self.file)

    @cached_property
    def topics(self) -> tuple[str, ...]:
        """Those drawn for its file, in the order of `TOPICS`; at least a tolerance."""
        random = self.random("topics")
        return tuple(t for t in TOPICS if random.uniform() > LEFT_OUT or t in GEOMETRIC)

    @cached_property
    def file(self) -> File:
        return self.file_with(*self.topics)

    def file_with(self, *topics: str) -> File:
        """The drawn geometry with these topics, and stiffnesses where one of them asks for them."""
        file = copy.deepcopy(self.geometry)
        asked = {*topics, "stiffness"} if {*topics} & {*LOADED} else {*topics}
        for topic in TOPICS:
            if topic in asked:
                add_topic(topic, file, self._parameters, self.random(topic))
        return file

    @cached_property
    def geometry(self) -> File:
        """Closures, travels and workspace alone: the first draw that stands."""
        floor = REGULAR * _least_conditioning(self.like)
        for attempt in range(MOST_ATTEMPTS):
            file = _drawn_geometry(self.like, self.random(f"geometry {attempt}"))
            if _stands(file, self.random("poses"), floor):
                return file
        raise ValueError(f"{self.name}: no draw of {MOST_ATTEMPTS} reaches its workspace")

    @cached_property
    def _parameters(self) -> dict[str, str]:
        """Name -> unit of every parameter."""
        machine = loaded(self.geometry)
        return dict(zip(machine.parameters, machine.units, strict=True))

    def random(self, stream: str) -> Random:
        """Random numbers of one purpose, the machine's own."""
        return np.random.default_rng(zlib.crc32(f"{self.name} {stream}".encode()))


DRAWN = [DrawnMachine(path.stem, number) for path in machine_files() for number in range(EACH)]
MORE = [
    DrawnMachine(path.stem, number) for path in machine_files() for number in range(EACH, 2 * EACH)
]


@cache
def _folder() -> Path:
    folder = tempfile.mkdtemp(prefix="truepose-drawn-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


@cache
def _least_conditioning(like: str) -> float:
    machine = MachineUnderTest(MACHINES / f"{like}.toml")
    return float(machine.kernel.conditioning(machine.poses).min())


def _stands(file: File, random: Random, floor: float) -> bool:
    """Whether home, the grid and 30 more poses are reached, none of them near a singularity."""
    try:
        machine = loaded(file)
    except MachineFileError:
        return False
    box = np.array([[axis.start, axis.stop] for axis in machine.workspace.axes])
    inside = box[:, 0] + random.uniform(size=(30, len(box))) * np.ptp(box, axis=1)
    poses = np.concatenate([machine.poses(), inside])
    joints, placements, status = machine.kernel.place(poses)
    if not (status == OK).all() or machine.kernel.conditioning(poses).min() < floor:
        return False
    # From home, where the machine finds its poses again.
    back, status = machine.kernel.forward(joints, status=True)
    reached = machine.kernel.pose_of(placements)
    return bool((status == OK).all() and np.allclose(back, reached, rtol=0, atol=1e-8))


def _drawn_geometry(like: str, random: Random) -> File:
    file = _skeleton(like)
    length = MachineUnderTest(MACHINES / f"{like}.toml").kernel.characteristic_length * 1000.0
    planar = "z" not in file["machine"]["dof"]
    factor = random.uniform(0.6, 1.6)
    _move_points(file, MOVED * length, random)
    _resize(file, factor)
    away = np.array([1.0, 1.0, 0.0 if planar else 1.0]) * factor * length
    turn = random.uniform(-0.3, 0.3, 3)
    if planar or file["machine"].get("commanded") == ["z", "a", "b"]:
        # A planar machine turns in its plane, a 3-PRS about the axis that its freedoms are told of.
        turn[:2] = 0.0
    rotation = rotation_by_vector(turn)
    grid = _spans(file)
    result = turned(
        file, rotation, random.uniform(-1, 1, 3) * away, random.uniform(-0.3, 0.3, 3) * away
    )
    del result["mounting"]
    if too_many(file):
        # What gives way decides where such a machine stands: it is part of its geometry.
        for strut in rows_of(result, "strut"):
            strut["stiffness"] = f"{random.uniform(30.0, 120.0):.3f} N/um"
    _shrink_workspace(result, grid, random)
    for drive in rows_of(result, "drive"):
        _tell_joint_otherwise(drive, random)
    return result


def _skeleton(like: str) -> File:
    """What a shipped file says of geometry, with travels that leave room; mm and deg."""
    shipped = file_at(MACHINES / f"{like}.toml")
    if shipped["units"]["angle"] != "deg":
        raise ValueError(f"{like}: not in deg")
    kept = {
        "drive": ("name", "kind", "travel", "working_mode", *drive_fields()),
        "strut": ("name", "drive", "base", "platform", "length", "ring_radius", "ring_axis"),
        "guide": (
            *("name", "kind", "origin", "normal", "platform", "axis"),
            *("base_axis", "platform_axis"),
        ),
    }
    limits = ("base_joint", "platform_joint")
    file: File = {
        "schema": 1,
        "machine": {"name": f"like {like}"}
        | {k: v for k, v in shipped["machine"].items() if k in ("dof", "commanded", "tool")},
        "units": {"length": "mm", "angle": "deg", "force": "N", "temperature": "degC"},
        "workspace": {k: v for k, v in shipped["workspace"].items() if k in ("grid", "home")},
    }
    for table, keys in kept.items():
        every = [{k: row[k] for k in keys if k in row} for row in rows_of(shipped, table)]
        file |= {table: every} if every else {}
    for strut, row in zip(rows_of(file, "strut"), rows_of(shipped, "strut"), strict=True):
        strut |= {end: dict(row[end]) for end in limits if "angle_limit" in row.get(end, {})}
    _resize(file, PER_METRE[shipped["units"]["length"]] * 1000.0)
    for drive in rows_of(file, "drive"):
        first, last = drive["travel"]
        angular = turns(drive["kind"])
        room = min(12.0, (350.0 - last + first) / 2) if angular else 60.0 + 0.1 * (last - first)
        if is_strut(drive["kind"]):
            shortest = 0.5 * (first + drive.get("offset", 0.0)) - drive.get("offset", 0.0)
            drive["travel"] = [max(first - room, shortest), last + room]
        else:
            drive["travel"] = [first - room, last + room]
    return file


def _move_points(file: File, by: float, random: Random) -> None:
    """Every point by some length, every direction by some angle, in the plane of a planar one."""
    planar = "z" not in file["machine"]["dof"]
    free = np.array([1.0, 1.0, 0.0 if planar else 1.0])
    platform_turns = "c" in file["machine"]["dof"]
    misfit = too_many(file)

    def moved(row: dict, key: str, step: NDArray[np.float64]) -> None:
        row[key] = (np.asarray(row.get(key, [0.0, 0.0, 0.0]), np.float64) + step).tolist()

    def step() -> NDArray[np.float64]:
        return np.asarray(by * random.normal(size=3) * free)

    for drive in rows_of(file, "drive"):
        for field in fields_of(drive["kind"]):
            if field["dimension"] == "length" and field["shape"] == 3:
                moved(drive, field["name"], step())
            # An axis of rotation stays across the plane.
            elif field["dimension"] == "direction" and (
                not planar or not (turns(drive["kind"]) or misfit)
            ):
                moved(drive, field["name"], 0.02 * random.normal(size=3) * free)
    for strut in rows_of(file, "strut"):
        both = step()
        moved(strut, "base", both)
        # A rod too many keeps its length and direction, for all of them have to fit.
        if platform_turns:
            moved(strut, "platform", both if misfit else step())
        if not misfit:
            for key in ("length", "ring_radius"):
                if key in strut:
                    strut[key] = float(strut[key]) * (1 + 0.01 * random.normal())
    for guide in rows_of(file, "guide"):
        if guide["kind"] != "universal":
            moved(guide, "origin", 0.2 * step())
            moved(guide, "platform", step())
        for key in ("normal", "base_axis", "axis", "platform_axis"):
            if key in guide:
                moved(guide, key, 0.01 * random.normal(size=3))
    tool = [0.0, 0.0, 0.0] if not platform_turns else step().tolist()
    moved(file["machine"], "tool", np.array(tool))


def _resize(file: File, factor: float) -> None:
    def times(row: dict, *keys: str) -> None:
        for key in keys:
            if key in row:
                row[key] = (factor * np.asarray(row[key], np.float64)).tolist()

    times(file["machine"], "tool")
    for drive in rows_of(file, "drive"):
        times(drive, *lengths_of(drive["kind"]))
    for row in rows_of(file, "strut"):
        times(row, "base", "platform", "length", "ring_radius")
    for row in rows_of(file, "guide"):
        times(row, "origin", "platform")
    workspace = file["workspace"]
    times(workspace.get("home", {}), "x", "y", "z")
    for name in set("xyz") & set(workspace["grid"]):
        start, stop, count = workspace["grid"][name]
        workspace["grid"][name] = [factor * start, factor * stop, count]


def _spans(file: File) -> dict[str, tuple[float, float]]:
    """(middle less home, half width) of the grid, by freedom."""
    home = home_of(file)
    return {
        name: ((span[0] + span[1]) / 2 - home[name], (span[1] - span[0]) / 2)
        for name, span in file["workspace"]["grid"].items()
    }


def _shrink_workspace(file: File, spans: dict[str, tuple[float, float]], random: Random) -> None:
    """A part of the grid about home, its ends only."""
    home = file["workspace"]["home"]
    grid = {}
    for name in file["machine"].get("commanded", file["machine"]["dof"]):
        away, half = spans.get(name, (0.0, 0.0))
        share = random.uniform(0.25, 0.5)
        middle = float(home[name]) + 0.5 * away
        ends = [middle - share * half, middle + share * half]
        # A freedom that the shipped machine's workspace leaves at home stays there.
        grid[name] = [*ends, 2 if half > 0.0 else 1]
    file["workspace"]["grid"] = grid


def _tell_joint_otherwise(drive: dict, random: Random) -> None:
    """Another offset and scale of the joint coordinate, and where screw or scale is fixed."""
    if random.uniform() < 0.3:
        return
    first, last = drive["travel"]
    before, scale = drive.get("offset", 0.0), drive.get("scale", 1.0)
    offset = before + random.uniform(-0.5, 0.5) * (last - first)
    new_scale = scale * random.uniform(0.8, 1.25)
    travel = [(end * scale + before - offset) / new_scale for end in (first, last)]
    fixed = random.uniform(*travel)
    drive |= {"offset": offset, "scale": new_scale, "travel": travel, "fixed_at": fixed}
