"""Corrected programs, plans and exports with their options, and requests that are rare."""

from __future__ import annotations

from collections.abc import Iterator

from house.cases_requests import PLANAR, QUICK, case
from house.recorded_cases import INPUTS, Case, Files, Step, changed, machine_text


def cases() -> Iterator[Case]:
    """All of them."""
    yield from corrections()
    yield from plans()
    yield from exports()
    yield from tables()
    yield from rare()


PART = "G21 G90 G94 F900\nG0 X300 Y200\nG1 X340 Y210\nG3 X350 Y220 I0 J10\n"
PROGRAMS = {
    "far": PART + "G1 X700\n",
    "singular": PART + "G1 X300 Y-700\n",
    "word": PART + "G1 X310 Yfar\n",
    "axis": PART + "G1 Z5\n",
    "no_units": "G90 G94 F20\nG0 X300 Y200\n",
    "deleted": "G21 G90 G94 F900\nG0 X300 Y200\n/G1 X310\n",
    "offset": "G21 G90 G94 F900\nG55 G0 X10 Y10\nG1 X20\n",
    "incremental": "G21 G90 G94 F900\nG0 X300 Y200\nG91\nG1 X10\nG2 X10 Y10 R10 P2\nG90\nM2\n",
    "inverse_time": "G21 G90 G93\nG0 X300 Y200\nG1 X310 F2\nX320 F3\nG94 F100\nG4 P1\nX330\n",
    "home": "G21 G90 G94 F900\nG0 X300 Y200\nG28\nG1 X310\n",
}


def corrections() -> Iterator[Case]:
    """Programs with the options of their correction."""
    asked = ("gcode", "machine.toml", "part.ngc", "-o", "out.ngc")
    options: tuple[Step, ...] = (
        ("--tolerance", "0.5 um"),
        ("--tolerance", "0.05", "--format", "json"),
        ("--interpolation", "pose", "--digits", "4"),
        ("--start", "x=310,y=190", "--offset", "g54", "x=1,y=2 mm", "--block-delete", "on"),
        ("--set", "condition.temperature=40"),
        ("--tolerance", "5 kg"),
        ("--tolerance", "little"),
        ("--tolerance", "0"),
        ("--tolerance", "1e-9 um"),
        ("--digits", "0"),
        ("--digits", "0", "--force"),
        ("--digits", "9"),
        ("--start", "x"),
        ("--start", "x=1,x=2"),
        ("--start", "x=1 deg"),
        ("--start", "x=9000"),
        ("--offset", "g54", "y=far"),
        ("--offset", "g5", "y=1"),
        ("--units", "foot"),
        ("--set", "condition.temperature=20", "--set", "condition.force.x=0",
         "--set", "condition.force.y=0"),
    )  # fmt: skip
    found = case("gcode_options/options", *((*asked, *more) for more in options), weight=4.0)
    found.files["part.ngc"] = PART
    yield found
    steps = [("gcode", "machine.toml", f"{name}.ngc", "-o", f"{name}.out") for name in PROGRAMS]
    steps += [(*step, "--format", "json") for step in steps]
    steps += [("gcode", "machine.toml", "far.ngc", "-o", name) for name in ("far.ngc", "no/o.ngc")]
    steps += [("gcode", "machine.toml", "far.ngc"), ("gcode", "none.toml", "far.ngc", "-o", "o")]
    found = case("gcode_options/programs", *steps, weight=4.0)
    found.files.update({f"{name}.ngc": text for name, text in PROGRAMS.items()})
    yield found


def plans() -> Iterator[Case]:
    """Plans for every kind of instrument, compared, with options, and refused."""
    kinds = ("pose=[10um,5arcsec]", "coordinate:z=10um", "orientation=5arcsec", "plane=10um",
             "distance=2um", "strut-length=2um", "strut-direction=5arcsec", "joint-angle=5arcsec",
             "contact=1um", "coordinate:x,y=1um", "tracker=10um", "position=10kg", "position=-1um",
             "position=10", "position:height=1um", "coordinate:x,y,z=1um", "nothing",
             "no.csv")  # fmt: skip
    asked = ("plan", "tripod.toml", "--poses", "3")
    yield case(
        "plan_options/kinds",
        *((*asked, "--instrument", kind) for kind in kinds),
        weight=6.0,
        tripod="tripod",
    )
    tracker = (*asked, "--instrument", "position=10um")
    more: tuple[Step, ...] = (
        ("--criterion", "determinant", "--format", "csv"),
        ("--compare", "coordinate:x,y=1um", "--format", "json"),
        ("--compare", "distance=1um"),
        ("--identify", "drive.*.scale"),
        ("--as-filed", "--seed", "4"),
        ("--program", "a.ngc", "--dwell", "500 ms", "--feed", "10 mm/s"),
        ("--instrument", "distance=2um", "--template", "t.csv"),
        ("--poses", "0"),
        ("--poses", "100000"),
        ("--dwell", "-2 s"),
        ("--feed", "fast"),
        ("--feed", "3 mm/h"),
        ("--compare", "x=1"),
        ("--identify", "nose"),
        ("--template", "a.txt"),
        ("--program", "tripod.toml"),
    )
    yield case(
        "plan_options/options", *((*tracker, *each) for each in more), weight=6.0, tripod="tripod"
    )


def exports() -> Iterator[Case]:
    """Exports with options, printed and refused."""
    m = "machine.toml"
    yield case(
        "export_options/options",
        ("export", "c", m),
        ("export", "c", m, "--option", "without=elastic"),
        ("export", "pose-map", m, "--option", "count=3"),
        ("export", "pose-map", m, *QUICK, "--set", "condition.temperature=40"),
        ("export", "linuxcnc", m, "--option", "clamp=1 mm", "--option", "rate_limit=5"),
        ("export", "klipper", "delta.toml"),
        ("export", "marlin", "delta.toml", "--option", "probe_offset=1"),
        ("export", "klippr", m),
        ("export", "klipper", m),
        ("export", "c", m, "--option", "witout=elastic"),
        ("export", "linuxcnc", m, "--option", "clamp=1 N"),
        ("export", "pose-map", m, "--option", "count=1"),
        ("export", "pose-map", m, "--option", "nonsense"),
        ("export", "c", "none.toml"),
        ("export", "c", m, "-o", m),
        ("export", "c"),
        weight=4.0,
        delta="linear_delta",
    )


def tables() -> Iterator[Case]:
    """Measured tables of drives that are refused."""
    rail = 'guideway = { table = "rail.csv", directions = { level = [1, 0, 0] } }\n'
    drive = 'actuator = { table = "d1.csv" }\n'
    text = machine_text(PLANAR)
    runs = [
        f"{target}, {direction}, {0.01 * target + run}"
        for run in (0, 1, 2)
        for target in (0, 300, 600, 900)
        for direction in "+-"
    ]
    head = "target (mm), direction, deviation (um)"
    short = [row for row in runs if not row.startswith("900")]
    single = runs[:8]
    straight = "position (mm), level (um)\n"
    given = {
        "rail_short": (rail, "rail.csv", f"{straight}0,0\n500,8\n"),
        "rail_doubled": (rail, "rail.csv", f"{straight}0,0\n500,8\n500,9\n900,2\n"),
        "rail_column": (rail, "rail.csv", "position (mm), plumb (um)\n0,0\n900,8\n"),
        "drive_short": (drive, "d1.csv", "\n".join([head, *short, ""])),
        "drive_single": (drive, "d1.csv", "\n".join([head, *single, ""])),
        "drive_word": (drive, "d1.csv", "\n".join([head, *runs, "0, *, 3", ""])),
    }
    for name, (key, file, content) in given.items():
        machine = changed(text, ("working_mode", f"{key}working_mode"))
        files: Files = {"machine.toml": machine, file: content}
        yield Case(f"tables/{name}", (("check", "machine.toml", "--format", "json"),), files)


def rare() -> Iterator[Case]:
    """What is refused on few machines or by functions alone."""
    m = "machine.toml"
    none = machine_text(PLANAR).partition("[accuracy]")[0]
    signs = changed(
        machine_text(PLANAR),
        ("length_tolerance = [-0.3, 0.3]",
         'length_tolerance = { band = 0.3, distribution = "two-point" }'),
        ("length_tolerance = [-0.3, 0.3]",
         'length_tolerance = { band = 0.3, distribution = "normal" }'),
        ("[frame]", '[[correlation]]\nbetween = ["strut.1.length", "strut.2.length"]\n'
         "coefficient = 0.9\n\n[frame]"),
    )  # fmt: skip
    exact = ("--set", "strut.*.length_tolerance=[0, 0]")
    files: Files = {m: machine_text(PLANAR), "none.toml": none, "signs.toml": signs}
    steps: tuple[Step, ...] = (
        ("budget", "none.toml", *QUICK, "--require-accuracy"),
        ("check", "none.toml", *QUICK, "--witness", "w.toml"),
        ("shares", m, *exact, "--samples", "32"),
        ("montecarlo", m, *exact, "--samples", "200"),
        ("montecarlo", "signs.toml", *QUICK, "--samples", "200"),
        ("check", m, "--set", "strut.1.length=1e60"),
        ("check", m, "--set", 'strut.1.length="1e308 mm"', "--format", "json"),
    )
    yield Case("rare/requests", steps, files, 2.0)
    turns = "".join(f"C{angle}\n" for angle in range(5, 170, 5))
    programs: Files = {
        "3rrr.toml": machine_text("3rrr"),
        "3prs.toml": machine_text("3prs"),
        "singular.ngc": f"G21 G90 G94\nG0 X0 Y0 C0\nG1 F900\n{turns}",
        "axis.ngc": "G21 G90 G94 F900\nG0 Z40 A0 B0\nG1 Z45\nX5\n",
        "long.ngc": f"G21 G0 X1 ({'x' * 300})\n",
    }
    steps = (
        ("gcode", "3rrr.toml", "singular.ngc", "-o", "o.ngc", "--interpolation", "pose"),
        ("gcode", "3prs.toml", "axis.ngc", "-o", "o.ngc", "--format", "json"),
        ("gcode", "3prs.toml", "long.ngc", "-o", "o.ngc"),
    )
    yield Case("rare/programs", steps, programs, 2.0)
    scripts: Files = {
        name: (INPUTS / name).read_bytes()
        for name in ("rare_functions.py", "pose.csv", "strut-length.csv")
    }
    scripts |= {m: machine_text(PLANAR), "hexapod.toml": machine_text("hexapod")}
    log = "time (s),strut.1 (degC),strut.2 (degC)\n0,20,20\n60,30,25\n"
    warm = changed(machine_text(PLANAR), ("\ntemperature = 35", '\ntemperature_log = "log.csv"'))
    scripts |= {"warm.toml": warm, "log.csv": log}
    yield Case("rare/functions", (("python", "rare_functions.py"),), scripts, 4.0)
