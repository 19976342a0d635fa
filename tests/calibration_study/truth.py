"""Machines drawn at random, as they are, and what instruments read of them: NumPy alone.

A `Twin` is one machine twice: the file that its users have, and the machine that was built, every
toleranced parameter somewhere in its band. What it does is worked out by `reference_kinematics`
(closures and their roots by MINPACK); the kernel only helps to pick geometries that stand, in
`random_machines`. All in SI and the base frame.
"""

from __future__ import annotations

import copy
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

import truepose as tp
from build_machine import Description, description_of, deviated
from calibration_study.kinematics import Placed, forward, inverse
from machine_file import File, rows_of, text_of
from random_machines import DrawnMachine
from reference_kinematics import Reference, angles_of, rotation_by_vector
from truepose.machine import Machine

Floats = NDArray[np.float64]
Random = np.random.Generator

FAMILIES = ("linear_delta", "rotary_delta", "hexapod", "3prs", "3rpr", "planar_two_slider")
SPATIAL_POSITION = ("linear_delta", "rotary_delta", "hexapod")
"""Families whose bed can be probed: x, y and z are commanded."""

LENGTHS = ("x", "y", "z", "distance")
"""Columns that are lengths; those of struts are, too, and what is measured of parts."""
WITHOUT_FRAME = ("strut-length", "parameter")

MM, DEG = 1e3, 180.0 / np.pi


def random_of(*words: object) -> Random:
    """Random numbers of one purpose."""
    return np.random.default_rng(zlib.crc32(" ".join(map(str, words)).encode()))


@dataclass(frozen=True, eq=False)
class Twin:
    """A machine as filed and as built. `deviation`: of the built one, by parameter, SI."""

    path: Path
    description: Description
    deviation: Mapping[str, float]

    @cached_property
    def loaded(self) -> Machine:
        """What its users have: the machine of the file."""
        return tp.load(self.path)

    @cached_property
    def nominal(self) -> Reference:
        return Reference(self.description)

    @cached_property
    def built(self) -> Reference:
        return Reference(deviated(self.description, self.deviation))

    @property
    def family(self) -> str:
        return str(self.loaded.name).removeprefix("like ")

    @property
    def planar(self) -> bool:
        return "z" not in self.description["dof"]

    def poses(self, count: int, random: Random, share: float = 1.0) -> Floats:
        """(count, n_commanded) poses in this share of the workspace's box."""
        given = self.loaded.poses()
        low, high = given.min(axis=0), given.max(axis=0)
        at = 0.5 + share * (random.uniform(size=(count, len(low))) - 0.5)
        return np.asarray(low + at * (high - low))

    def commanded(self, poses: ArrayLike) -> list[tuple[Floats, Placed]]:
        """Of each pose the joints that a controller with the file's geometry goes to.

        And where the machine as filed then is.
        """
        return [inverse(self.nominal, pose) for pose in np.asarray(poses, float)]

    def reached(self, joints: ArrayLike, near: Placed) -> Placed:
        """Where the built machine is at joint coordinates (n_drive,), near a placement."""
        return forward(self.built, joints, near)


def drawn_twin(family: str, seed: int, folder: Path) -> Twin:
    """One of a family, its tolerances drawn too: of lengths 0.02 to 0.4 mm, of angles as far."""
    random = random_of("twin", family, seed)
    machine = DrawnMachine(family, 1000 + seed)
    file = copy.deepcopy(machine.geometry)
    size = float(np.exp(random.uniform(np.log(20e-6), np.log(400e-6))))
    half = _tolerances(file, machine, size, random)
    path = folder / f"{family}-{seed}.toml"
    path.write_text(text_of(file), encoding="utf-8")
    deviation = {name: float(width * random.uniform(-1.0, 1.0)) for name, width in half.items()}
    return Twin(path, description_of(path), deviation)


def _tolerances(file: File, machine: DrawnMachine, size: float, random: Random) -> dict[str, float]:
    """Half bands by parameter, SI, which are written into the file as well."""
    parameters = dict(zip(machine.kernel.parameters, machine.kernel.units, strict=True))
    length = machine.kernel.characteristic_length
    always = ("length", "offset", "base", "platform", "ring_radius")
    chosen: dict[str, float] = {}
    for name in parameters:
        kind = name.split(".")[2] if name.count(".") >= 2 else name
        if kind not in chosen:
            taken = kind in always or (kind != "scale" and random.uniform() < 0.5)
            chosen[kind] = random.uniform(0.5, 1.0) if taken else 0.0
    half = {}
    for name, unit in parameters.items():
        kind = name.split(".")[2] if name.count(".") >= 2 else name
        width = chosen[kind] * (size if unit == "m" else size / length)
        if width > 0.0:
            half[name] = float(width)
    table: dict[str, float] = {}
    struts = {str(row["name"]): row for row in rows_of(file, "strut")}
    for name, width in half.items():
        in_file = width * (MM if parameters[name] == "m" else DEG)
        if name.startswith("strut.") and name.endswith(".length"):
            struts[name.split(".")[1]]["length_tolerance"] = in_file
        else:
            table[name] = in_file
    file["tolerance"] = table
    return half


@dataclass(frozen=True, eq=False)
class Instrument:
    """Something that reads: `kind` as in a file of measurements, and where it really stands.

    `origin` (3,) and `rotation` (3, 3): of its frame; `target` (3,): in the platform's axes, from
    the tool point; `known`: the file says where it stands; `unknown`: what of it the file says is
    to be found, all where nothing is named. `sigma`: by SI unit.
    """

    name: str
    kind: str
    columns: tuple[str, ...]
    sigma: Mapping[str, float]
    origin: Floats = field(default_factory=lambda: np.zeros(3))
    rotation: Floats = field(default_factory=lambda: np.eye(3))
    target: Floats = field(default_factory=lambda: np.zeros(3))
    known: bool = False
    unknown: tuple[str, ...] = ()

    def read(self, placed: Placed, machine: Reference, joints: Floats) -> Floats:
        """(n_column,) what it shows, without noise, SI."""
        point, rotation = placed
        seen = self.rotation.T @ (point + rotation @ self.target - self.origin)
        angles = angles_of(self.rotation.T @ rotation)
        values = dict(zip(("x", "y", "z", "a", "b", "c"), (*seen, *angles), strict=True))
        values["distance"] = float(np.linalg.norm(seen))
        for strut in machine.struts:
            ends = machine.platform_joint(strut, *placed), machine.base_joint(strut, joints)
            values[f"strut.{strut['name']}.length"] = float(np.linalg.norm(ends[0] - ends[1]))
        return np.array([values[column] for column in self.columns])

    def declared(self) -> list[str]:
        """Its lines in the head of a file of measurements."""
        lines = [f"[instrument.{self.name}]", f'kind = "{self.kind}"']
        if self.kind not in WITHOUT_FRAME:
            frame = '"base"' if self.known else '"unknown"'
            if self.unknown:
                named = ", ".join(f'"{name}"' for name in self.unknown)
                frame = f"{{ unknown = [{named}] }}"
            if self.kind == "distance":
                start = ", ".join(f'"{MM * at:.0f} mm"' for at in self.origin)
                frame = f'{{ origin = [{start}], unknown = ["x", "y", "z"] }}'
            lines.append(f"frame = {frame}")
            if self.target.any():
                target = ", ".join(f'"{MM * at:.9f} mm"' for at in self.target)
                lines.append(f"target = [{target}]")
        texts = [f'"{1e6 * self.sigma["m"]:.9f} um"']
        if set("abc") & set(self.columns):
            texts.append(f'"{1e6 * self.sigma["rad"]:.9f} urad"')
        if len(texts) > 1:
            lines.append(f"uncertainty = [{', '.join(texts)}]")
        else:
            lines.append(f"uncertainty = {texts[0]}")
        return [f"#: {line}" for line in lines]

    def deviations(self) -> Floats:
        """(n_column,) standard uncertainty of what it reads, SI."""
        return np.array([self.sigma["rad" if c in "abc" else "m"] for c in self.columns])


@dataclass(frozen=True, eq=False)
class Table:
    """Rows of one instrument: commanded `poses` (n, n_commanded) and `values` (n, n_column), SI."""

    instrument: Instrument
    poses: Floats
    values: Floats

    @property
    def count(self) -> int:
        return len(self.poses)

    def column(self, name: str) -> int:
        """Place of a column."""
        return self.instrument.columns.index(name)

    def with_values(self, values: Floats) -> Table:
        return replace(self, values=values)

    def and_rows(self, more: Table) -> Table:
        """With further rows of the same instrument."""
        poses, values = np.vstack([self.poses, more.poses]), np.vstack([self.values, more.values])
        return replace(self, poses=poses, values=values)


def observed(
    twin: Twin, instrument: Instrument, poses: Floats, random: Random, *, noise: bool = True
) -> Table:
    """What an instrument reads of the built machine at commanded poses (n, n_commanded)."""
    rows = []
    for joints, near in twin.commanded(poses):
        rows.append(instrument.read(twin.reached(joints, near), twin.built, joints))
    values = np.array(rows)
    if noise:
        values = values + instrument.deviations() * random.standard_normal(values.shape)
    return Table(instrument, np.asarray(poses, float), values)


def csv_of(twin: Twin, *tables: Table) -> str:
    """A file of measurements, mm and deg, to 1e-6 of these."""
    commanded = list(twin.description["commanded"])
    columns = list(dict.fromkeys(c for table in tables for c in table.instrument.columns))
    head = [line for table in tables for line in table.instrument.declared()]
    names = [f"command.{name} ({_unit(name)})" for name in commanded]
    names += [f"{column} ({_unit(column)})" for column in columns]
    lines = [", ".join(["instrument", *names])]
    for table in tables:
        for pose, values in zip(table.poses, table.values, strict=True):
            own = dict(zip(table.instrument.columns, values, strict=True))
            # What is measured in the hand has no pose.
            cells = [
                "" if np.isnan(v) else f"{v * _factor(n):.9f}"
                for n, v in zip(commanded, pose, strict=True)
            ]
            cells += [f"{own[c] * _factor(c):.6f}" if c in own else "" for c in columns]
            lines.append(", ".join([table.instrument.name, *cells]))
    return "\n".join([*head, *lines, ""])


def _is_length(column: str) -> bool:
    return column in LENGTHS or column.endswith(".length") or column.startswith("parameter.")


def _unit(column: str) -> str:
    return "mm" if _is_length(column) else "deg"


def _factor(column: str) -> float:
    return MM if _is_length(column) else DEG


def instrument_of(kind: str, twin: Twin, random: Random) -> Instrument:
    """A "tracker" or a "known tracker", "pose", "heights", "bar" or "scales", standing anywhere."""
    size = float(np.ptp(twin.loaded.poses(), axis=0).max())
    sigma = float(np.exp(random.uniform(np.log(1e-6), np.log(10e-6))))
    uncertainty = {"m": sigma, "rad": sigma / 0.2}
    axes = ("x", "y") if twin.planar else ("x", "y", "z")
    free = np.array([1.0, 1.0, 0.0 if twin.planar else 1.0])
    origin = free * (random.uniform(-1.0, 1.0, 3) + np.array([1.5, 0.0, 0.5]))
    small = 0.3 if kind == "pose" else 1.0
    turn = random.uniform(-small, small, 3)
    if twin.planar:
        turn[:2] = 0.0
    rotation = rotation_by_vector(turn)
    turns = [name for name in "abc" if name in twin.description["dof"]]
    target = free * random.uniform(-0.05, 0.05, 3) if turns else np.zeros(3)
    if kind in ("tracker", "known tracker"):
        known = kind == "known tracker"
        frame = (np.zeros(3), np.eye(3)) if known else (origin, rotation)
        return Instrument("tracker", "position", axes, uncertainty, *frame, target, known)
    if kind == "pose":
        return Instrument(
            "tracker", "pose", (*axes, *turns), uncertainty, origin, rotation, np.zeros(3)
        )
    if kind == "heights":
        tilt = rotation_by_vector(np.append(random.uniform(-2e-3, 2e-3, 2), 0.0))
        return Instrument(
            "probe", "coordinate", ("z",), uncertainty, np.array([0.0, 0.0, 1e-3]), tilt
        )
    if kind == "bar":
        middle = twin.nominal.placement([], [])[0]
        away = free * np.array([1.0, -0.8, 0.6]) * max(size, 0.1)
        return Instrument(
            "bar", "distance", ("distance",), uncertainty, np.round(middle + away, 3), target=target
        )
    names = tuple(f"strut.{strut['name']}.length" for strut in twin.nominal.struts)
    return Instrument("scales", "strut-length", names, uncertainty)


def assembled_elsewhere(
    twin: Twin, joints: Floats, near: Placed, random: Random, tries: int = 30
) -> Placed | None:
    """Another placement of the built machine at the same joints, over 5 mm or 3 deg away."""
    here = twin.reached(joints, near)
    lengths = [float(twin.nominal.length(s, joints)) for s in twin.nominal.struts]
    scale = float(np.median(np.abs(lengths)))
    free = np.array([1.0, 1.0, 0.0 if twin.planar else 1.0])
    for _ in range(tries):
        turn = random.uniform(-1.0, 1.0, 3) * (np.array([0.0, 0.0, 1.0]) if twin.planar else 1.0)
        start = here[0] + free * scale * random.uniform(-1.0, 1.0, 3)
        try:
            found = twin.reached(joints, (start, rotation_by_vector(turn) @ here[1]))
        except ValueError:
            continue
        away = float(np.linalg.norm(found[0] - here[0]))
        turned = float(np.arccos(np.clip((np.trace(found[1].T @ here[1]) - 1) / 2, -1, 1)))
        if 5e-3 < away < 3.0 * scale and (away > 5e-3 or turned > 0.05):
            return found
    return None
