"""Sound machines of any usual family and size, drawn at random: none of them has a blunder.

    from sound_machines import sound_machine

    machine = sound_machine(17).loaded

A machine is drawn by its number alone (`SEED`): its family, its size from 50 mm to 5 m,
proportions, how its rails point, where the frame's origin stands and how it is turned about z, the
units of its file, joint centres off by up to 0.3 % as in a calibrated file, materials, sections or
stiffnesses, temperatures from -20 to 60 degC, tolerances from 1e-6 to 3e-3 of the struts or of a
class, forces that its struts bear, and an accuracy that is asked.

Sound means what an engineer would ask of a design, and nothing that a rule of oddities asks: every
pose of the workspace and home are reached within travel, errors grow at most thirty times
(`REGULAR`), a telescopic strut is at most `STAGES` times as long as at its shortest, no carriage
passes the middle of the machine (struts would run through each other), and the force on the tool
strains a strut that bears it alone by 1e-4. A draw that is not sound is drawn again; travels are
then those that the workspace needs, with room.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from machine_file import File, Row, loaded
from truepose.machine import Machine

Random = np.random.Generator
Points = NDArray[np.float64]

SEED = 20261124
REGULAR = 0.03
STAGES = 2.5
MOST_ATTEMPTS = 400
UNITS = {"mm": 1e-3, "m": 1.0, "in": 0.0254, "cm": 1e-2}
MODULI = {"steel": 210e9, "aluminium": 70e9, "carbon fibre": 120e9, "cast iron": 110e9}
STRAIN = 1e-4


@dataclass
class Layout:
    """A machine in m and rad, its frame as its family has it: z up, about the origin.

    `drives`: rows without travel, points and lengths in m; `struts` likewise, with the index of
    their drive; `workspace`: freedom -> (from, to).
    """

    dof: tuple[str, ...]
    drives: list[Row]
    struts: list[Row]
    workspace: dict[str, tuple[float, float]]
    commanded: tuple[str, ...] | None = None
    guides: tuple[Row, ...] = ()


def _log(random: Random, low: float, high: float) -> float:
    return float(math.exp(random.uniform(math.log(low), math.log(high))))


def _said(value: float, unit: str) -> str:
    return f"{float(value)!r} {unit}"


def _ring(radius: float, angles: Points, height: float = 0.0) -> Points:
    return np.stack(
        [radius * np.cos(angles), radius * np.sin(angles), np.full(len(angles), height)], axis=1
    )


def _pairs(half: float, turn: float = 0.0) -> Points:
    """Six angles in pairs, `half` either side of every 120 deg, so that neighbours are in order."""
    thirds = np.repeat(np.radians([0.0, 120.0, 240.0]), 2) + turn
    return np.asarray(thirds + np.tile([-half, half], 3))


def _box(
    random: Random, size: float, *freedoms: str, middle: float
) -> dict[str, tuple[float, float]]:
    sides = {}
    for freedom in freedoms:
        if freedom in "abc":
            half = math.radians(random.uniform(2.0, 15.0))
            sides[freedom] = (-half, half)
        else:
            half = size * random.uniform(0.03, 0.2)
            at = middle if freedom == "z" else 0.0
            sides[freedom] = (at - half, at + half)
    return sides


def _hexapod_joints(random: Random, size: float) -> tuple[Points, Points, float]:
    """Base joints, platform joints, and the height between them."""
    radius = 0.5 * size
    ratio = random.uniform(0.25, 0.95)
    base = _ring(radius, _pairs(math.radians(random.uniform(3.0, 27.0))))
    # Neighbours of the base go to far joints of the platform: 60 deg less their half distance.
    top = _pairs(math.radians(60.0 - random.uniform(3.0, 27.0)))
    return base, _ring(ratio * radius, top), size * random.uniform(0.4, 1.0)


def _hexapod(random: Random, size: float) -> Layout:
    """6-UPS, standing or hanging."""
    base, platform, height = _hexapod_joints(random, size)
    up = random.choice([-1.0, 1.0])
    drives: list[Row] = [{"kind": "telescopic"} for _ in range(6)]
    struts: list[Row] = [
        {"drive": at, "base": base[at], "platform": platform[at]} for at in range(6)
    ]
    box = _box(random, 0.6 * size, *"xyzabc", middle=up * height)
    return Layout(tuple("xyzabc"), drives, struts, box)


def _rail(random: Random, outward: Points) -> tuple[Points, str, float]:
    """Axis, working mode, and whether the carriage is above (+1) or below (-1) the platform.

    Upright or leaning out by up to 50 deg; counted upwards, or downwards from above.
    """
    lean = random.choice([0.0, random.uniform(-0.4, 0.85)])
    axis = np.array([0.0, 0.0, math.cos(lean)]) + math.sin(lean) * outward
    kind = random.integers(3)
    if kind == 0:
        return axis, "+", 1.0
    if kind == 1:
        return -axis, "-", 1.0
    return axis, "-", -1.0


def _hexaglide(random: Random, size: float) -> Layout:
    """6-PUS on rails all of one kind."""
    base, platform, height = _hexapod_joints(random, size)
    length = math.hypot(0.5 * size, height) * random.uniform(0.9, 1.3)
    state = random.bit_generator.state
    drives, struts = [], []
    for at in range(6):
        random.bit_generator.state = state
        outward = base[at] / np.linalg.norm(base[at])
        axis, mode, _ = _rail(random, outward)
        drives.append({"kind": "slider", "origin": base[at], "axis": axis, "working_mode": mode})
        struts.append(
            {"drive": at, "base": np.zeros(3), "platform": platform[at], "length": length}
        )
    middle = size * random.uniform(-0.5, 0.5)
    return Layout(
        tuple("xyzabc"), drives, struts, _box(random, 0.5 * size, *"xyzabc", middle=middle)
    )


def _level_hexaglide(random: Random, size: float) -> Layout:
    """6-PUS on level rails that point away from the middle, or towards it."""
    base, platform, height = _hexapod_joints(random, size)
    length = math.hypot(0.5 * size, height) * random.uniform(0.9, 1.2)
    sign = random.choice([-1.0, 1.0])
    drives, struts = [], []
    for at in range(6):
        outward = base[at] / np.linalg.norm(base[at])
        drives.append(
            {
                "kind": "slider",
                "origin": 0.1 * base[at] if sign > 0 else base[at],
                "axis": sign * outward,
                "working_mode": "+" if sign > 0 else "-",
            }
        )
        struts.append(
            {"drive": at, "base": np.zeros(3), "platform": platform[at], "length": length}
        )
    middle = height * random.choice([-1.0, 1.0])
    return Layout(
        tuple("xyzabc"), drives, struts, _box(random, 0.4 * size, *"xyzabc", middle=middle)
    )


def _pair_struts(at: int, angle: float, base: Points, platform: Points, half: float, length: float):
    across = half * np.array([-math.sin(angle), math.cos(angle), 0.0])
    return [
        {
            "drive": at,
            "base": base + side * across,
            "platform": platform + side * across,
            "length": length,
        }
        for side in (-1.0, 1.0)
    ]


def _linear_delta(random: Random, size: float) -> Layout:
    """Three rails, upright or leaning, each with a pair of parallel rods."""
    radius, effector = 0.5 * size, 0.5 * size * random.uniform(0.08, 0.4)
    length = (radius - effector) * random.uniform(1.25, 2.2)
    half = 0.5 * size * random.uniform(0.04, 0.2)
    state = random.bit_generator.state
    drives, struts = [], []
    for at in range(3):
        random.bit_generator.state = state
        angle = math.radians(90.0 + 120.0 * at)
        outward = np.array([math.cos(angle), math.sin(angle), 0.0])
        axis, mode, _ = _rail(random, outward)
        drives.append(
            {"kind": "slider", "origin": radius * outward, "axis": axis, "working_mode": mode}
        )
        struts += _pair_struts(at, angle, np.zeros(3), effector * outward, half, length)
    middle = size * random.uniform(-0.3, 0.5)
    box = _box(random, 0.6 * size, *"xyz", middle=middle)
    return Layout(tuple("xyzabc"), drives, struts, box, tuple("xyz"))


def _level_delta(random: Random, size: float) -> Layout:
    """Three level rails that point away from the middle, each with a pair of parallel rods."""
    inner, effector = 0.2 * size, 0.5 * size * random.uniform(0.08, 0.3)
    length = size * random.uniform(0.35, 0.8)
    half = 0.5 * size * random.uniform(0.04, 0.2)
    drives, struts = [], []
    for at in range(3):
        angle = math.radians(90.0 + 120.0 * at)
        outward = np.array([math.cos(angle), math.sin(angle), 0.0])
        drives.append(
            {"kind": "slider", "origin": inner * outward, "axis": outward, "working_mode": "+"}
        )
        struts += _pair_struts(at, angle, np.zeros(3), effector * outward, half, length)
    middle = length * random.uniform(0.4, 0.8) * random.choice([-1.0, 1.0])
    box = _box(random, 0.4 * size, *"xyz", middle=middle)
    return Layout(tuple("xyzabc"), drives, struts, box, tuple("xyz"))


def _rotary_delta(random: Random, size: float) -> Layout:
    """Three cranks, each with a pair of parallel rods, over or under the table."""
    radius, effector = 0.3 * size, 0.3 * size * random.uniform(0.2, 0.9)
    arm = size * random.uniform(0.2, 0.4)
    length = arm * random.uniform(1.8, 3.0)
    half = 0.5 * size * random.uniform(0.04, 0.15)
    under = random.choice([-1.0, 1.0])
    drives, struts = [], []
    for at in range(3):
        angle = math.radians(90.0 + 120.0 * at)
        outward = np.array([math.cos(angle), math.sin(angle), 0.0])
        # Arms point outward at zero; positive angles lift them.
        axis = np.array([math.sin(angle), -math.cos(angle), 0.0])
        drives.append(
            {
                "kind": "crank",
                "origin": radius * outward,
                "axis": axis,
                "working_mode": "+" if under < 0 else "-",
            }
        )
        struts += _pair_struts(at, angle, arm * outward, effector * outward, half, length)
    middle = under * length * random.uniform(0.7, 0.95)
    box = _box(random, 0.5 * size, *"xyz", middle=middle)
    return Layout(tuple("xyzabc"), drives, struts, box, tuple("xyz"))


def _tripod(random: Random, size: float) -> Layout:
    """Three telescopic struts that meet in the tool point, from floor or ceiling."""
    angles = np.radians([90.0, 210.0, 330.0]) + random.uniform(-0.25, 0.25, 3)
    base = _ring(0.5 * size, angles)
    base *= random.uniform(0.7, 1.0, (3, 1))
    height = size * random.uniform(0.3, 0.9) * random.choice([-1.0, 1.0])
    drives: list[Row] = [{"kind": "telescopic"} for _ in range(3)]
    struts: list[Row] = [
        {"drive": at, "base": base[at], "platform": np.zeros(3)} for at in range(3)
    ]
    return Layout(tuple("xyz"), drives, struts, _box(random, 0.6 * size, *"xyz", middle=height))


def _three_prs(random: Random, size: float) -> Layout:
    """Three carriages on upright rails, struts that swing in planes through the axis."""
    radius = 0.5 * size
    inner = radius * random.uniform(0.4, 0.9)
    length = (radius - inner) / math.cos(random.uniform(0.6, 1.3))
    above = random.choice([-1.0, 1.0])
    counted = random.choice([-1.0, 1.0]) if above > 0 else 1.0
    drives, struts, guides = [], [], []
    for at in range(3):
        angle = math.radians(90.0 + 120.0 * at)
        outward = np.array([math.cos(angle), math.sin(angle), 0.0])
        drives.append(
            {
                "kind": "slider",
                "origin": radius * outward,
                "axis": np.array([0.0, 0.0, counted]),
                "working_mode": "+" if above * counted > 0 else "-",
            }
        )
        struts.append(
            {"drive": at, "base": np.zeros(3), "platform": inner * outward, "length": length}
        )
        normal = np.array([-math.sin(angle), math.cos(angle), 0.0])
        guides.append({"kind": "plane", "normal": normal, "platform": inner * outward})
    box = _box(random, size, "z", "a", "b", middle=size * random.uniform(-0.3, 0.3))
    return Layout(tuple("xyzabc"), drives, struts, box, ("z", "a", "b"), tuple(guides))


def _two_sliders(random: Random, size: float) -> Layout:
    """Two carriages on parallel or on one rail, struts that meet in the tool point."""
    side = random.choice([-1.0, 1.0])
    length = 0.5 * size * random.uniform(1.1, 1.8)
    drives: list[Row] = []
    if random.uniform() < 0.5:
        for x in (-0.5 * size, 0.5 * size):
            axis = np.array([0.0, side, 0.0])
            drives.append(
                {
                    "kind": "slider",
                    "origin": np.array([x, 0.0, 0.0]),
                    "axis": axis,
                    "working_mode": "+",
                }
            )
        middle = (0.0, 0.3 * size * random.uniform(-1.0, 1.0))
    else:
        for mode in "-+":
            axis = np.array([1.0, 0.0, 0.0])
            drives.append(
                {"kind": "slider", "origin": np.zeros(3), "axis": axis, "working_mode": mode}
            )
        middle = (0.0, side * length * random.uniform(0.5, 0.85))
    struts: list[Row] = [
        {"drive": at, "base": np.zeros(3), "platform": np.zeros(3), "length": length}
        for at in range(2)
    ]
    half = size * random.uniform(0.03, 0.12, 2)
    box = {name: (middle[at] - half[at], middle[at] + half[at]) for at, name in enumerate("xy")}
    return Layout(("x", "y"), drives, struts, box)


def _five_bar(random: Random, size: float) -> Layout:
    """Two cranks, elbows outwards."""
    apart, arm = size * random.uniform(0.1, 0.35), size * random.uniform(0.25, 0.4)
    length = arm * random.uniform(1.1, 1.8)
    drives: list[Row] = [
        {
            "kind": "crank",
            "origin": np.array([x, 0.0, 0.0]),
            "axis": np.array([0.0, 0.0, 1.0]),
            "working_mode": mode,
        }
        for x, mode in ((-apart, "+"), (apart, "-"))
    ]
    struts: list[Row] = [
        {"drive": at, "base": np.array([arm, 0.0, 0.0]), "platform": np.zeros(3), "length": length}
        for at in range(2)
    ]
    middle = (arm + length) * random.uniform(0.45, 0.7)
    half = size * random.uniform(0.03, 0.12, 2)
    box = {"x": (-half[0], half[0]), "y": (middle - half[1], middle + half[1])}
    return Layout(("x", "y"), drives, struts, box)


def _planar_platform(random: Random, size: float) -> tuple[Points, Points]:
    angles = np.radians([90.0, 210.0, 330.0])
    ahead = math.radians(random.uniform(40.0, 110.0)) * random.choice([-1.0, 1.0])
    base = _ring(0.5 * size, angles + random.uniform(-0.15, 0.15, 3))
    return base, _ring(0.5 * size * random.uniform(0.2, 0.6), angles + ahead)


def _three_rpr(random: Random, size: float) -> Layout:
    """A platform in its plane on three telescopic struts."""
    base, platform = _planar_platform(random, size)
    drives: list[Row] = [{"kind": "telescopic"} for _ in range(3)]
    struts: list[Row] = [
        {"drive": at, "base": base[at], "platform": platform[at]} for at in range(3)
    ]
    return Layout(("x", "y", "c"), drives, struts, _box(random, 0.5 * size, *"xyc", middle=0.0))


def _three_rrr(random: Random, size: float) -> Layout:
    """A platform in its plane on three cranks with a rod each."""
    base, platform = _planar_platform(random, size)
    arm, length = size * random.uniform(0.2, 0.35, 2)
    mode = str(random.choice(["+", "-"]))
    axis = np.array([0.0, 0.0, random.choice([-1.0, 1.0])])
    drives: list[Row] = [
        {"kind": "crank", "origin": base[at], "axis": axis, "working_mode": mode} for at in range(3)
    ]
    struts: list[Row] = [
        {"drive": at, "base": np.array([arm, 0.0, 0.0]), "platform": platform[at], "length": length}
        for at in range(3)
    ]
    return Layout(("x", "y", "c"), drives, struts, _box(random, 0.4 * size, *"xyc", middle=0.0))


FAMILIES: dict[str, Callable[[Random, float], Layout]] = {
    "hexapod": _hexapod,
    "hexaglide": _hexaglide,
    "level hexaglide": _level_hexaglide,
    "linear delta": _linear_delta,
    "level delta": _level_delta,
    "rotary delta": _rotary_delta,
    "tripod": _tripod,
    "3-PRS": _three_prs,
    "two sliders": _two_sliders,
    "five-bar": _five_bar,
    "3-RPR": _three_rpr,
    "3-RRR": _three_rrr,
}


@dataclass(frozen=True)
class SoundMachine:
    """A machine file that is sound. `attempts`: draws until it was."""

    number: int
    family: str
    file: File
    attempts: int

    @cached_property
    def loaded(self) -> Machine:
        return loaded(self.file)


def sound_machine(number: int) -> SoundMachine:
    """The machine of this number. Raises `ValueError` if no draw is sound."""
    random = np.random.default_rng([SEED, number])
    family = str(random.choice(list(FAMILIES)))
    size = _log(random, 0.05, 5.0)
    for attempt in range(MOST_ATTEMPTS):
        layout = FAMILIES[family](random, size)
        file = _with_travels(_file(layout, family, size, random), random)
        if file is not None:
            return SoundMachine(number, family, file, attempt + 1)
    raise ValueError(f"{number}: no {family} of {MOST_ATTEMPTS} draws is sound")


def _file(layout: Layout, family: str, size: float, random: Random) -> File:
    """The file of a layout, its travels wide, with all that a file says beside geometry."""
    unit = str(random.choice(list(UNITS)))
    per_metre = 1.0 / UNITS[unit]
    planar = "z" not in layout.dof
    turn, shift = _frame(layout, size, random)
    near = size * _log(random, 1e-6, 3e-3) * (random.uniform() < 0.5)

    def off() -> Points:
        return np.asarray(near * random.uniform(-0.3, 0.3, 3) * [1.0, 1.0, 0.0 if planar else 1.0])

    def point(value: Points) -> list[float]:
        return (value * per_metre).tolist()

    turns = layout.commanded == ("z", "a", "b")  # the tilt of a 3-PRS is told of its own planes
    rotation = np.eye(3) if turns else turn
    drives, struts = [], []
    for at, row in enumerate(layout.drives):
        drive = {"name": f"d{at + 1}", **row}
        if "axis" in row:
            drive["axis"] = (rotation @ row["axis"]).tolist()
            drive["origin"] = point(rotation @ row["origin"] + shift + (0.0 if turns else off()))
        drives.append(drive)
    fixed = [layout.drives[row["drive"]]["kind"] == "telescopic" for row in layout.struts]
    for at, row in enumerate(layout.struts):
        strut = {"name": str(at + 1), "drive": f"d{row['drive'] + 1}"}
        base = rotation @ row["base"] + (shift if fixed[at] else 0.0)
        strut["base"] = point(base + off() if row["base"].any() else base)
        # The platform keeps its own axes, unless all freedoms of the frame turn with it.
        strut["platform"] = point(rotation @ row["platform"])
        if "length" in row:
            strut["length"] = float(row["length"] * per_metre)
        struts.append(strut)
    file: File = {
        "schema": 1,
        "machine": {"name": family, "dof": list(layout.dof)},
        "units": {"length": unit, "angle": "deg", "force": "N", "temperature": "degC"},
        "drive": drives,
        "strut": struts,
        "workspace": {"grid": _grid(layout, shift, per_metre, random)},
    }
    if layout.commanded:
        file["machine"]["commanded"] = list(layout.commanded)
    if layout.guides:
        file["guide"] = [
            {
                "name": f"g{at + 1}",
                "kind": guide["kind"],
                "origin": point(shift),
                "normal": guide["normal"].tolist(),
                "platform": point(guide["platform"]),
            }
            for at, guide in enumerate(layout.guides)
        ]
    _add_properties(file, layout, size, per_metre, random)
    return file


def _frame(layout: Layout, size: float, random: Random) -> tuple[Points, Points]:
    """How the frame of the file is turned about z, and where the machine stands in it, m."""
    planar = "z" not in layout.dof
    angle = random.choice([0.0, random.uniform(-math.pi, math.pi)])
    cosine, sine = math.cos(angle), math.sin(angle)
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    shift = np.zeros(3)
    if random.uniform() < 0.4 and layout.commanded != ("z", "a", "b"):
        shift = size * random.uniform(-1.0, 1.0, 3) * [1.0, 1.0, 0.0 if planar else 1.0]
        if random.uniform() < 0.3:  # from one of its own joints or rails
            first = layout.drives[0].get("origin", layout.struts[0]["base"])
            shift = -turn @ first * 0.97
    return turn, shift


def _grid(layout: Layout, shift: Points, per_metre: float, random: Random) -> Row:
    """The workspace, its freedoms in order; two or three poses along each."""
    grid = {}
    moved = dict(zip("xyz", shift, strict=True))
    for name in layout.commanded or layout.dof:
        first, last = layout.workspace[name]
        count = 2 if len(layout.workspace) > 3 else int(random.integers(2, 5))
        if name in "abc":
            grid[name] = [math.degrees(first), math.degrees(last), count]
        else:
            grid[name] = [(end + moved[name]) * per_metre for end in (first, last)] + [count]
    return grid


def _add_properties(
    file: File, layout: Layout, size: float, per_metre: float, random: Random
) -> None:
    """Materials, sections, tolerances, temperatures, forces, masses and an accuracy."""
    planar = "z" not in layout.dof
    material = str(random.choice(list(MODULI)))
    length = min(
        float(np.linalg.norm(row["platform"] - row["base"]))
        if "length" not in row
        else row["length"]
        for row in layout.struts
    )
    length = max(length, 0.2 * size)
    diameter = length / _log(random, 10.0, 100.0)
    area = math.pi / 4.0 * diameter**2 * random.uniform(0.2, 1.0)
    outright = random.uniform() < 0.4
    soft = _log(random, 0.05, 1.0)
    mass = random.choice([0.0, 1.0])
    density = {"steel": 7850.0, "aluminium": 2700.0, "carbon fibre": 1600.0, "cast iron": 7200.0}
    band = _tolerance(length, random)
    for strut in file["strut"]:
        alike = random.uniform(0.8, 1.25)
        strut["material"] = material
        if outright:
            strut["stiffness"] = _said(alike * soft * MODULI[material] * area / length, "N/m")
        else:
            strut["section_area"] = _said(alike * area, "m^2")
            strut["modulus"] = _said(MODULI[material], "Pa")
        if mass:
            strut["mass"] = _said(alike * density[material] * area * length * 1.5, "kg")
        strut["length_tolerance"] = band
    if random.uniform() < 0.7:
        half = length * _log(random, 1e-6, 3e-3)
        pattern = "strut.*.platform.x" if "c" in layout.dof else "strut.*.base.y"
        file["tolerance"] = {pattern: _said(half, "m")}
    temperatures = random.uniform(-20.0, 60.0)
    file["condition"] = {
        "reference_temperature": float(random.choice([20.0, 20.0, 22.0, random.uniform(15, 25)])),
        "temperature": {"default": temperatures, "strut.1": temperatures + random.normal() * 3.0},
    }
    if random.uniform() < 0.3:
        file["condition"]["gradient"] = {"strut.1": _said(random.normal() * 2.0, "K/m")}
    force = (
        STRAIN * MODULI[material] * area * (soft if outright else 1.0) * random.uniform(0.0, 1.0)
    )
    names = "xy" if planar else "xyz"
    direction = random.normal(size=len(names))
    direction *= force / np.linalg.norm(direction)
    file["condition"]["force"] = dict(zip(names, direction.tolist(), strict=True))
    body = {"material": str(random.choice(["steel", "aluminium", "cast iron"]))}
    file["frame"] = dict(body)
    if "c" in layout.dof:
        file["platform"] = dict(body)
        if mass:
            file["platform"]["mass"] = _said(2.0 * density[material] * area * length, "kg")
    file["accuracy"] = {"target": _said(size * _log(random, 1e-6, 2e-3), "m")}
    if "c" in layout.dof:
        file["accuracy"]["angle_target"] = _said(_log(random, 1e-6, 2e-2), "rad")


def _tolerance(length: float, random: Random) -> Any:
    """Of a strut's length: a part of it, one- or two-sided, or a class."""
    if random.uniform() < 0.3 and 0.04 < length < 0.25:
        return str(random.choice(["IT5", "IT7", "IT9", "ISO 2768-f", "ISO 2768-m"]))
    half = length * _log(random, 1e-6, 3e-3)
    if random.uniform() < 0.3:
        return [_said(-0.5 * half, "m"), _said(half, "m")]
    return _said(half, "m")


def _with_travels(file: File, random: Random) -> File | None:
    """The file with travels that its workspace needs, and room; None where it is not sound."""
    wide = {"telescopic": [1e-3, 1e3], "slider": [-1e3, 1e3], "crank": [-179.999, 179.999]}
    per_metre = 1.0 / UNITS[file["units"]["length"]]
    for drive in file["drive"]:
        first, last = wide[drive["kind"]]
        factor = 1.0 if drive["kind"] == "crank" else per_metre
        drive["travel"] = [first * factor, last * factor]
    machine = loaded(file)
    poses = np.concatenate([machine.poses(), _home(machine)])
    joints, _, status = machine.kernel.place(poses)
    if status.any() or not (machine.conditioning(poses, status=True)[0] > REGULAR).all():
        return None
    for at, drive in enumerate(file["drive"]):
        factor, needed = per_metre, joints[:, at]
        if drive["kind"] == "crank":  # within half a turn of where it is on the whole
            factor, middle = math.degrees(1.0), np.angle(np.exp(1j * needed).mean())
            needed = middle + np.angle(np.exp(1j * (needed - middle)))
        first, last = needed.min() * factor, needed.max() * factor
        room = (last - first) * random.uniform(0.05, 0.4)
        first, last = first - room, last + room
        if drive["kind"] == "telescopic" and not 0.0 < first < last < STAGES * first:
            return None
        if drive["kind"] == "slider" and random.uniform() < 0.5:
            drive["fixed_at"] = float(random.uniform(first, last))
        drive["travel"] = [float(first), float(last)]
    machine = loaded(file)
    status = machine.inverse(machine.poses(), status=True)[1]
    return None if status.any() or _passes_the_middle(machine) else file


def _passes_the_middle(machine: Machine) -> bool:
    """Whether a carriage of a machine in space is, somewhere, on the other side than its joint."""
    if "z" not in machine.dof:
        return False
    joints, placements, _ = machine.kernel.place(machine.poses())
    centres = machine.kernel.joint_centres(joints, placements)[..., :2]
    middle = centres[:, :, 1].mean(axis=1, keepdims=True)
    inward = ((centres[:, :, 0] - middle) * (centres[:, :, 1] - middle)).sum(axis=2) < 0.0
    carried = [drive.kind == "slider" for drive in machine.drives]
    return bool(inward.any()) and any(carried)


def _home(machine: Machine) -> Points:
    at = [machine.dof.index(freedom) for freedom in machine.commanded]
    return np.asarray(machine.home)[at][np.newaxis, :]
