"""Every command on every machine of the library, at a few poses; the examples as they are."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from typing import Any

from house.recorded_cases import EXAMPLES, MACHINES, REPOSITORY, Case, Step, machine_text

NAMES = sorted(path.stem for path in MACHINES.glob("*.toml"))
CONTROLLERS = (
    "c",
    "linuxcnc",
    "linuxcnc-genhexkins",
    "linuxcnc-lineardelta",
    "klipper",
    "marlin",
    "reprap",
    "pose-map",
)
REPORTED = ("planar_two_slider", "overconstrained", "hexapod_all_sources")
EVALUATIONS: dict[str, tuple[str, ...]] = {
    "check": (),
    "budget": (),
    "compensate": (),
    "montecarlo": ("--samples", "300"),
    "bounds": (),
    "shares": ("--samples", "32"),
    "strain": (),
}
"""Commands that take a machine file alone, with options that keep them quick."""
SLOW = {
    ("bounds", "walking_6psu"): 8.0,
    ("bounds", "hexapod_all_sources"): 8.0,
}


def few_poses(file: dict[str, Any]) -> list[str]:
    """Settings that leave four poses of a machine file's grid: corners of its first two axes."""
    settings = []
    for number, (axis, (low, high, _)) in enumerate(file["workspace"]["grid"].items()):
        ends = (
            f"[{low}, {high}, 2]" if number < 2 else f"[{(low + high) / 2}, {(low + high) / 2}, 1]"
        )
        settings += ["--set", f"workspace.grid.{axis}={ends}"]
    return settings


def program(file: dict[str, Any]) -> str:
    """A short program in the middle of a machine's workspace, of lines and, in x and y, an arc."""
    grid = file["workspace"]["grid"]
    middle = {axis: (low + high) / 2 for axis, (low, high, _) in grid.items()}
    reach = {axis: 0.2 * (high - low) for axis, (low, high, _) in grid.items()}
    words = " ".join(f"{axis.upper()}{value:.4f}" for axis, value in middle.items())
    first, second = list(middle)[:2]
    there = middle[first] + reach[first]
    lines = [
        f"{'G20' if file['units']['length'] == 'in' else 'G21'} G90 G94 F300 (part)",
        f"G0 {words}",
        f"G1 {first.upper()}{there:.4f}",
        f"{second.upper()}{middle[second] + reach[second]:.4f}",
    ]
    if first == "x" and second == "y":
        radius = reach["y"] / 4
        lines.append(f"G3 Y{middle['y'] + reach['y'] - 2 * radius:.4f} J{-radius:.4f} I0")
    return "\n".join([*lines, "M2", ""])


def cases() -> Iterator[Case]:
    """All of them."""
    for name in NAMES:
        text = machine_text(name)
        file = tomllib.loads(text)
        few = few_poses(file)
        files: dict[str, str | bytes] = {"machine.toml": text}
        for command, options in EVALUATIONS.items():
            asked = (command, "machine.toml", *few, *options)
            written = ("-o", "out.csv") if command != "check" else ("-o", "out.json")
            dataset = ("-o", "out.nc") if command != "check" else ()
            steps = [(*asked, *written), (*asked, "--format", "json", *dataset)]
            yield Case(f"{command}/{name}", tuple(steps), files, SLOW.get((command, name), 1.0))
        yield Case(f"export/{name}", tuple(exports(few)), files, 2.0)
        yield Case(
            f"gcode/{name}",
            (
                ("gcode", "machine.toml", "part.ngc", "-o", "out.ngc"),
                ("gcode", "machine.toml", "part.ngc", "-o", "pose.ngc", "--interpolation", "pose",
                 "--tolerance", "20 um", "--format", "json"),
            ),
            {**files, "part.ngc": program(file)},
            2.0,
        )  # fmt: skip
        plan = ("plan", "machine.toml", "--instrument", "position=10um", "--poses", "4", *few)
        yield Case(
            f"plan/{name}",
            (
                (*plan, "--program", "measure.ngc", "--template", "template.csv", "-o", "out.csv"),
                (*plan, "--format", "json", "-o", "out.nc"),
            ),
            files,
            2.0,
        )
        yield Case(f"init/{name}", (("init", name), ("init", name), ("init", name, "-o", "a.toml")))
    for name in REPORTED:
        text = machine_text(name)
        few = few_poses(tomllib.loads(text))
        step = ("report", "machine.toml", *few, "-o", "page.html")
        yield Case(f"report/{name}", (step,), {"machine.toml": text}, 10.0)
    yield from examples()


def exports(few: list[str]) -> Iterator[Step]:
    """One step a controller: what it is given is written, and printed for some."""
    for controller in CONTROLLERS:
        yield ("export", controller, "machine.toml", *few, "-o", f"for-{controller}")


def examples() -> Iterator[Case]:
    """The examples as scripts, with their data and machines where they look for them."""
    data = {
        str(path.relative_to(REPOSITORY)): path.read_bytes()
        for folder in (EXAMPLES, MACHINES)
        for path in sorted(folder.rglob("*"))
        if path.suffix in (".py", ".toml", ".csv")
    }
    for path in sorted(EXAMPLES.glob("*.py")):
        step = ("python", f"examples/{path.name}")
        yield Case(f"example/{path.stem}", (step,), dict(data), 3.0)
