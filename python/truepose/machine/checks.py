"""What no single table can tell: names, references, counts, and the workspace's freedoms.

Each check looks at as little as it needs, so that it also runs on a file that has other problems.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from truepose.errors import Problem
from truepose.machine.condition import DEFAULT_PART
from truepose.machine.dimensions import FREEDOMS
from truepose.machine.document import ARRAY_TABLES, Document, Key, named_rows
from truepose.machine.elements import drive_kinds
from truepose.machine.suggestion import counted, did_you_mean, one_of
from truepose.machine.tables.condition import ConditionTable
from truepose.machine.tables.strut import StrutTable
from truepose.machine.tables.workspace import WorkspaceTable
from truepose.machine.units import shown_value
from truepose.machine.validation import Validated
from truepose.machine.workspace import LARGEST_GRID

Check = Callable[[Document, Validated], Iterator[Problem]]


def check(document: Document, validated: Validated) -> list[Problem]:
    """Every problem between the tables of a document."""
    return [problem for each in _CHECKS for problem in each(document, validated)]


def _rows(document: Document, table: str) -> list[dict[str, Any]]:
    rows = document.data.get(table)
    if not isinstance(rows, list):
        return []
    return [row for row in rows if isinstance(row, dict)]


def _freedoms(document: Document) -> tuple[list[str], list[str]] | None:
    """(dof, commanded) as far as they can be read; None where dof cannot."""
    table = document.data.get("machine")
    if not isinstance(table, dict):
        return None
    found = []
    for key in ("dof", "commanded"):
        names = table.get(key, table.get("dof"))
        if not isinstance(names, list) or not names:
            return None
        if not all(isinstance(name, str) and name in FREEDOMS for name in names):
            return None
        if len(set(names)) < len(names):
            return None
        found.append(names)
    return found[0], found[1]


def _distinct_names(document: Document, validated: Validated) -> Iterator[Problem]:
    for table in ARRAY_TABLES:
        first: dict[str, Key] = {}
        for index, name in named_rows(document.data, table):
            key: Key = (table, index, "name")
            if name not in first:
                first[name] = key
                continue
            line = document.line(first[name])
            there = f" in line {line}" if line is not None else ""
            yield document.problem(
                "duplicate-name",
                f'two {table}s are named "{name}"',
                key,
                found=f'"{name}", already taken{there}',
                expected=f"a name of its own for every {table}",
            )


def _drives_of_struts(document: Document, validated: Validated) -> Iterator[Problem]:
    names = list(dict.fromkeys(name for _, name in named_rows(document.data, "drive")))
    used = set()
    for index, row in enumerate(_rows(document, "strut")):
        drive = row.get("drive")
        if not isinstance(drive, str):
            continue
        used.add(drive)
        if drive not in names:
            yield document.problem(
                "unknown-drive",
                f'there is no drive "{drive}"',
                ("strut", index, "drive"),
                found=shown_value(drive),
                expected=one_of(f'"{name}"' for name in names) if names else "a [[drive]]",
                hint=did_you_mean(drive, names),
            )
    if used and used <= set(names):
        for index, name in named_rows(document.data, "drive"):
            if name not in used:
                yield document.problem(
                    "unused-drive",
                    "no strut is on this drive",
                    ("drive", index),
                    found="no strut",
                    expected=f'a strut with drive = "{name}"',
                )


def _strut_lengths(document: Document, validated: Validated) -> Iterator[Problem]:
    """A strut has a length of its own exactly where no drive sets it."""
    kinds = drive_kinds()
    of_drive = {
        row["name"]: row.get("kind")
        for row in _rows(document, "drive")
        if isinstance(row.get("name"), str)
    }
    for index, row in enumerate(_rows(document, "strut")):
        drive = row.get("drive")
        kind: Any = None
        if isinstance(drive, str):
            kind = of_drive.get(drive)
            if not isinstance(kind, str) or kind not in kinds:
                continue  # said elsewhere, and either may be meant
        sets_length = kind is not None and kinds[kind].sets_length
        if sets_length and "length" in row:
            yield document.problem(
                "unwanted-length",
                f"the length of this strut is the coordinate of its {kind} drive",
                ("strut", index, "length"),
                found=shown_value(row["length"]),
                expected="no length",
                hint=f'its length at coordinate 0 is the offset of drive "{drive}"',
            )
            continue
        key: Key = ("strut", index, "length")
        if not sets_length and "length" not in row and key not in validated.misspelt:
            yield document.problem(
                "missing-key",
                "missing",
                key,
                found="nothing",
                expected="the key length: the distance of the strut's joint centres",
            )


def _telescopic_travel(document: Document, validated: Validated) -> Iterator[Problem]:
    """A strut whose length is a coordinate has one above zero over the whole travel."""
    for index, (row, model) in enumerate(
        zip(_rows(document, "drive"), validated.geometry, strict=False)
    ):
        kind = drive_kinds().get(row.get("kind", "")) if model is not None else None
        if kind is None or not kind.sets_length:
            continue
        values = dict(model or ())
        ends = [values["scale"] * end + values["offset"] for end in values["travel"]]
        if min(ends) <= 0.0:
            unit = validated.units.shown()["length"]
            yield document.problem(
                "not-positive",
                "the strut's length reaches zero within the travel",
                ("drive", index, "travel"),
                found=f"lengths from {unit.to_file(ends[0]):g} to {unit.to_file(ends[1]):g} "
                f"{unit.label} (scale * travel + offset)",
                expected="lengths above zero",
                hint="offset is the strut's length where the coordinate is 0",
            )


def _counts(document: Document, validated: Validated) -> Iterator[Problem]:
    freedoms = _freedoms(document)
    if freedoms is None:
        return
    dof, commanded = freedoms
    everything = "commanded" not in document.data["machine"]
    struts, drives = len(_rows(document, "strut")), len(_rows(document, "drive"))
    if "strut" in document.data and struts != len(dof):
        few = "few" if struts < len(dof) else "many"
        yield document.problem(
            "closure-count",
            f"too {few} closures for the platform's freedoms",
            ("machine", "dof"),
            found=f"{counted(struts, 'strut')} for {counted(len(dof), 'freedom')} "
            f"({' '.join(dof)})",
            expected=counted(len(dof), "strut"),
            hint="each strut is one closure and takes one freedom"
            + ("" if few == "few" else "; over-constrained machines are not supported yet"),
        )
    where: Key = ("machine", "dof" if everything else "commanded")
    beyond = [freedom for freedom in commanded if freedom not in dof]
    if beyond:
        yield document.problem(
            "unknown-freedom",
            "commanded freedoms that the platform does not have",
            where,
            found=" ".join(beyond),
            expected=one_of(dof),
        )
    if everything and struts != len(dof):
        return  # dof is wrong, and everything is commanded: one mistake
    if "drive" in document.data and drives != len(commanded):
        yield document.problem(
            "drive-count",
            f"too {'few' if drives < len(commanded) else 'many'} drives for the commanded freedoms",
            where,
            found=f"{counted(drives, 'drive')} for {counted(len(commanded), 'commanded freedom')} "
            f"({' '.join(commanded)})",
            expected=counted(len(commanded), "drive"),
            hint="commanded names the freedoms that the drives decide, if not all of dof"
            if drives < len(commanded)
            else None,
        )


def _workspace_freedoms(document: Document, validated: Validated) -> Iterator[Problem]:
    freedoms, workspace = _freedoms(document), document.data.get("workspace")
    if freedoms is None or not isinstance(workspace, dict):
        return
    dof, commanded = freedoms
    if len(_rows(document, "drive")) != len(commanded) or not set(commanded) <= set(dof):
        return  # which freedoms there are is itself in doubt
    for name, allowed, said in (
        ("grid", commanded, "not commanded"),
        ("home", dof, "no freedom of the platform"),
    ):
        table = workspace.get(name)
        for freedom in table if isinstance(table, dict) else ():
            if freedom in FREEDOMS and freedom not in allowed:
                yield document.problem(
                    "unknown-freedom",
                    f"{freedom} is {said}",
                    ("workspace", name, freedom),
                    found=freedom,
                    expected=one_of(allowed),
                )


def _grid_size(document: Document, validated: Validated) -> Iterator[Problem]:
    workspace = document.data.get("workspace")
    grid = workspace.get("grid") if isinstance(workspace, dict) else None
    if not isinstance(grid, dict):
        return
    # From the raw counts, so that it is said along with what is wrong with the ends.
    counts = [
        entry[2]
        for entry in grid.values()
        if isinstance(entry, list)
        and len(entry) == 3
        and isinstance(entry[2], int)
        and not isinstance(entry[2], bool)
        and entry[2] >= 1
    ]
    if math.prod(counts) > LARGEST_GRID:
        size = math.prod(counts)
        yield document.problem(
            "grid-too-large",
            "more poses than are allowed",
            ("workspace", "grid"),
            found=f"{size:.3g} poses" if size < 10**300 else "more than 1e300 poses",
            expected=f"at most {LARGEST_GRID:.0e} poses".replace("e+0", "e"),
        )


def _pose_rows(document: Document, validated: Validated) -> Iterator[Problem]:
    freedoms, workspace = _freedoms(document), validated.table(WorkspaceTable)
    if freedoms is None or workspace is None or workspace.poses is None:
        return
    _, commanded = freedoms
    if not workspace.poses:
        yield document.problem(
            "missing-key",
            "no pose in the list",
            ("workspace", "poses"),
            found="[]",
            expected="at least one pose",
        )
    for index, pose in enumerate(workspace.poses):
        if len(pose) != len(commanded):
            yield document.problem(
                "wrong-type",
                f"a pose of {counted(len(pose), 'number')}",
                ("workspace", "poses", index),
                found=shown_value(pose),
                expected=f"{counted(len(commanded), 'number')}: {', '.join(commanded)}",
            )


def _parts_with_temperatures(document: Document, validated: Validated) -> Iterator[Problem]:
    condition = validated.table(ConditionTable)
    if condition is None or condition.temperature is None:
        return
    parts = [
        f"{table}.{name}" for table in ARRAY_TABLES for _, name in named_rows(document.data, table)
    ]
    known = [DEFAULT_PART, *parts]
    for part in condition.temperature:
        if part not in known:
            yield document.problem(
                "unknown-part",
                f'there is no part "{part}"',
                document.key(f"condition.temperature.{part}"),
                found=shown_value(part),
                expected=one_of(known),
                hint=did_you_mean(part, known),
            )


def _materials_and_outright(document: Document, validated: Validated) -> Iterator[Problem]:
    """An area without a modulus, or the other way round, is a stiffness half said."""
    for index, row in enumerate(validated.every_row.get(StrutTable, ())):
        if not isinstance(row, StrutTable) or row.stiffness is not None:
            continue
        if row.section_area is not None and row.modulus is None and row.material is None:
            yield document.problem(
                "missing-key",
                "a section area, but neither modulus nor material",
                ("strut", index, "modulus"),
                found="nothing",
                expected="modulus or material, or an outright stiffness in place of the area",
            )


_CHECKS: tuple[Check, ...] = (
    _distinct_names,
    _drives_of_struts,
    _strut_lengths,
    _telescopic_travel,
    _counts,
    _workspace_freedoms,
    _grid_size,
    _pose_rows,
    _parts_with_temperatures,
    _materials_and_outright,
)
