"""A table of joint centres -> a hexapod of six telescopic struts.

    name, x (mm), y (mm), z (mm), role
    1,    289.8,  77.6,   0,      base
    1,    84.9,   84.9,   0,      platform

A strut has a name and two rows, one `base` and one `platform`. With a row of the role `tool` all
points are in the base frame, as measured with the platform level at home, and that is the tool
point; without it those of the platform are in its own axes, from the tool point. The form is that
of all data files (docs/data_files.md).
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from decimal import Decimal
from typing import ClassVar

from truepose.controllers._decimals import LARGEST
from truepose.controllers._hexapod_text import STRUTS, Hexapod, Point, hexapod_text
from truepose.controllers._reader import Assumption, ControllerFile, ControllerReading, Setting
from truepose.errors import Fault, MachineFileError, Problem
from truepose.files.data_file import Column, DataTable, read_table
from truepose.files.wording import counted

ROLES = ("base", "platform", "tool")

COLUMNS = (
    Column("name", None),
    Column("x", "length"),
    Column("y", "length"),
    Column("z", "length"),
    Column("role", None, words=ROLES),
)

MM = 1000.0

LONGEST_HEADER = 1000
"""Characters of a line that may be such a header."""


class JointCentresReader:
    """A CSV file of joint centres."""

    name: ClassVar[str] = "joint-centres"
    doc: ClassVar[str] = "a CSV of joint centres: name, x, y, z with units, and role"
    settings: ClassVar[Mapping[str, Setting]] = {
        "workspace.home.z": Setting("z of the platform at home, without a row of the tool"),
    }

    @classmethod
    def recognises(cls, text: str) -> bool:
        """Whether the first line that is no comment names x, y, z and role."""
        for line in io.StringIO(text):
            if line.strip() and not line.lstrip().startswith("#"):
                cells = line[:LONGEST_HEADER].replace('"', "").split(",")
                names = {cell.split("(")[0].split("[")[0].strip() for cell in cells}
                return names >= {"x", "y", "z", "role"}
        return False

    @classmethod
    def read(cls, file: ControllerFile, settings: Mapping[str, float | str]) -> ControllerReading:
        """The hexapod. Raises `MachineFileError` with everything that is wrong."""
        read = read_table(str(file.path), file.path.name, file.text, COLUMNS)
        if read.problems or read.table is None:
            raise MachineFileError(*read.problems)
        table = read.table
        points, tool, problems = _points(table)
        if problems:
            raise MachineFileError(*problems)
        names = list(points)
        base = [points[name]["base"] for name in names]
        ends = [points[name]["platform"] for name in names]
        home, assumptions = _home(file, tool, settings)
        if tool is not None:
            ends = [(x - tool[0], y - tool[1], z - tool[2]) for x, y, z in ends]
        hexapod = Hexapod(
            "Hexapod",
            f"Six telescopic struts, from the joint centres in {_plain(file.path.name)}.",
            "mm",
            names,
            base,
            ends,
            home,
            None,
            {},
        )
        text, assumed = hexapod_text(hexapod)
        held = {
            f"{name} {role} {axis}": f"{value} mm"
            for name in names
            for role, point in points[name].items()
            for axis, value in zip("xyz", point, strict=True)
        }
        return ControllerReading(text, None, held, (*assumptions, *assumed))


def _points(
    table: DataTable,
) -> tuple[dict[str, dict[str, Point]], Point | None, list[Problem]]:
    """The points of each strut by role, mm, the tool's, and what is wrong."""
    points: dict[str, dict[str, Point]] = {}
    tool: Point | None = None
    problems = []
    for row in range(table.n_row):
        role, name = table.texts["role"][row], table.texts["name"][row]
        x, y, z = (_mm(float(table.numbers[axis][row])) for axis in "xyz")
        large = max(abs(x), abs(y), abs(z)) > LARGEST
        twice = tool is not None if role == "tool" else role in points.get(name, {})
        fault = None
        if large:
            shown = f"{max(x, y, z, key=abs):.6g} mm"
            fault = Fault("too-large", "a point of no place that a machine has", shown)
        elif twice:
            fault = Fault(
                "duplicate-name", "a point that stands twice", f"{name}, {role}", "one row"
            )
        elif role != "tool" and _plain(name) != name:
            fault = Fault("bad-name", "a name that cannot be one", repr(name), "letters and digits")
        if fault is not None:
            problems.append(table.problem(fault, row=row, column="name"))
        elif role == "tool":
            tool = (x, y, z)
        else:
            points.setdefault(name, {})[role] = (x, y, z)
    for name, of_strut in points.items():
        if len(of_strut) < 2:
            lacks = "platform" if "base" in of_strut else "base"
            problems.append(
                table.problem(
                    Fault(
                        "import-incomplete",
                        f"strut {name} has one end",
                        "one row",
                        f"a row {lacks}",
                    )
                )
            )
    if len(points) != STRUTS:
        problems.append(
            table.problem(
                Fault(
                    "import-declined",
                    "a machine of joint centres is a hexapod of telescopic struts, and no other",
                    counted(len(points), "strut"),
                    f"{STRUTS} struts, two rows each",
                    "of other machines: truepose init --list",
                )
            )
        )
    return points, tool, problems


def _home(
    file: ControllerFile, tool: Point | None, settings: Mapping[str, float | str]
) -> tuple[list[Decimal], list[Assumption]]:
    zero = Decimal(0)
    if tool is not None:
        return [*tool, zero, zero, zero], []
    if "workspace.home.z" in settings:
        return [zero, zero, _mm(float(settings["workspace.home.z"])), zero, zero, zero], []
    raise MachineFileError(
        file.problem(
            Fault(
                "import-incomplete",
                "nothing says where the platform is at home",
                "no row of the role tool",
                "a row with the tool point at home, or its height",
                "--set workspace.home.z=500",
            )
        )
    )


def _mm(value: float) -> Decimal:
    """A length, m, in mm, to 1e-13 of it."""
    return Decimal(f"{value * MM:.13g}")


def _plain(text: str) -> str:
    """Text that means nothing in a machine file."""
    return "".join(mark for mark in text if mark.isalnum() or mark in "_-. ")


__all__ = ["JointCentresReader"]
