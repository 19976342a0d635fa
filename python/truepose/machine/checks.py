"""What no single table can tell: names, references, counts, and the workspace's freedoms.

Each check looks at as little as it needs, so that it also runs on a file that has other problems.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from truepose.errors import Fault, Problem
from truepose.files.dimensions import FREEDOMS
from truepose.files.document import ARRAY_TABLES, Document, Key, named_rows
from truepose.files.units import shown_value
from truepose.files.wording import counted, did_you_mean, one_of
from truepose.machine.build_workspace import too_large
from truepose.machine.cases import CASE, CONDITION
from truepose.machine.condition import DEFAULT_PART
from truepose.machine.elements import drive_kinds, guide_kinds
from truepose.machine.parts import BODIES, carriage_part, is_body, is_limb, limb_part
from truepose.machine.tables.accuracy import AccuracyTable
from truepose.machine.tables.condition import ConditionTable
from truepose.machine.tables.strut import StrutTable
from truepose.machine.tables.workspace import Rows, WorkspaceTable
from truepose.machine.validation import Validated

Check = Callable[[Document, Validated], Iterator[Problem]]

MOST_CLOSURES = 12
"""More closures the kernel cannot take."""


def check(document: Document, validated: Validated) -> list[Problem]:
    """Every problem between the tables of a document."""
    return [problem for check in _CHECKS for problem in check(document, validated)]


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
    freedoms = []
    for key in ("dof", "commanded"):
        names = table.get(key, table.get("dof"))
        if not isinstance(names, list) or not names:
            return None
        if not all(isinstance(name, str) and name in FREEDOMS for name in names):
            return None
        if len(set(names)) < len(names):
            return None
        freedoms.append(names)
    return freedoms[0], freedoms[1]


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
                Fault(
                    "duplicate-name",
                    f'two {table}s are named "{name}"',
                    found=f'"{name}", already taken{there}',
                    expected=f"a name of its own for every {table}",
                ),
                key,
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
                Fault(
                    "unknown-drive",
                    f'there is no drive "{drive}"',
                    found=shown_value(drive),
                    expected=one_of(f'"{name}"' for name in names) if names else "a [[drive]]",
                    hint=did_you_mean(drive, names),
                ),
                ("strut", index, "drive"),
            )
    if used and used <= set(names):
        for index, name in named_rows(document.data, "drive"):
            if name not in used:
                yield document.problem(
                    Fault(
                        "unused-drive",
                        "no strut is on this drive",
                        found="no strut",
                        expected=f'a strut with drive = "{name}"',
                    ),
                    ("drive", index),
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
                Fault(
                    "unwanted-length",
                    f"the length of this strut is the coordinate of its {kind} drive",
                    found=shown_value(row["length"]),
                    expected="no length",
                    hint=f'its length at coordinate 0 is the offset of drive "{drive}"',
                ),
                ("strut", index, "length"),
            )
            continue
        key: Key = ("strut", index, "length")
        if not sets_length and "length" not in row and key not in validated.misspelt:
            yield document.problem(
                Fault(
                    "missing-key",
                    "missing",
                    found="nothing",
                    expected="the key length: the distance of the strut's joint centres",
                ),
                key,
            )


def _rings(document: Document, validated: Validated) -> Iterator[Problem]:
    """A ring has a radius and an axis."""
    for index, row in enumerate(_rows(document, "strut")):
        given, lacking, such = "ring_radius", "ring_axis", "[0, 0, 1], in platform axes"
        if "ring_radius" not in row:
            given, lacking, such = "ring_axis", "ring_radius", '"80 mm"'
        key: Key = ("strut", index, lacking)
        if given in row and lacking not in row and key not in validated.misspelt:
            yield document.problem(
                Fault(
                    "missing-key",
                    f"a ring has a radius and an axis, but there is only {given}",
                    found=f"no {lacking}",
                    expected=f"{lacking} as well, such as {such}",
                    hint=f"without a ring, leave {given} away",
                ),
                ("strut", index, given),
            )


def _telescopic_travel(document: Document, validated: Validated) -> Iterator[Problem]:
    """A strut whose length is a coordinate has one above zero over the whole travel."""
    for index, (row, model) in enumerate(
        zip(_rows(document, "drive"), validated.geometry.get("drive", ()), strict=False)
    ):
        kind = drive_kinds().get(row.get("kind", "")) if model is not None else None
        if kind is None or not kind.sets_length:
            continue
        values = dict(model or ())
        ends = [values["scale"] * end + values["offset"] for end in values["travel"]]
        if min(ends) <= 0.0:
            unit = validated.units.shown()["length"]
            yield document.problem(
                Fault(
                    "not-positive",
                    "the strut's length reaches zero within the travel",
                    found=f"lengths from {unit.to_file(ends[0]):g} to {unit.to_file(ends[1]):g} "
                    f"{unit.label} (scale * travel + offset)",
                    expected="lengths above zero",
                    hint="offset is the strut's length where the coordinate is 0",
                ),
                ("drive", index, "travel"),
            )


def _has_carriage(row: Mapping[str, Any]) -> bool:
    """Whether a drive, as the file writes it, is of a kind that moves a carriage."""
    kind = row.get("kind")
    return isinstance(kind, str) and kind in drive_kinds() and drive_kinds()[kind].has_carriage


def _carriages(document: Document, validated: Validated) -> Iterator[Problem]:
    """What a carriage is made of is said of a drive that has one."""
    for index, row in enumerate(_rows(document, "drive")):
        kind = row.get("kind")
        known = isinstance(kind, str) and kind in drive_kinds()
        if "carriage" not in row or not known or _has_carriage(row):
            continue
        yield document.problem(
            Fault(
                "unwanted-carriage",
                f"a {row['kind']} drive moves no carriage",
                found=f'carriage, and kind = "{row["kind"]}"',
                expected="no carriage",
                hint="the expansion of a crank is that of its arm, that of a telescopic strut the "
                "strut's",
            ),
            ("drive", index, "carriage"),
        )


def _guide_closures(document: Document) -> int:
    kinds = guide_kinds()
    named = (row.get("kind") for row in _rows(document, "guide"))
    return sum(kinds[kind].closures for kind in named if isinstance(kind, str) and kind in kinds)


def _counts(document: Document, validated: Validated) -> Iterator[Problem]:
    freedoms = _freedoms(document)
    if freedoms is None:
        return
    dof, commanded = freedoms
    everything = "commanded" not in document.data["machine"]
    struts, drives = len(_rows(document, "strut")), len(_rows(document, "drive"))
    closures = struts + _guide_closures(document)
    few = closures < len(dof)
    if "strut" in document.data and (few or closures > MOST_CLOSURES):
        guides = len(_rows(document, "guide"))
        listed = counted(struts, "strut") + (f" and {counted(guides, 'guide')}" if guides else "")
        yield document.problem(
            Fault(
                "closure-count",
                f"too {'few' if few else 'many'} closures for the platform's freedoms",
                found=f"{listed} ({counted(closures, 'closure')}) for "
                f"{counted(len(dof), 'freedom')} ({' '.join(dof)})",
                expected=counted(len(dof), "closure")
                if few
                else f"{counted(len(dof), 'closure')}; at most {MOST_CLOSURES}",
                hint="each strut is one closure and takes one freedom; guides take the others",
            ),
            ("machine", "dof"),
        )
    where: Key = ("machine", "dof" if everything else "commanded")
    beyond = [freedom for freedom in commanded if freedom not in dof]
    if beyond:
        yield document.problem(
            Fault(
                "unknown-freedom",
                "commanded freedoms that the platform does not have",
                found=" ".join(beyond),
                expected=one_of(dof),
            ),
            where,
        )
    if everything and few:
        return  # dof is wrong, and everything is commanded: one mistake
    if "drive" in document.data and drives != len(commanded):
        yield document.problem(
            Fault(
                "drive-count",
                f"too {'few' if drives < len(commanded) else 'many'} drives for the commanded "
                "freedoms",
                found=f"{counted(drives, 'drive')} for "
                f"{counted(len(commanded), 'commanded freedom')} "
                f"({' '.join(commanded)})",
                expected=counted(len(commanded), "drive"),
                hint="commanded names the freedoms that the drives decide, if not all of dof"
                if drives < len(commanded)
                else None,
            ),
            where,
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
        ("box", commanded, "not commanded"),
        ("cylinder", commanded, "not commanded"),
        ("home", dof, "no freedom of the platform"),
    ):
        table = workspace.get(name)
        if name == "box" and isinstance(table, dict) and not FREEDOMS.keys() & table.keys():
            yield document.problem(
                Fault(
                    "missing-key",
                    "the box names no freedom",
                    found=", ".join(table) or "{}",
                    expected="a range, such as x = [200, 400]",
                    hint="for one pose write poses = [[...]]",
                ),
                ("workspace", name),
            )
        if name == "cylinder" and table is not None and not {"x", "y"} <= set(commanded):
            yield document.problem(
                Fault(
                    "unknown-freedom",
                    "a cylinder needs x and y, which are not both commanded",
                    found=" ".join(commanded),
                    expected="x and y among the commanded freedoms",
                    hint="box fills other freedoms",
                ),
                ("workspace", name),
            )
        for freedom in table if isinstance(table, dict) else ():
            if freedom in FREEDOMS and freedom not in allowed:
                yield document.problem(
                    Fault(
                        "unknown-freedom",
                        f"{freedom} is {said}",
                        found=freedom,
                        expected=one_of(allowed),
                    ),
                    ("workspace", name, freedom),
                )


def _grid_size(document: Document, validated: Validated) -> Iterator[Problem]:
    workspace = document.data.get("workspace")
    grid = workspace.get("grid") if isinstance(workspace, dict) else None
    if not isinstance(grid, dict):
        return
    if not grid:
        yield document.problem(
            Fault(
                "missing-key",
                "the grid names no freedom",
                found="{}",
                expected="a range, such as x = [200, 400, 5]",
                hint="for one pose write poses = [[...]]",
            ),
            ("workspace", "grid"),
        )
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
    size = math.prod(counts)
    problem = too_large(document, size, ("workspace", "grid"))
    if problem is not None:
        yield problem


def _pose_rows(document: Document, validated: Validated) -> Iterator[Problem]:
    freedoms, workspace = _freedoms(document), validated.table(WorkspaceTable)
    if freedoms is None or workspace is None:
        return
    _, commanded = freedoms
    lists: tuple[tuple[Key, Rows | str | None], ...] = (
        (("workspace", "poses"), workspace.poses),
        (
            ("workspace", "path", "points"),
            None if workspace.path is None else workspace.path.points,
        ),
    )
    for key, rows in lists:
        if rows is None or isinstance(rows, str):
            continue
        if not rows:
            yield document.problem(
                Fault(
                    "missing-key", "no pose in the list", found="[]", expected="at least one pose"
                ),
                key,
            )
        for index, pose in enumerate(rows):
            if len(pose) != len(commanded):
                yield document.problem(
                    Fault(
                        "wrong-type",
                        f"a pose of {counted(len(pose), 'number')}",
                        found=shown_value(pose),
                        expected=f"{counted(len(commanded), 'number')}: {', '.join(commanded)}",
                    ),
                    (*key, index),
                )


def _conditions(validated: Validated) -> Iterator[tuple[str, ConditionTable]]:
    """`[condition]` and every case, each with its path in the file."""
    every = {CONDITION: validated}
    every |= {f"{CASE}.{name}": of_case for name, of_case in validated.cases.items()}
    for path, one in every.items():
        table = one.table(ConditionTable)
        if table is not None:
            yield path, table


def _parts_with_temperatures(document: Document, validated: Validated) -> Iterator[Problem]:
    rows = [
        f"{table}.{name}"
        for table in ("drive", "strut")
        for _, name in named_rows(document.data, table)
    ]
    rows += [
        carriage_part(row["name"])
        for row in _rows(document, "drive")
        if isinstance(row.get("name"), str) and _has_carriage(row)
    ]
    limbs = [limb_part(name) for _, name in named_rows(document.data, "limb")]
    growing = [*rows, *limbs, *(body for body in BODIES if body != "tool")]
    for path, condition in _conditions(validated):
        for key, given, known in (
            ("temperature", condition.temperature, [DEFAULT_PART, *rows, *BODIES]),
            ("gradient", condition.gradient, growing),
        ):
            for part in given or ():
                if part not in known:
                    yield document.problem(
                        Fault(
                            "unknown-part",
                            f'there is no part "{part}"'
                            if part not in BODIES
                            else f"a {key} along the {part} is not known",
                            found=shown_value(part),
                            expected=one_of(known),
                            hint=did_you_mean(part, known),
                        ),
                        document.key(f"{path}.{key}.{part}"),
                    )


def _gradients(document: Document, validated: Validated) -> Iterator[Problem]:
    """Along a strut or a drive there is one gradient; a body has three."""
    gradients = [
        (path, part)
        for path, condition in _conditions(validated)
        for part in condition.gradient or ()
    ]
    for path, part in gradients:
        key = document.key(f"{path}.gradient.{part}")
        value = document.value(key)
        across = is_body(part) or is_limb(part)
        if isinstance(value, list) != across:
            yield document.problem(
                Fault(
                    "wrong-type",
                    f"{part} has a gradient along each of its axes"
                    if across
                    else f"{part} has one gradient, along itself",
                    found=shown_value(value),
                    expected="[x, y, z]" if across else "one temperature gradient",
                ),
                key,
            )


_POSITION_ASKED = ("position is asked of a platform that only turns", "x or y or z")
_ORIENTATION_ASKED = ("orientation is asked of a platform that cannot turn", "a or b or c")


def _accuracy_asked(document: Document, validated: Validated) -> Iterator[Problem]:
    """An accuracy is asked of a freedom that the platform has: what has none keeps any."""
    freedoms, accuracy = _freedoms(document), validated.table(AccuracyTable)
    if freedoms is None or accuracy is None:
        return
    kinds = {FREEDOMS[freedom] for freedom in freedoms[0]}
    for key, value, kind, what, names in (
        ("target", accuracy.target, "length", *_POSITION_ASKED),
        ("angle_target", accuracy.angle_target, "angle", *_ORIENTATION_ASKED),
    ):
        if value is not None and kind not in kinds:
            yield document.problem(
                Fault(
                    "unknown-freedom",
                    f"an accuracy of the {what}",
                    found=f"a platform that moves in {' '.join(freedoms[0])}",
                    expected=f"no {key}, or {names} in dof",
                ),
                ("accuracy", key),
            )


def _materials_and_outright(document: Document, validated: Validated) -> Iterator[Problem]:
    """An area without a modulus, or the other way round, is a stiffness half said."""
    for index, row in enumerate(validated.every_row.get(StrutTable, ())):
        if not isinstance(row, StrutTable) or row.stiffness is not None:
            continue
        if row.section_area is not None and row.modulus is None and row.material is None:
            yield document.problem(
                Fault(
                    "missing-key",
                    "a section area, but neither modulus nor material",
                    found="nothing",
                    expected="modulus or material, or an outright stiffness in place of the area",
                ),
                ("strut", index, "modulus"),
            )


_CHECKS: tuple[Check, ...] = (
    _distinct_names,
    _drives_of_struts,
    _strut_lengths,
    _rings,
    _telescopic_travel,
    _carriages,
    _counts,
    _workspace_freedoms,
    _grid_size,
    _pose_rows,
    _parts_with_temperatures,
    _gradients,
    _accuracy_asked,
    _materials_and_outright,
)
