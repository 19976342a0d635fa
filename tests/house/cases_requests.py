"""Options of the commands, requests that are refused, and inputs that library machines lack."""

from __future__ import annotations

import math
from collections.abc import Iterator

from house.recorded_cases import EXAMPLES, INPUTS, Case, Files, Step, changed, machine_text
from truepose import cli

PLANAR = "planar_two_slider"
COMMANDS = tuple(cli.COMMANDS)
QUICK = ("--set", "workspace.grid.x=[200, 400, 2]", "--set", "workspace.grid.y=[100, 300, 2]")
OUT_OF_REACH = ("--set", "workspace.grid.x=[-900, 700, 5]")
NOWHERE = ("--set", "workspace.grid.x=[5000, 6000, 3]")
STRICT_TARGET = ("--set", 'accuracy.target="1 um"')
LOOSE_TARGET = ("--set", 'accuracy.target="50 mm"')
RAIL = 'guideway = { table = "rail.csv", directions = { level = [1, 0, 0] } }\n'
POSITIONING = [
    f"{target}, {direction}, {0.01 * target + (3 if direction == '-' else 0) + run}"
    for run in (0, 1, 2)
    for target in (0, 300, 600, 900)
    for direction in "+-"
]
PLAY = ("--set", "each.strut.base_joint.clearance=0.005")


def case(name: str, *steps: Step, weight: float = 1.0, **files: str) -> Case:
    """A case whose files are given by the names of their machines; `machine` is the planar one."""
    texts: Files = {"machine.toml": machine_text(PLANAR)}
    texts |= {f"{file}.toml": machine_text(machine) for file, machine in files.items()}
    return Case(name, steps, texts, weight)


def cases() -> Iterator[Case]:
    """All of them."""
    helps = [("--help",), ("--version",), *((name, "--help") for name in COMMANDS)]
    yield case("options/help", *helps)
    lists = [("init", "--list", "--format", form) for form in ("table", "json", "csv")]
    yield case("options/lists", *lists, ("export", "--list"))
    yield from evaluations()
    yield from over_time()
    yield from refusals()
    found = case("options/public_functions", ("python", "public_functions.py"), weight=6.0)
    found.files["public_functions.py"] = (INPUTS / "public_functions.py").read_bytes()
    yield found


def evaluations() -> Iterator[Case]:
    """The evaluating commands with their options on the planar machine."""
    m = "machine.toml"
    for name in ("check", "budget", "compensate"):
        yield case(
            f"options/{name}",
            (name, m, *QUICK, "--format", "csv"),
            (name, m, *QUICK, *OUT_OF_REACH),
            (name, m, *QUICK, *OUT_OF_REACH, "--format", "json"),
            (name, m, *QUICK, *OUT_OF_REACH, "--strict"),
            (name, m, *NOWHERE, "--format", "json"),
            (name, m, *QUICK, *STRICT_TARGET, "--witness", "witness.toml"),
            ("check", "witness.toml"),
            ("budget", "witness.toml", "--format", "json"),
            (name, m, *QUICK, *LOOSE_TARGET, "--witness", "none.toml"),
        )
    require = ("--require-accuracy",)
    for name in ("budget", "compensate", "bounds"):
        yield case(
            f"options/{name}_accuracy",
            (name, m, *QUICK, *STRICT_TARGET, *require),
            (name, m, *QUICK, *LOOSE_TARGET, *require, "--format", "json"),
            (name, m, *QUICK, *require),
            (name, "no_target.toml", *QUICK, *require),
            no_target="3rpr",
        )
    at = ("--set", 'accuracy.at="95 %"')
    asked = [(name, m, *QUICK, *at) for name in ("check", "budget", "compensate")]
    target = ("--set", 'accuracy.target="0.2 mm"')
    yield case("options/accuracy_at", *asked, ("check", m, *QUICK, *at, *target), weight=3.0)
    sampled = ("--samples", "512")
    yield case(
        "options/montecarlo",
        ("montecarlo", m, *QUICK, *sampled, "--format", "csv", "--probability", "0.99"),
        ("montecarlo", m, *QUICK, *sampled, "--sampling", "sobol", "--seed", "7"),
        ("montecarlo", m, *QUICK, *sampled, "--sampling", "sobol", "--format", "json"),
        ("montecarlo", m, *QUICK),
        ("montecarlo", m, *QUICK, *OUT_OF_REACH, *sampled),
        ("montecarlo", m, *sampled, *QUICK, "--strict", *OUT_OF_REACH),
    )
    region = ("--region", "x=290:310,y=190:210")
    yield case(
        "options/bounds",
        ("bounds", m, *region, "--gap", "0.2"),
        ("bounds", m, *region, "--gap", "0.2", "--format", "json", "-o", "out.nc"),
        ("bounds", m, *region, "--gap", "0.2", "--format", "csv", "-o", "out.csv"),
        ("bounds", m, *QUICK, "--truncate", "3", "--format", "csv"),
        ("bounds", m, *QUICK, *OUT_OF_REACH),
        weight=6.0,
    )
    linked = changed(
        machine_text(PLANAR),
        ("[frame]", '[[correlation]]\nbetween = ["strut.1.length", "strut.2.length"]\n'
         "coefficient = 0.7\n\n[frame]"),
    )  # fmt: skip
    shares = [("shares", m, *QUICK, "--samples", "64", "--format", "csv", "--seed", "3")]
    shares += [("shares", m, *QUICK, "--samples", "64", *more) for more in ((), OUT_OF_REACH)]
    shares.append(("shares", "linked.toml", *QUICK, "--samples", "64"))
    shares.append(("montecarlo", "linked.toml", *QUICK, *sampled))
    files: Files = {"machine.toml": machine_text(PLANAR), "linked.toml": linked}
    yield Case("options/shares", tuple(shares), files)
    yield case(
        "options/strain",
        ("strain", "over.toml", *PLAY, "-o", "out.csv"),
        ("strain", "over.toml", *PLAY, "--format", "json"),
        ("strain", "over.toml", "--set", "workspace.grid.x=[-100, 3000, 2]"),
        ("strain", "over.toml", "--set", "workspace.grid.x=[-100, 3000, 2]", "--strict"),
        over="overconstrained",
    )
    yield Case(
        "options/tables",
        tuple((name, "machine.toml", *QUICK) for name in ("check", "budget", "bounds")),
        {
            "machine.toml": changed(
                machine_text(PLANAR),
                ("working_mode", 'actuator = { table = "d1.csv" }\nworking_mode'),
                ("length_tolerance = [-0.3, 0.3]", 'length_tolerance = { data = "bars.csv" }'),
                ("working_mode", RAIL + "working_mode"),
            ),
            "d1.csv": "\n".join(["target (mm), direction, deviation (um)", *POSITIONING, ""]),
            "bars.csv": "deviation (um)\n-120\n-40\n5\n33\n110\n250\n",
            "rail.csv": "position (mm), level (um)\n0,0\n300,8\n600,-5\n900,2\n",
        },
    )


def log(*columns: str) -> str:
    """A temperature log of two minutes with a column (name, rise in K, time constant in s) each."""
    parts = [column.split(":") for column in columns]
    lines = [",".join(["time (s)", *(f"{name} (degC)" for name, _, _ in parts)])]
    for second in range(0, 121, 10):
        rises = [20 + float(rise) * (1 - math.exp(-second / float(t))) for _, rise, t in parts]
        lines.append(",".join([str(second), *(f"{value:.4f}" for value in rises)]))
    return "\n".join([*lines, ""])


def over_time() -> Iterator[Case]:
    """Temperature logs, good and bad."""
    planar = changed(machine_text(PLANAR), ("\ntemperature = 35", '\ntemperature_log = "log.csv"'))
    delta = changed(
        machine_text("linear_delta"), ("\ntemperature = 45", '\ntemperature_log = "log.csv"')
    )
    m = "machine.toml"
    steps = (
        ("over-time", m, "-o", "out.csv"),
        ("over-time", m, "--format", "json", "-o", "out.nc"),
        ("over-time", m, "--format", "csv", "--strict"),
        ("check", m, "--set", 'condition.time="60 s"'),
        ("budget", m, "--set", 'condition.time="35 s"', "--format", "csv"),
        ("budget", m, "--set", 'condition.time="3500 s"', "--format", "json"),
        ("over-time", m, "--set", 'condition.temperature_log="none.csv"'),
    )
    text = log("strut.1:10:20", "strut.2:4:30")
    yield Case("over-time/planar", steps, {m: planar, "log.csv": text})
    text = log("default:10:20", "strut.a1:4:30", "platform:2:60")
    yield Case("over-time/delta", steps[:3], {m: delta, "log.csv": text})
    good = log("strut.1:10:20")
    bad = {
        "backwards": good.replace("\n20,", "\n5,"),
        "column": good.replace("strut.1", "strut.9"),
        "unit": good.replace("(degC)", "(mm)"),
        "no_unit": good.replace(" (degC)", ""),
        "no_time": good.replace("time (s)", "hour (s)"),
        "no_rows": good.splitlines()[0] + "\n",
        "ragged": good.replace("\n20,", "\n20,1,"),
        "word": good.replace("\n20,", "\n20,warm"),
        "empty": good.replace("\n20,", "\n20,\n25,"),
        "twice": good.replace("strut.1 (degC)", "time (s)"),
        "semicolons": good.replace(",", ";"),
    }
    for name, text in bad.items():
        step = ("over-time", m, "--format", "json")
        yield Case(f"over-time/bad_{name}", (step,), {m: planar, "log.csv": text})
    yield case("over-time/no_log", ("over-time", m), ("over-time", m, "--format", "json"))


def refusals() -> Iterator[Case]:
    """Options and outputs that are refused."""
    m = "machine.toml"
    numbers = (
        ("montecarlo", "--samples", "1"),
        ("montecarlo", "--samples", "nine"),
        ("montecarlo", "--samples", "100", "--seed", "-1"),
        ("montecarlo", "--samples", "100", "--seed", "99999999999999999999999"),
        ("montecarlo", "--samples", "100", "--probability", "1.5"),
        ("montecarlo", "--digits", "3"),
        ("montecarlo", "--sampling", "lattice"),
        ("shares", "--samples", "0"),
        ("shares", "--samples", "1"),
        ("bounds", "--region", "x=1"),
        ("bounds", "--region", "x=200:400"),
        ("bounds", "--region", "q=200:400"),
        ("bounds", "--region", "x=-5000:400,y=100:200"),
        ("bounds", "--gap", "0"),
        ("bounds", "--gap", "0.1"),
        ("bounds", "--region", "x=290:310,y=190:210", "--gap", "-1"),
        ("bounds", "--truncate", "-1"),
        ("budget", "--set", "nonsense"),
        ("budget", "--set", "strut.1.lenght=5"),
        ("budget", "--set", "strut.7.length=5"),
        ("budget", "--set", "condition.temperature="),
        ("budget", "--set", "strut.1.length=1e30"),
        ("budget", "--nonsense"),
        ("budget", "extra"),
        ("budgt",),
        ("check", "--format", "xml"),
        ("export",),
    )
    steps = [(first, *([m] if first in COMMANDS else []), *rest) for first, *rest in numbers]
    yield case("refused/options", *steps, ("check",), ())
    outputs = ("result.xml", "result", "missing/result.json", "folder.json", "machine.toml", m)
    for name in ("check", "budget", "compensate", "report"):
        steps = [(name, m, "-o", output, "--format", "json") for output in outputs]
        steps = [step[:-2] if name == "report" else step for step in steps]
        found = case(f"refused/output_{name}", *steps, (name, "none.toml"), (name, "folder.json"))
        found.files["folder.json/file"] = ""
        yield found
    witness = ("--witness", m), ("--witness", "w.txt"), ("--witness", "missing/w.toml")
    steps = [("check", m, *QUICK, *STRICT_TARGET, *more) for more in witness]
    yield case("refused/witness", *steps)
    bare = (
        "\n".join(line for line in machine_text(PLANAR).splitlines() if "tolerance" not in line)
        .replace("\ntemperature = 35", "")
        .replace("force = {", "# ")
    )
    without = machine_text(PLANAR).partition("[workspace]")[0]
    normal = machine_text(PLANAR).replace(
        "length_tolerance = [-0.3, 0.3]",
        'length_tolerance = { band = 0.3, distribution = "normal" }',
    )
    files: Files = {
        "bare.toml": bare,
        "without.toml": without,
        "normal.toml": normal,
        "rigid.toml": machine_text("tricept"),
    }
    names = ("check", "budget", "compensate", "montecarlo", "bounds", "shares", "strain")
    steps = [(name, file) for file in ("bare.toml", "without.toml") for name in names]
    steps += [("bounds", "normal.toml", *QUICK), ("montecarlo", "normal.toml", "--samples", "200")]
    yield Case("refused/nothing_to_do", tuple(steps), files, 3.0)
    csv = (EXAMPLES / "data" / "delta_positions.csv").read_text(encoding="utf-8")
    printer = (EXAMPLES / "data" / "delta_printer.toml").read_text(encoding="utf-8")
    heights = (EXAMPLES / "data" / "delta_heights.csv").read_text(encoding="utf-8")
    wild = csv.replace("105.6088, 0.3352", "-9e5, 9e5")
    few = "".join(heights.splitlines(keepends=True)[:-6])
    apart = changed(
        printer,
        ('{ band = 0.5, group = "delta radius" }', '{ band = [0, 1], group = "delta radius" }'),
    )
    exact = printer.replace("length_tolerance = 0.5\n", "")
    exact = exact.partition("[tolerance]")[0] + exact[exact.index("[workspace]") :]
    given: Files = {
        "machine.toml": printer, "data.csv": csv, "wild.csv": wild, "few.csv": few,
        "apart.toml": apart, "exact.toml": exact, "planar.toml": machine_text(PLANAR),
    }  # fmt: skip
    asked = ("calibrate", m, "data.csv")
    wrong: tuple[Step, ...] = (
        (*asked, "--machine-output", "new.toml"),
        (*asked, "--machine-output", "new.toml", "--date", "tomorrow"),
        (*asked, "--machine-output", "new.toml", "--date", "2026-02-30"),
        (*asked, "--machine-output", m, "--date", "2026-02-03"),
        (*asked, "--force"),
        (*asked, "--as-shifts"),
        (*asked, "--folds", "1"),
        (*asked, "--margin", "0"),
        (*asked, "--identify", "strut.a.lenght"),
        (*asked, "--identify", "strut.a.length=-1 mm", "--format", "json"),
        (*asked, "-o", "data.csv"),
        ("calibrate", "planar.toml", "data.csv"),
        ("calibrate", m, "wild.csv"),
        ("calibrate", m, "wild.csv", "--no-prior", "--no-robust"),
        ("calibrate", m, "few.csv", "--no-prior"),
        ("calibrate", "apart.toml", "data.csv"),
        ("calibrate", "exact.toml", "data.csv", "--format", "json"),
        ("calibrate", "exact.toml", "data.csv", "--identify", "strut.*.length"),
    )
    yield Case("refused/calibrate", wrong, given, 6.0)
    yield case("refused/init", ("init", "hexapd"), ("init",), ("init", "tripod", "-o", "no/a.toml"))
