"""Machine descriptions for tests: what `truepose._kernel.Machine` takes, made without the loader.

A description is a plain dict in SI (m, rad); `hexapod` and `described` build one from tables of
points, `description_of` reads one from a machine file with nothing but the standard library, which
is the second road to the loader's numbers, and `moved` and `scaled` change every length and
direction of one, for the laws that do so.
"""

from __future__ import annotations

import copy
import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drive_kinds import fields, fields_of, is_place, is_strut, lengths_of, turns, vectors_of
from reference_kinematics import Reference, tangents

Description = dict[str, Any]

SPATIAL = ["x", "y", "z", "a", "b", "c"]
POSITION = ("x", "y", "z")
PER_METRE = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
PER_RADIAN = {"rad": 1.0, "deg": math.pi / 180.0}
NEWTON_PER_METRE = {"N/um": 1e6, "N/mm": 1e3, "N/m": 1.0}
# Fields of drives, struts and guides by what they measure. Directions are numbers without a unit.
POINTS = fields("length", shape=3)
DIRECTIONS = fields("direction")
MACHINES = Path(__file__).parent.parent / "machines"


def machine_files() -> list[Path]:
    """Every machine file shipped, in the order of their names."""
    return sorted(MACHINES.glob("*.toml"))


def awkward_files() -> list[Path]:
    """Machines nobody would build: what those shipped leave at its default is used here."""
    return sorted((Path(__file__).parent / "machines").glob("*.toml"))


def described(
    dof: Sequence[str],
    drives: Sequence[Mapping[str, Any]],
    struts: Sequence[Mapping[str, Any]],
    **others: Any,
) -> Description:
    """A description from its parts (SI), with what a test seldom says filled in.

    Drives are named d1, d2, ... and struts 1, 2, ... unless they say otherwise; a drive's travel
    is wide open and its working mode left to the kernel.
    """
    description: Description = {
        "dof": list(dof),
        "commanded": list(dof),
        "home": {},
        "tool": [0.0, 0.0, 0.0],
        "characteristic_length": None,
        "drives": [
            {"name": f"d{i}", "travel": [-1000.0, 1000.0], "working_mode": None, **drive}
            for i, drive in enumerate(drives, start=1)
        ],
        "struts": [
            {"name": str(i), "drive": None, "length": None, **strut}
            for i, strut in enumerate(struts, start=1)
        ],
        "guides": [],
        "closure_compliance": None,
    }
    unknown = set(others) - set(description)
    if unknown:
        raise ValueError(f"a description has no {sorted(unknown)}")
    return description | others


def hexapod(
    base: ArrayLike,
    platform: ArrayLike,
    *,
    offset: ArrayLike = 0.0,
    dof: Sequence[str] = SPATIAL,
    **others: Any,
) -> Description:
    """Telescopic struts from `base` (n, 3), base frame, to `platform` (n, 3), platform frame, m.

    `offset` (n,) or a number is the strut's length at joint coordinate 0, m.
    """
    base_points, platform_points = np.asarray(base, float), np.asarray(platform, float)
    offsets = np.broadcast_to(np.asarray(offset, float), len(base_points))
    drives = [
        {"kind": "telescopic", "offset": float(value), "travel": [1e-6 - float(value), 1000.0]}
        for value in offsets
    ]
    struts = [
        {"drive": f"d{i}", "base": a.tolist(), "platform": b.tolist()}
        for i, (a, b) in enumerate(zip(base_points, platform_points, strict=True), start=1)
    ]
    return described(dof, drives, struts, **others)


def description_of(path: Path) -> Description:
    """The description in a machine file whose geometry is written in bare numbers of its units."""
    file = tomllib.loads(path.read_text(encoding="utf-8"))
    metre, radian = PER_METRE[file["units"]["length"]], PER_RADIAN[file["units"]["angle"]]
    machine, workspace = file["machine"], file["workspace"]

    def lengths(value: Any) -> list[float]:
        return [float(component) * metre for component in value]

    def rows(table: str) -> list[dict[str, Any]]:
        every = file.get("each", {}).get(table, {})
        return [every | row for row in file.get(table, [])]

    def home_value(name: str) -> float:
        grid = workspace["grid"].get(name, [0, 0, 1])
        value = workspace.get("home", {}).get(name, (grid[0] + grid[1]) / 2)
        return float(value) * (metre if name in POSITION else radian)

    def geometry(entry: Mapping[str, Any]) -> Description:
        points = {name: lengths(entry[name]) for name in POINTS if name in entry}
        return points | {name: list(entry[name]) for name in DIRECTIONS if name in entry}

    def drive(entry: Mapping[str, Any]) -> Description:
        coordinate = radian if turns(entry["kind"]) else metre
        units = {"length": metre, "angle": radian, "coordinate": coordinate, "scale": 1.0}
        return {
            "name": entry["name"],
            "kind": entry["kind"],
            "travel": [float(end) * coordinate for end in entry["travel"]],
            "working_mode": entry.get("working_mode"),
            **{
                field["name"]: float(entry.get(field["name"], field["default"]))
                * units[field["dimension"]]
                for field in fields_of(entry["kind"])
                if field["shape"] == 0
            },
            **geometry(entry),
        }

    def strut(entry: Mapping[str, Any]) -> Description:
        ring = {"ring_radius": entry["ring_radius"] * metre} if "ring_radius" in entry else {}
        limits = {}
        for end in ("base", "platform"):
            joint = entry.get(f"{end}_joint", {})
            if "angle_limit" in joint:
                limits[f"{end}_axis"] = joint["axis"]
                limits[f"{end}_angle_limit"] = joint["angle_limit"] * radian
        return {
            "name": entry["name"],
            "drive": entry.get("drive"),
            "length": float(entry["length"]) * metre if "length" in entry else None,
            **geometry(entry),
            **ring,
            **limits,
        }

    def limb(entry: Mapping[str, Any]) -> Description:
        """Of which closures it is; what it is made of does not show in geometry."""
        return {
            "name": entry["name"],
            "strut": entry.get("strut"),
            "guides": entry.get("guides", []),
            "side" if "strut" in entry else "platform_side": entry["axis"],
            "parts": [],
            **dict.fromkeys(("mass", "whole_length", "carriage_mass"), 0.0),
        }

    named = [*machine["dof"], *workspace.get("home", {})]
    description: Description = {
        "dof": machine["dof"],
        "commanded": machine.get("commanded", machine["dof"]),
        "home": {name: home_value(name) for name in dict.fromkeys(named)},
        "tool": lengths(machine.get("tool", [0, 0, 0])),
        "characteristic_length": None,
        "drives": [drive(entry) for entry in rows("drive")],
        "struts": [strut(entry) for entry in rows("strut")],
        "guides": [{**g, **geometry(g)} for g in rows("guide")],
        "closure_compliance": None,
    }
    if "limb" in file:
        description["limbs"] = [limb(entry) for entry in rows("limb")]
    if Reference(description).overconstrained:
        description["closure_compliance"] = [compliance(entry) for entry in rows("strut")]
    return description


def compliance(strut: Mapping[str, Any]) -> float:
    """m/N of a strut whose file gives an outright stiffness, as in "30 N/um"."""
    value, name = strut["stiffness"].split()
    return 1.0 / (float(value) * NEWTON_PER_METRE[name])


def grid_of(path: Path, commanded: Sequence[str]) -> NDArray[np.float64]:
    """(n_commanded, 2) ends of a machine file's workspace grid, SI; equal where held at home."""
    file = tomllib.loads(path.read_text(encoding="utf-8"))
    metre, radian = PER_METRE[file["units"]["length"]], PER_RADIAN[file["units"]["angle"]]
    grid, home = file["workspace"]["grid"], file["workspace"].get("home", {})
    ends = [
        np.array(grid[name][:2] if name in grid else [home.get(name, 0.0)] * 2, float)
        * (metre if name in POSITION else radian)
        for name in commanded
    ]
    return np.array(ends)


def moved(
    description: Description, rotation: NDArray[np.float64], shift: NDArray[np.float64]
) -> Description:
    """The same machine standing elsewhere: every base-frame point p goes to rotation p + shift.

    Directions turn with it. The platform's own frame is left alone, so the pose (r, R) of the
    platform in the base frame goes to (rotation r + shift, rotation R). Home is left to the caller,
    who knows which pose he asks for.
    """
    result = copy.deepcopy(description)
    with_drive = {drive["name"]: drive for drive in result["drives"]}
    for drive in result["drives"]:
        for key in vectors_of(drive["kind"]):
            from_frame = shift if is_place(key) else 0.0
            drive[key] = (rotation @ np.array(drive.get(key, [0, 0, 0])) + from_frame).tolist()
    for strut in result["struts"]:
        # A base on a carriage or an arm is told from the drive's origin: it only turns.
        on_carriage = strut["drive"] and not is_strut(with_drive[strut["drive"]]["kind"])
        base = rotation @ np.array(strut["base"])
        strut["base"] = (base if on_carriage else base + shift).tolist()
        if "base_axis" in strut:
            strut["base_axis"] = (rotation @ np.array(strut["base_axis"])).tolist()
    for guide in result["guides"]:
        if guide["kind"] != "universal":
            origin = rotation @ np.array(guide.get("origin", [0, 0, 0])) + shift
            guide["origin"] = origin.tolist()
        for field in ("normal", "base_axis"):
            if field in guide:
                guide[field] = (rotation @ np.array(guide[field])).tolist()
    return result


def scaled(description: Description, factor: float) -> Description:
    """The same machine with every length times `factor`; angles and directions stay."""
    result = copy.deepcopy(description)
    result["tool"] = (factor * np.array(result["tool"])).tolist()
    result["home"] = {
        name: value * factor if name in POSITION else value
        for name, value in result["home"].items()
    }
    for drive in result["drives"]:
        for field in lengths_of(drive["kind"]):
            if field in drive:
                drive[field] = (factor * np.array(drive[field])).tolist()
    for limb in (*result["struts"], *result["guides"]):
        for field in (*POINTS, "length", "ring_radius"):
            if limb.get(field) is not None:
                limb[field] = (factor * np.array(limb[field])).tolist()
    return result


def deviated(description: Description, deviation: Mapping[str, float]) -> Description:
    """The machine whose parameters are moved by `deviation`, by the kernel's parameter names.

    A direction's `u` and `v` move its unit vector along its tangents.
    """
    result = copy.deepcopy(description)
    nominal = {
        (table, row["name"]): row
        for table in ("strut", "drive", "guide")
        for row in description[f"{table}s"]
    }
    rows = {
        (table, row["name"]): row
        for table in ("strut", "drive", "guide")
        for row in result[f"{table}s"]
    }
    for name, change in deviation.items():
        table, *path = name.split(".")
        key = (table, path.pop(0)) if table != "tool" else None
        row = result if key is None else rows[key]
        field, *part = path if key is not None else ["tool", *path]
        if key is not None and field in DIRECTIONS:
            direction = np.array(nominal[key][field], float)
            along = tangents(direction)["uv".index(part[0])]
            tilted = np.array(row[field]) + change * np.linalg.norm(direction) * along
            row[field] = tilted.tolist()
            row[f"nominal_{field}"] = nominal[key][field]
        elif table == "guide" and field == "offset":
            value = list(row.get(field, [0.0, 0.0]))
            value[int(part[0]) - 1 if part else 0] += change
            row[field] = value
        elif part:
            value = list(row.get(field, [0.0, 0.0, 0.0]))
            value["xyz".index(part[0])] += change
            row[field] = value
        else:
            row[field] = row.get(field, 1.0 if field == "scale" else 0.0) + change
    return result


def file_text(description: Description, *, strut: str = "", more: str = "") -> str:
    """A machine file, in m, rad and N, of a description; every strut gets the lines `strut`.

    `more` follows at the end: [condition], [workspace] and the like.
    """

    def line(key: str, value: Any) -> str:
        if isinstance(value, str):
            return f'{key} = "{value}"'
        return f"{key} = {value}"

    def rows(table: str, entries: Sequence[Mapping[str, Any]], own: str) -> list[str]:
        return [
            "\n".join(
                [f"[[{table}]]"]
                + [line(key, value) for key, value in entry.items() if value is not None]
                + ([own] if own else [])
            )
            for entry in entries
        ]

    head = [
        "schema = 1",
        "[machine]",
        'name = "under test"',
        line("dof", list(description["dof"])),
        line("commanded", list(description["commanded"])),
        line("tool", list(description["tool"])),
        "[units]",
        'length = "m"',
        'angle = "rad"',
        'force = "N"',
        'temperature = "degC"',
    ]
    return "\n".join(
        head
        + rows("drive", description["drives"], "")
        + rows("strut", description["struts"], strut)
        + rows("guide", description["guides"], "")
        + [more, ""]
    )
