"""Calibrations with every kind of instrument, blunders in their data, comparisons and plans."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from house.recorded_cases import EXAMPLES, INPUTS, Case, Files, changed, machine_text

KINDS = (
    "pose",
    "position",
    "coordinate",
    "orientation",
    "plane",
    "distance",
    "strut-length",
    "strut-direction",
    "joint-angle",
    "contact",
)
DATA = EXAMPLES / "data"
DATE = ("--date", "2026-01-31")
Rows = list[list[str]]
Blunder = Callable[[list[str], Rows], None]


def measured(kind: str) -> str:
    """The file of measurements of a kind of instrument, of the hexapod."""
    return (INPUTS / f"{kind}.csv").read_text(encoding="utf-8")


def spoilt(text: str, blunder: Blunder) -> str:
    """A file of measurements with a blunder made in its header or rows."""
    lines = text.splitlines()
    head = [line for line in lines if line.startswith("#")]
    header, *rows = [line.split(", ") for line in lines if not line.startswith("#")]
    blunder(header, rows)
    return "\n".join([*head, ", ".join(header), *(", ".join(row) for row in rows), ""])


def swap(one: str, other: str) -> Blunder:
    """Two columns stand under each other's name."""

    def blunder(header: list[str], rows: Rows) -> None:
        first, second = header.index(one), header.index(other)
        header[first], header[second] = header[second], header[first]

    return blunder


def scale(factor: float, *columns: str) -> Blunder:
    """Columns multiplied."""

    def blunder(header: list[str], rows: Rows) -> None:
        for place in map(header.index, columns):
            for row in rows:
                row[place] = f"{float(row[place]) * factor:.7f}"

    return blunder


def shift(count: int, columns: int = 6) -> Blunder:
    """Readings beside the command of another row."""

    def blunder(header: list[str], rows: Rows) -> None:
        readings = [row[columns:] for row in rows]
        for number, row in enumerate(rows):
            row[columns:] = readings[(number + count) % len(rows)]

    return blunder


def exchange(one: int, other: int, columns: int = 6) -> Blunder:
    """Readings of two rows in each other's place."""

    def blunder(header: list[str], rows: Rows) -> None:
        rows[one][columns:], rows[other][columns:] = rows[other][columns:], rows[one][columns:]

    return blunder


def constant(column: str) -> Blunder:
    """One number in all rows."""

    def blunder(header: list[str], rows: Rows) -> None:
        for row in rows:
            row[header.index(column)] = rows[0][header.index(column)]

    return blunder


def add(offset: float, *columns: str, rows_of: slice = slice(None)) -> Blunder:
    """Columns, or some rows of them, moved."""

    def blunder(header: list[str], rows: Rows) -> None:
        for place in map(header.index, columns):
            for row in rows[rows_of]:
                row[place] = f"{float(row[place]) + offset:.7f}"

    return blunder


def copied(header: list[str], rows: Rows) -> None:
    """The controller's own readout instead of readings."""
    for row in rows:
        row[6:] = row[: len(row) - 6]


def repeated(header: list[str], rows: Rows) -> None:
    """Rows that are there twice."""
    rows += [list(row) for row in rows[:4]]


def disagreeing(header: list[str], rows: Rows) -> None:
    """Commands that are there twice with readings far apart."""
    for row in rows[:4]:
        again = [*row[:6], *(f"{float(cell) + 0.03:.7f}" for cell in row[6:])]
        rows.append(again)


def few(count: int) -> Blunder:
    """Only the first rows."""

    def blunder(header: list[str], rows: Rows) -> None:
        del rows[count:]

    return blunder


def rounded(digits: int) -> Blunder:
    """Readings with too few decimals for their uncertainty."""

    def blunder(header: list[str], rows: Rows) -> None:
        for row in rows:
            row[6:] = [f"{float(cell):.{digits}f}" for cell in row[6:]]

    return blunder


ANGLES = ("a (deg)", "b (deg)", "c (deg)")
LENGTHS = ("x (mm)", "y (mm)", "z (mm)")
BLUNDERS: dict[str, tuple[str, Blunder]] = {
    "swapped_axes": ("pose", swap("x (mm)", "z (mm)")),
    "swapped_angles": ("pose", swap("a (deg)", "c (deg)")),
    "swapped_unknown_frame": ("position", swap("x (mm)", "y (mm)")),
    "swapped_struts": ("strut-length", swap("strut.2.length (mm)", "strut.5.length (mm)")),
    "swapped_commands": ("pose", swap("command.x (mm)", "command.y (mm)")),
    "swapped_joints": ("contact", swap("joint.d1 (mm)", "joint.d2 (mm)")),
    "mirrored": ("pose", scale(-1.0, "y (mm)")),
    "inches": ("pose", scale(1.0 / 25.4, *LENGTHS)),
    "metres": ("position", scale(0.001, *LENGTHS)),
    "one_column_scaled": ("pose", scale(10.0, "z (mm)")),
    "radians": ("pose", scale(0.017453292519943295, *ANGLES)),
    "angles_of_the_inverse": ("pose", scale(-1.0, *ANGLES)),
    "one_angle_reversed": ("pose", scale(-1.0, "b (deg)")),
    "shifted_rows": ("pose", shift(1)),
    "exchanged_rows": ("pose", exchange(3, 11)),
    "another_target": ("pose", add(40.0, "z (mm)")),
    "another_frame": ("position", add(500.0, "x (mm)")),
    "constant_column": ("pose", constant("y (mm)")),
    "copied_command": ("pose", copied),
    "repeated_rows": ("pose", repeated),
    "repeats_disagree": ("pose", disagreeing),
    "too_few": ("position", few(2)),
    "too_few_for_the_frame": ("coordinate", few(3)),
    "rounded": ("pose", rounded(0)),
    "outliers": ("pose", add(0.4, "x (mm)", rows_of=slice(3, 5))),
    "far_off": ("pose", add(90.0, "x (mm)", rows_of=slice(0, 15))),
    "directions_swapped": ("strut-direction", swap("strut.1.direction.x", "strut.3.direction.x")),
    "turned_angle": ("joint-angle", scale(-1.0, "strut.1.angle (deg)")),
    "plane_in_inches": ("plane", scale(1.0 / 25.4, "distance (mm)")),
    "distance_shifted": ("distance", shift(1)),
}


def cases() -> Iterator[Case]:
    """All of them."""
    hexapod = machine_text("hexapod")
    asked = ("calibrate", "machine.toml", "data.csv")
    for kind in KINDS:
        files: Files = {"machine.toml": hexapod, "data.csv": measured(kind)}
        output = ("--machine-output", "calibrated.toml", *DATE)
        steps = (
            (*asked, "-o", "out.csv", *output),
            (*asked, "--format", "json", "-o", "out.nc"),
            ("plan", "machine.toml", "--instrument", "data.csv", "--poses", "3"),
        )
        yield Case(f"calibrate/{kind}", steps, files, 4.0)
    for name, (kind, blunder) in BLUNDERS.items():
        files = {"machine.toml": hexapod, "data.csv": spoilt(measured(kind), blunder)}
        yield Case(f"blunder/{name}", (asked, (*asked, "--format", "json")), files, 3.0)
    yield from printer()
    yield from comparisons()


def of_printer(data: str) -> Files:
    """The delta printer and one of its files of measurements."""
    return {
        "machine.toml": (DATA / "delta_printer.toml").read_text(encoding="utf-8"),
        "data.csv": (DATA / f"delta_{data}.csv").read_text(encoding="utf-8"),
    }


PRINTER_OPTIONS: dict[str, tuple[str, tuple[str, ...]]] = {
    "positions": ("positions", ()),
    "no_prior": ("heights", ("--no-prior",)),
    "no_prior_positions": ("positions", ("--no-prior", "--no-robust", "--seed", "3")),
    "identify": ("positions", ("--identify", "strut.*.length=0.5 mm", "--folds", "3")),
    "margin": ("positions", ("--margin", "0.001")),
    "written": ("positions", ("--machine-output", "new.toml", *DATE)),
    "shifts": ("positions", ("--machine-output", "new.toml", *DATE, "--as-shifts")),
    "loaded": ("positions",
        ("--machine-output", "new.toml", *DATE, "--controller-holds", "calibrated")),
    "refused": ("heights", ("--no-prior", "--machine-output", "new.toml", *DATE)),
    "forced": ("heights", ("--no-prior", "--machine-output", "new.toml", *DATE, "--force")),
    "expansion": (
        "positions",
        ("--identify", "strut.*.length", "--identify", "strut.a.expansion=1e-6 1/K",
         "--machine-output", "new.toml", *DATE, "--force"),
    ),
    "warm": ("positions", ("--set", "condition.reference_temperature=20 degC")),
}  # fmt: skip


def printer() -> Iterator[Case]:
    """The calibration of the example with its options."""
    asked = ("calibrate", "machine.toml", "data.csv")
    for name, (data, options) in PRINTER_OPTIONS.items():
        table = (*asked, *options, "-o", "out.csv")
        steps = [table]
        if "--machine-output" not in options:
            steps.append((*asked, *options, "--format", "json", "-o", "out.json"))
            steps.append((*asked, *options, "--format", "csv"))
        else:
            steps += [(command, "new.toml") for command in ("check", "compensate", "budget")]
        yield Case(f"printer/{name}", tuple(steps), of_printer(data), 3.0)
    page = (*asked, "--report", "page.html", "--no-prior")
    yield Case("printer/page", (page,), of_printer("heights"), 8.0)
    report = ("report", "machine.toml", "--measurements", "data.csv", "-o", "page.html")
    yield Case("printer/report", (report,), of_printer("positions"), 10.0)
    files = of_printer("positions")
    text = str(files["data.csv"])
    columns = changed(text, ("z (mm)\n", "z (mm), temperature.default (degC), set, id\n"))
    rows = columns.splitlines()
    start = next(number for number, line in enumerate(rows) if line.startswith("command"))
    for number in range(start + 1, len(rows)):
        rows[number] += f", {20 + number % 3}, {'check' if number % 4 == 0 else 'fit'}, p{number}"
    files["data.csv"] = "\n".join([*rows, ""])
    settings = ("--set", 'each.strut.material="steel"', "--set", 'frame.material="steel"',
                "--set", 'units.temperature="degC"', "--set", 'each.drive.material="steel"',
                "--set", "condition.reference_temperature=20")  # fmt: skip
    steps = ((*asked, *settings), (*asked, *settings, "--format", "json"))
    yield Case("printer/kept_rows", steps, files, 3.0)


def comparisons() -> Iterator[Case]:
    """Two calibrations of one machine, and files that cannot be compared."""
    files = of_printer("positions")
    text = str(files["data.csv"])
    files["later.csv"] = spoilt(
        "\n".join(line for line in text.splitlines()),
        lambda header, rows: (
            [row.__setitem__(5, f"{float(row[5]) + 0.4:.4f}") for row in rows] and None
        ),
    )
    files["other.toml"] = machine_text("tripod")
    first = ("calibrate", "machine.toml", "data.csv", "--machine-output", "first.toml", *DATE)
    second = ("calibrate", "machine.toml", "later.csv", "--machine-output", "second.toml",
              "--date", "2026-03-31", "--force")  # fmt: skip
    yield Case(
        "compare/printer",
        (
            first,
            second,
            ("compare", "first.toml", "first.toml"),
            ("compare", "first.toml", "second.toml", "-o", "out.json"),
            ("compare", "first.toml", "second.toml", "--format", "json", "-o", "out.csv"),
            ("compare", "first.toml", "second.toml", "--format", "csv"),
            ("compare", "machine.toml", "first.toml"),
            ("compare", "machine.toml", "first.toml", "--format", "json"),
            ("compare", "first.toml", "other.toml"),
            ("compare", "first.toml", "none.toml", "--format", "json"),
        ),
        files,
        6.0,
    )
