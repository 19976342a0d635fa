"""Machine files of the same machine, standing and looked at elsewhere.

`turned` gives every point and direction of a file new axes: those of the base and those of the
platform. Numbers must be bare, all of a vector in one unit (`machine_file_units.bare`).
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drive_kinds import is_place, is_strut, vectors_of
from machine_file import File, Row, rows_of
from reference_kinematics import angles_of, rotation_of

Floats = NDArray[np.float64]

RADIANS = {"rad": 1.0, "deg": math.pi / 180.0}
"""Of the units of angles that files of the tests declare."""


def turned(
    file: File,
    rotation: Floats,
    shift: Sequence[float] | Floats = (0.0, 0.0, 0.0),
    platform_shift: Sequence[float] | Floats = (0.0, 0.0, 0.0),
) -> File:
    """The file with the base frame's points p at rotation p + shift, and all loads with them.

    The platform's frame turns too, so that an orientation Q becomes rotation Q rotation^T: what
    the frame holds unturned stays so. The platform's points p are told as rotation p +
    platform_shift. `shift` (3,) and `platform_shift` (3,) are in the file's unit of length. Home
    goes with the machine; the grid is left alone, for a box that is turned is none.
    """
    result = copy.deepcopy(file)
    base, platform = _Frame(rotation, shift), _Frame(rotation, platform_shift)
    carriers = {row["name"]: row for row in rows_of(result, "drive") if not is_strut(row["kind"])}
    for drive in carriers.values():
        for key in vectors_of(drive["kind"]):
            (base.point if is_place(key) else base.direction)(drive, key)
        _guideway(base, drive.get("guideway", {}))
    for strut in rows_of(result, "strut"):
        # What a carriage or an arm carries is told from the drive's origin: it only turns.
        carried = strut.get("drive") in carriers
        (base.direction if carried else base.point)(strut, "base")
        platform.point(strut, "platform")
        platform.direction(strut, "ring_axis")
        for end, frame in (("base", base), ("platform", platform)):
            frame.direction(strut.get(f"{end}_joint", {}), "axis")
            frame.direction(strut.get("screw", {}), f"{end}_axis")
    for guide in rows_of(result, "guide"):
        if guide["kind"] != "universal":
            base.point(guide, "origin")
            platform.point(guide, "platform")
        for key in ("normal", "base_axis"):
            base.direction(guide, key)
        for key in ("axis", "platform_axis"):
            platform.direction(guide, key)
    for limb in rows_of(result, "limb"):
        (base if "strut" in limb else platform).direction(limb, "axis")
    for row in rows_of(result, "drive", "limb"):
        for part in row.get("chain", []):
            base.direction(part, "axis")
    platform.point(result["machine"], "tool")
    if "frame" in result:
        base.point(result["frame"], "anchor")
    for table in ("platform", "tool"):
        if table in result:
            platform.point(result[table], "anchor")
    if "platform" in result:
        platform.point(result["platform"], "centre_of_mass")
    _mounting(result, rotation)
    _condition(result.get("condition", {}), base, platform)
    _home(result, rotation, base)
    return result


class _Frame:
    """Turns and shifts points and directions of one frame, in place."""

    def __init__(self, rotation: Floats, shift: Sequence[float] | Floats) -> None:
        self.rotation = rotation
        self.shift = np.asarray(shift, np.float64)

    def point(self, row: Row, key: str) -> None:
        old = np.asarray(row.get(key, [0.0, 0.0, 0.0]), np.float64)
        row[key] = (self.rotation @ old + self.shift).tolist()

    def direction(self, row: Row, key: str) -> None:
        """A vector without a place; one that is not there stays away."""
        if key in row:
            row[key] = (self.rotation @ np.asarray(row[key], np.float64)).tolist()

    def components(self, row: Row, key: str) -> None:
        """A table of components x, y and z."""
        if key in row:
            old = np.array([row[key].get(axis, 0.0) for axis in "xyz"])
            row[key] = dict(zip("xyz", (self.rotation @ old).tolist(), strict=True))


def _guideway(base: _Frame, guideway: Row) -> None:
    for entry in guideway.get("straightness", []):
        base.direction(entry, "direction")
    for name in list(guideway.get("directions", {})):
        base.direction(guideway["directions"], name)
    for key in ("squareness", "parallelism"):
        if isinstance(guideway.get(key), dict):
            base.direction(guideway[key], "direction")


def _condition(condition: Row, base: _Frame, platform: _Frame) -> None:
    for key in ("force", "moment", "acceleration"):
        base.components(condition, key)
    for table, keys in (
        ("envelope", ("normal",)),
        ("cutting", ("depth_direction", "width_direction")),
        ("kienzle", ("direction",)),
    ):
        for key in keys:
            base.direction(condition.get(table, {}), key)
    gradients = condition.get("gradient", {})
    base.direction(gradients, "frame")
    for body in ("platform", "tool"):
        platform.direction(gradients, body)


def _mounting(file: File, rotation: Floats) -> None:
    """Down stays where it is in the workshop."""
    unit = RADIANS[file["units"]["angle"]]
    given = file.get("mounting", {})
    old = rotation_of([given.get(name, 0.0) * unit for name in "abc"])
    angles = angles_of(old @ rotation.T) / unit
    file["mounting"] = dict(zip("abc", angles.tolist(), strict=True))


def _home(file: File, rotation: Floats, base: _Frame) -> None:
    """Every freedom of the platform; one that home does not say is where the grid's middle is."""
    unit = RADIANS[file["units"]["angle"]]
    dof, home = file["machine"]["dof"], home_of(file)
    point = rotation @ [home.get(name, 0.0) for name in "xyz"] + base.shift
    orientation = rotation_of([home.get(name, 0.0) * unit for name in "abc"])
    angles = angles_of(rotation @ orientation @ rotation.T) / unit
    values = dict(zip("xyzabc", [*point, *angles], strict=True))
    file["workspace"]["home"] = {name: float(values[name]) for name in dof}


def home_of(file: File) -> dict[str, float]:
    """Home of a file whose workspace is a grid, by freedom, in the file's units."""
    workspace, dof = file["workspace"], file["machine"]["dof"]
    if "home" in workspace:
        return {name: workspace["home"].get(name, 0.0) for name in dof}
    middle = {name: (span[0] + span[1]) / 2 for name, span in workspace["grid"].items()}
    return {name: middle.get(name, 0.0) for name in dof}
