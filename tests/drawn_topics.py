"""What a machine file may say beside its geometry, drawn at random for one whose geometry stands.

Every topic writes into the tables of a file in mm, deg, N and degC; `TOPICS` has them in the order
in which they are written. Sizes are those of machine tools of half a metre: 10 um, some kelvins,
some hundred newtons; forces and temperatures that act get what resists them or grows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from drive_kinds import has_carriage, is_strut, turns
from machine_file import File, Row, rows_of

Random = np.random.Generator
Parameters = Mapping[str, str]

MATERIALS = ("steel", "aluminium", "cast iron", "invar", "carbon fibre")
TOLERATED = {"m": 0.02, "rad": 0.01, "1": 5e-5}
"""Half bands at most, of parameters by their unit: mm, deg and plain numbers."""


def add_topic(name: str, file: File, parameters: Parameters, random: Random) -> None:
    """Write a topic into the file; `parameters` are the machine's, name -> unit of the kernel."""
    _ADD[name](file, parameters, random)


def _is_planar(file: File) -> bool:
    return "z" not in file["machine"]["dof"]


def _turns(file: File) -> bool:
    return "c" in file["machine"]["dof"]


def too_many(file: File) -> bool:
    """More closures than freedoms: what gives way decides where the platform stands."""
    return sum(1 for _ in rows_of(file, "strut")) > len(file["machine"]["dof"])


def _condition(file: File) -> Row:
    return file.setdefault("condition", {"reference_temperature": 20})


def _vector(file: File, size: float, random: Random) -> dict[str, float]:
    """Components that a machine can carry: in the plane of a planar one."""
    names = "xy" if _is_planar(file) else "xyz"
    return {name: round(float(size * random.normal()), 6) for name in names}


def _across(axis: list[float], file: File, random: Random) -> list[float]:
    unit = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    drawn = random.normal(size=3)
    if _is_planar(file):
        drawn[2] = 0.0
    return (drawn - (drawn @ unit) * unit).tolist()


# ---- tolerances ----


def _tolerance(file: File, parameters: Parameters, random: Random) -> None:
    """Bands of about half of all kinds of parameters, of every form and distribution."""
    for strut in rows_of(file, "strut"):
        if random.uniform() < 0.8:
            strut["length_tolerance"] = _length_band(random)
    table: Row = {}
    families: dict[str, str] = {}
    for name, unit in parameters.items():
        part = name.split(".")
        family = name if len(part) < 3 else ".".join([part[0], "*", *part[2:]])
        families[family] = unit if families.get(family, unit) == unit else ""
    for family, unit in families.items():
        # Lengths are told at the struts; a pattern over lengths and angles at once is refused.
        if not unit or family == "strut.*.length" or random.uniform() < 0.5:
            continue
        size = TOLERATED[unit] * random.uniform(0.2, 1.0)
        table[family] = _band(size, random)
    together = [family for family, unit in families.items() if unit == "m" and family in table]
    if len(together) > 2 and random.uniform() < 0.5:
        for family in together[:2]:
            size = float(random.uniform(0.002, 0.01))
            table[family] = {"band": size, "group": "set-up"}
        if random.uniform() < 0.5:
            table[together[1]]["sign"] = -1
    if table:
        file["tolerance"] = table


def _length_band(random: Random) -> Any:
    """A class or text with a unit, which only a length has in a file's way, or any band."""
    drawn = random.uniform()
    if drawn < 0.15:
        return str(random.choice(["IT6", "IT7", "ISO 2768-f"]))
    if drawn < 0.3:
        return f"{random.uniform(2.0, 30.0):.3f} um"
    if drawn < 0.4:
        return f"+-{random.uniform(0.002, 0.03):.4f} mm"
    return _band(float(random.uniform(0.003, 0.03)), random)


def _band(size: float, random: Random) -> Any:
    """A band of about this half width, symmetric or not, of any distribution."""
    lower, upper = sorted((-size * random.uniform(0.2, 1.0), size))
    band = [lower, upper]
    forms: list[Callable[[], Any]] = [
        lambda: size,
        lambda: band,
        lambda: {"band": size, "distribution": "triangular"},
        lambda: {"band": band, "distribution": "arcsine"},
        lambda: {"band": band, "distribution": "two-point"},
        lambda: {"band": band, "distribution": "normal", "sigmas": 2.5},
        lambda: {"standard_deviation": size / 3},
        lambda: {"standard_deviation": size / 4, "distribution": "student-t", "dof": 7},
        lambda: {
            "values": [-0.5 * size, 0.2 * size, size],
            "probabilities": [0.5, 0.3, 0.2],
            "distribution": "discrete",
        },
        lambda: {"values": (size * random.uniform(-0.7, 1.0, 6)).tolist()},
    ]
    return forms[int(random.integers(len(forms)))]()


# ---- temperatures ----


def _grows(row: Row, random: Random) -> None:
    if random.uniform() < 0.5:
        row["material"] = str(random.choice(MATERIALS))
    else:
        row["expansion"] = f"{random.uniform(1.0, 25.0):.4f}e-6 1/K"


def _thermal(file: File, parameters: Parameters, random: Random) -> None:
    """Parts of materials and expansions, each with a temperature of its own."""
    carried = {row["name"]: row for row in rows_of(file, "drive")}
    scaled = set()
    for strut in rows_of(file, "strut"):
        drive = carried.get(strut.get("drive", ""), {"kind": ""})
        if is_strut(drive["kind"]) and random.uniform() < 0.25:
            # A scale along the strut measures its length; its own growth does not count.
            strut["expansion"] = "0 1/K"
            scaled.add(drive["name"])
            _grows(drive, random)
        elif "material" not in strut:
            _grows(strut, random)
        else:
            strut["expansion"] = f"{random.uniform(1.0, 25.0):.4f}e-6 1/K"
    for drive in carried.values():
        if not is_strut(drive["kind"]) and random.uniform() < 0.7:
            _grows(drive, random)
    for body in ("frame", "platform", "tool"):
        # The tool is one thing with the platform unless it is said what it is made of.
        if random.uniform() < (0.4 if body == "tool" else 0.8):
            table = file.setdefault(body, {})
            _grows(table, random)
            table["anchor"] = _anchor(file, random)
    grown = [f"strut.{row['name']}" for row in rows_of(file, "strut")]
    grown += [f"drive.{n}" for n, row in carried.items() if _expands(row)]
    grown += [body for body in ("frame", "platform", "tool") if _expands(file.get(body, {}))]
    temperatures = {"default": _degrees(random)}
    for part in grown:
        if random.uniform() < 0.4:
            temperatures[part] = _degrees(random)
    _condition(file)["temperature"] = temperatures


def _degrees(random: Random) -> float:
    return round(float(random.uniform(12.0, 38.0)), 3)


def _expands(row: Row) -> bool:
    return "material" in row or "expansion" in row


def _anchor(file: File, random: Random) -> list[float]:
    anchor = random.uniform(-200.0, 200.0, 3)
    return [*anchor[:2].round(3).tolist(), 0.0 if _is_planar(file) else float(anchor[2])]


def _gradient(file: File, parameters: Parameters, random: Random) -> None:
    """Gradients along parts that grow, in K/m; those of bodies have three components."""
    parts = [("strut", row) for row in rows_of(file, "strut")]
    parts += [("drive", row) for row in rows_of(file, "drive") if has_carriage(row["kind"])]
    found: Row = {}
    for table, row in parts:
        if _expands(row) and random.uniform() < 0.4:
            found[f"{table}.{row['name']}"] = f"{random.uniform(-8.0, 8.0):.4f} K/m"
    for body in ("frame", "platform"):
        if _expands(file.get(body, {})) and random.uniform() < 0.7:
            # Out of its plane a planar machine's frame would bend, which its closures cannot tell.
            values = _vector(file, 4.0, random)
            found[body] = [f"{values.get(name, 0.0)} K/m" for name in "xyz"]
    if found:
        _condition(file)["gradient"] = found


# ---- forces ----


def _stiffness(file: File, parameters: Parameters, random: Random) -> None:
    """Something in every limb gives way, and often several things in series."""
    # Of machines with too many closures the struts have one already, and the tests know no other.
    plain = too_many(file)
    for strut in rows_of(file, "strut"):
        if plain:
            continue
        if random.uniform() < 0.4:
            strut["stiffness"] = f"{random.uniform(30.0, 200.0):.3f} N/um"
        else:
            strut["section_area"] = f"{random.uniform(80.0, 900.0):.3f} mm^2"
            if random.uniform() < 0.5:
                strut["material"] = str(random.choice(["steel", "aluminium"]))
            else:
                strut["modulus"] = f"{random.uniform(60.0, 220.0):.3f} GPa"
        for end in ("base_joint", "platform_joint"):
            if random.uniform() < 0.5:
                stiffness = f"{random.uniform(50.0, 400.0):.3f} N/um"
                strut.setdefault(end, {})["stiffness"] = stiffness
        if random.uniform() < 0.4:
            strut["base_stiffness"] = f"{random.uniform(80.0, 500.0):.3f} N/um"
    for drive in rows_of(file, "drive"):
        if plain or random.uniform() < 0.4:
            continue
        unit, most = ("kN m/rad", 60.0) if turns(drive["kind"]) else ("N/um", 300.0)
        names = ("screw", "nut", "bearing")[: int(random.integers(1, 4))]
        drive["stiffness"] = {n: f"{random.uniform(most / 4, most):.3f} {unit}" for n in names}


def _wrench(file: File, parameters: Parameters, random: Random) -> None:
    """A known force on the tool, and a moment where the platform turns."""
    condition = _condition(file)
    condition["force"] = _vector(file, 150.0, random)
    if _turns(file) and random.uniform() < 0.6:
        names = "z" if _is_planar(file) else "xyz"
        condition["moment"] = {name: f"{5.0 * random.normal():.4f} N m" for name in names}


def _weight(file: File, parameters: Parameters, random: Random) -> None:
    """Masses, where their centres are, how the machine stands, and how the platform accelerates."""
    spatial = not _is_planar(file)
    platform = file.setdefault("platform", {})
    platform["mass"] = f"{random.uniform(2.0, 30.0):.4f} kg"
    if _turns(file):
        centre = random.uniform(-40.0, 40.0, 3)
        platform["centre_of_mass"] = [*centre[:2].tolist(), float(centre[2]) if spatial else 0.0]
    for strut in rows_of(file, "strut"):
        if random.uniform() < 0.6:
            strut["mass"] = f"{random.uniform(0.2, 5.0):.4f} kg"
            if random.uniform() < 0.6:
                strut["centre_of_mass"] = round(float(random.uniform(0.2, 0.8)), 4)
    for drive in rows_of(file, "drive"):
        if random.uniform() < 0.5:
            drive["mass"] = f"{random.uniform(1.0, 10.0):.4f} kg"
    file["mounting"] = {name: round(float(random.uniform(-180.0, 180.0)), 4) for name in "abc"}
    file["mounting"]["b"] *= 0.45
    if random.uniform() < 0.4:
        vector = _vector(file, 4.0, random)
        acceleration = {name: f"{value} m/s^2" for name, value in vector.items()}
        _condition(file)["acceleration"] = acceleration
    if random.uniform() < 0.2:
        _condition(file)["gravity"] = "3.7 m/s^2"


def _envelope(file: File, parameters: Parameters, random: Random) -> None:
    """A force of known size that may act anywhere, or anywhere across a normal."""
    envelope: Row = {"force": round(float(random.uniform(20.0, 150.0)), 3)}
    if _is_planar(file):
        envelope["normal"] = [0.0, 0.0, 1.0]
    elif random.uniform() < 0.5:
        envelope["normal"] = random.normal(size=3).tolist()
    _condition(file)["envelope"] = envelope


# ---- drives and joints ----


def _drives(file: File, parameters: Parameters, random: Random) -> None:
    """Errors of sensors and actuators, and backlash."""
    for drive in rows_of(file, "drive"):
        angular = turns(drive["kind"])
        one = "deg" if angular else "mm"
        fine = 2e-4 if angular else 1e-3
        if random.uniform() < 0.3:
            drive["feedback"] = "direct"
        else:
            if random.uniform() < 0.5:
                drive["backlash"] = {"play": f"{random.uniform(1, 6) * fine:.7f} {one}"}
                if random.uniform() < 0.5:
                    unit = "N m" if angular else "N"
                    drive["backlash"]["threshold"] = f"{random.uniform(0.5, 40.0):.3f} {unit}"
            if random.uniform() < 0.6:
                actuator: Row = {"lead_error": _ratio(random)}
                if random.uniform() < 0.5:
                    actuator["zero_at"] = float(random.uniform(*drive["travel"]))
                if random.uniform() < 0.5:
                    period = 1.5 if angular else 5.0
                    actuator["periodic"] = {
                        "amplitude": f"{random.uniform(0.5, 2.0) * fine:.7f} {one}",
                        "period": period,
                    }
                    if random.uniform() < 0.5:
                        actuator["periodic"]["phase"] = round(float(random.uniform(0, 360)), 3)
                drive["actuator"] = actuator
        if random.uniform() < 0.7:
            sensor: Row = {"resolution": f"{random.uniform(0.5, 2.0) * fine:.7f} {one}"}
            if random.uniform() < 0.6:
                sensor["scale_error"] = _ratio(random)
                sensor["zero_at"] = float(random.uniform(*drive["travel"]))
            drive["sensor"] = sensor


def _ratio(random: Random) -> Any:
    """A known error of scale, or limits of one that is not."""
    drawn = random.uniform()
    if drawn < 0.4:
        return f"{random.uniform(-20.0, 20.0):.4f} ppm"
    if drawn < 0.6:
        return f"{random.uniform(2.0, 12.0):.4f} um / 300 mm"
    if drawn < 0.8:
        return f"+-{random.uniform(2.0, 20.0):.4f} ppm"
    return [f"{-random.uniform(1.0, 5.0):.4f} ppm", f"{random.uniform(2.0, 20.0):.4f} ppm"]


def _guideway(file: File, parameters: Parameters, random: Random) -> None:
    """Carriages that do not run straight, or not where they should point."""
    for drive in rows_of(file, "drive"):
        if not has_carriage(drive["kind"]) or random.uniform() < 0.2:
            continue
        guideway: Row = {}
        if random.uniform() < 0.7:
            guideway["straightness"] = [
                {
                    "direction": _across(drive["axis"], file, random),
                    "amplitude": f"{random.uniform(1.0, 8.0):.4f} um",
                    "shape": str(random.choice(["bow", "s", "sine"])),
                    "known": bool(random.uniform() < 0.5),
                }
            ]
        if random.uniform() < 0.5:
            guideway["squareness"] = f"{random.uniform(3.0, 20.0):.4f} um/m"
        if random.uniform() < 0.3:
            guideway["parallelism"] = {
                "band": ["-3 um/m", f"{random.uniform(3.0, 20.0):.4f} um/m"],
                "direction": _across(drive["axis"], file, random),
            }
        if guideway:
            drive["guideway"] = guideway


def _clearance(file: File, parameters: Parameters, random: Random) -> None:
    """Play of the passive joints, which friction may hold open."""
    for strut in rows_of(file, "strut"):
        for end in ("base_joint", "platform_joint"):
            if random.uniform() < 0.4:
                joint = strut.setdefault(end, {})
                joint["clearance"] = f"{random.uniform(1.0, 8.0):.4f} um"
                if "axis" not in joint and not _is_planar(file) and random.uniform() < 0.3:
                    joint |= {"kind": "revolute", "axis": random.normal(size=3).tolist()}
                    joint["axial_clearance"] = f"{random.uniform(1.0, 8.0):.4f} um"
    if random.uniform() < 0.5:
        file["clearance"] = {"threshold": round(float(random.uniform(1.0, 30.0)), 3)}


def _screw(file: File, parameters: Parameters, random: Random) -> None:
    """Screws that turn with their universal joints; on struts that are drives, in space."""
    if _is_planar(file) or not _turns(file):
        return
    kinds = {row["name"]: row["kind"] for row in rows_of(file, "drive")}
    for strut in rows_of(file, "strut"):
        if is_strut(kinds.get(strut.get("drive", ""), "")) and random.uniform() < 0.6:
            strut["screw"] = {
                "lead": float(random.choice([-5.0, 4.0, 5.0])),
                "base_axis": random.normal(size=3).tolist(),
                "platform_axis": random.normal(size=3).tolist(),
            }


_ADD: dict[str, Callable[[File, Parameters, Random], None]] = {
    "tolerance": _tolerance,
    "stiffness": _stiffness,
    "thermal": _thermal,
    "gradient": _gradient,
    "wrench": _wrench,
    "weight": _weight,
    "envelope": _envelope,
    "drives": _drives,
    "guideway": _guideway,
    "clearance": _clearance,
    "screw": _screw,
}

TOPICS = tuple(_ADD)
"""In the order in which they are written: what grows goes before its gradients."""

GEOMETRIC = ("tolerance",)
"""Bands of dimensions alone."""

LOADED = ("wrench", "weight", "envelope")
"""Those under which every limb needs a stiffness."""
