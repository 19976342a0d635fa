"""Writes `tests/golden/public_names.txt`: what users may rely on by name, a name a line.

    PYTHONPATH=python:tests python tests/house/public_names.py [FILE]

Functions with their signatures, attributes and methods of what they return (by the way to them,
since classes are not public), dotted paths that the pages show, Dataset variables, JSON keys, CSV
headers, keys of files, error codes, commands and their options, and registered names. Annotations
are left out of signatures, and a default that is no plain value is `...`.
"""

from __future__ import annotations

import contextlib
import csv
import importlib
import inspect
import io
import json
import os
import re
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from house.recorded_cases import EXAMPLES, INPUTS, MACHINES, REPOSITORY, Case, recorded_cases
from house.recorder import ENVIRONMENT, prepare, record_case

GOLDEN = REPOSITORY / "tests" / "golden" / "public_names.txt"
DEEPEST = 3
"""How many objects behind what a function returns are looked into."""
CLOSED = {"kernel", "sources", "fit", "spread", "dataset", "study", "page_of_part", "drawn"}
"""Attributes whose content is no promise (no page shows it) or, `dataset`, is listed apart."""
PIN_PAGES = "linuxcnc"
"""Pages on which `truepose.enable` is a pin of LinuxCNC's."""
RECORDED = (
    r"(check|budget|compensate|montecarlo|bounds|shares)/(planar_two_slider|linear_delta)",
    r"strain/overconstrained|gcode/tripod|plan/tripod",
    r"options/(help|lists|strain|shares|accuracy_at)",
    r"over-time/(planar|delta)",
    r"(compare/printer|printer/(positions|no_prior))",
    r"broken_machine/00\d_.*",
)
"""The cases whose JSON and CSV are looked at."""
FEW = ["workspace.grid.x=[200, 400, 2]", "workspace.grid.y=[100, 300, 2]"]


def signature(function: Any) -> str:
    """Parameters with their kinds and defaults, without annotations."""
    try:
        told = inspect.signature(function)
    except (TypeError, ValueError):
        return "(...)"
    empty = inspect.Parameter.empty
    parameters = [
        parameter.replace(
            annotation=empty,
            default=parameter.default
            if isinstance(parameter.default, (str, int, float, bool, type(None), tuple))
            or parameter.default is empty
            else ...,
        )
        for parameter in told.parameters.values()
        if parameter.name not in ("self", "cls")
    ]
    return str(
        told.replace(parameters=parameters, return_annotation=inspect.Signature.empty)
    ).replace("Ellipsis", "...")


def is_ours(value: Any) -> bool:
    return type(value).__module__.partition(".")[0] == "truepose"


def names_below(value: Any, way: str, seen: set[type], depth: int = 0) -> Iterator[str]:
    """Attributes and methods of an object of ours and of what hangs on it; a class only once."""
    if isinstance(value, (list, tuple)) and not hasattr(value, "_fields"):
        for content in value:
            yield from names_below(content, f"{way}[]", seen, depth)
        return
    if isinstance(value, Mapping):
        for content in value.values():
            yield from names_below(content, f"{way}[]", seen, depth)
        return
    if not is_ours(value) or type(value) in seen or depth > DEEPEST:
        return
    seen.add(type(value))
    below = []
    for name in sorted({*dir(type(value)), *getattr(value, "__dict__", {})}):
        if name.startswith("_"):
            continue
        static = inspect.getattr_static(type(value), name, None)
        if isinstance(static, (staticmethod, classmethod)) or inspect.isroutine(static):
            yield f"method {way}.{name}{signature(getattr(value, name))}"
            continue
        yield f"attribute {way}.{name}"
        if name not in CLOSED:
            with contextlib.suppress(Exception):  # a property may refuse this object
                below.append((name, getattr(value, name)))
    for name, content in below:
        yield from names_below(content, f"{way}.{name}", seen, depth + 1)


def dataset_names(function: str, dataset: Any) -> Iterator[str]:
    """Variables, coordinates, dimensions and attributes of a Dataset."""
    for name, variable in dataset.data_vars.items():
        yield f"variable {function}.{name} ({', '.join(map(str, variable.dims))})"
    for name, variable in dataset.coords.items():
        yield f"coordinate {function}.{name} ({', '.join(map(str, variable.dims))})"
    for variable in dataset.variables.values():
        yield from (f"variable-attribute {function}.{key}" for key in variable.attrs)
    yield from (f"dimension {function}.{name}" for name in dataset.sizes)
    yield from (f"attribute {function}.attrs.{key}" for key in dataset.attrs)


def functions() -> Iterator[str]:
    """What `truepose.__all__` has, and what its functions return for small machines."""
    import truepose as tp

    for name in tp.__all__:
        value = getattr(tp, name)
        if inspect.isclass(value):
            yield f"class {name}{signature(value)}"
        elif callable(value):
            yield f"function {name}{signature(value)}"
        else:
            yield f"name {name}"
    for name, value in vars(tp.errors).items():
        if inspect.isclass(value) and value.__module__ == tp.errors.__name__:
            yield f"class errors.{name}{signature(value)}"
            for attribute in sorted(vars(value)):
                if not attribute.startswith("_"):
                    yield f"attribute errors.{name}.{attribute}"
        elif name.isupper():
            yield f"name errors.{name}"
    yield from (f"code {code}" for code in tp.errors.CATALOGUE)
    planar = tp.load(MACHINES / "planar_two_slider.toml", FEW)
    overconstrained = tp.load(
        MACHINES / "overconstrained.toml", ["workspace.grid.x=[-100, 100, 2]"]
    )
    delta = tp.load(EXAMPLES / "data" / "delta_printer.toml")
    calibration = tp.calibrate(delta, EXAMPLES / "data" / "delta_positions.csv")
    seen: set[type] = set()
    with tempfile.TemporaryDirectory() as temporary:
        part = Path(temporary) / "part.ngc"
        part.write_text("G21 G90 G94 F900\nG0 X300 Y200\nG1 X340 Y210\n", encoding="utf-8")
        logged = Path(temporary) / "logged.toml"
        text = (MACHINES / "planar_two_slider.toml").read_text(encoding="utf-8")
        logged.write_text(text.replace("\ntemperature = 35", '\ntemperature_log = "log.csv"'))
        log = Path(temporary) / "log.csv"
        log.write_text("time (s),strut.1 (degC),strut.2 (degC)\n0,20,20\n60,30,25\n")
        warming = tp.load(logged)
        calibrated = Path(temporary) / "calibrated.toml"
        calibration.save(
            calibrated, original=EXAMPLES / "data" / "delta_printer.toml", date="2026-01-31"
        )
        costs = tp.load(EXAMPLES / "data" / "hexapod_costs.toml")
        results = {
            "load": planar,
            "allocate": tp.allocate(costs),
            "load().condition": warming.condition,
            "Input": tp.Input.normal(1.0, 0.1),
            "accuracy": tp.accuracy(planar),
            "forward_solutions": tp.forward_solutions(planar, [0.2, 0.2], starts=50),
            "inverse_solutions": tp.inverse_solutions(planar, [0.3, 0.2]),
            "check": tp.check(planar),
            "compare": tp.compare(planar, planar),
            "report": tp.report(planar, Path(temporary) / "page.html"),
            "load().plot()": planar.plot(),
            "calibrate": calibration,
            "correct_program": tp.correct_program(planar, part, Path(temporary) / "out.ngc"),
            "export": tp.export(planar, "c"),
            "plan": tp.plan(delta, calibration.measurements.instruments, 3),
            "load(calibrated)": tp.load(calibrated),
            "load().machine": overconstrained,
        }
        for name, result in results.items():
            way = name if name == "Input" or ")" in name else f"{name}()"
            yield from names_below(result, way, seen)
        yield from dataset_names("over_time", tp.over_time(warming))
    everything = tp.load(
        MACHINES / "hexapod_all_sources.toml",
        [f"workspace.grid.{axis}=[0, 0, 1]" for axis in "xyabc"]
        + ["workspace.grid.z=[660, 660, 1]"],
    )
    for machine in (planar, overconstrained, everything):
        yield from dataset_names("budget", tp.budget(machine))
        yield from dataset_names("compensate", tp.compensate(machine))
        yield from dataset_names("monte_carlo", tp.monte_carlo(machine, samples=64))
        if machine is not overconstrained:  # of which nothing is proven
            yield from dataset_names("bounds", tp.bounds(machine))
        yield from dataset_names("worst_case", tp.worst_case(machine))
        yield from dataset_names("uncertainty", tp.uncertainty(machine))
    yield from dataset_names("shares", tp.shares(planar, samples=32))
    yield from dataset_names("strain", tp.strain(overconstrained))
    region = {"x": (0.29, 0.31), "y": (0.19, 0.21)}
    yield from dataset_names("bounds(region)", tp.bounds(planar, region=region, gap=0.3))
    yield from dataset_names("calibrate", calibration.dataset)
    yield from dataset_names("plan", results["plan"].dataset)
    yield from dataset_names("allocate", results["allocate"].dataset)
    inputs = {"a": tp.Input.uniform(1.0, 2.0), "b": tp.Input.normal(1.0, 0.1)}
    yield from dataset_names("worst_case(function)", tp.worst_case(product, inputs=inputs))
    yield from dataset_names("uncertainty(function)", tp.uncertainty(product, inputs=inputs))
    sampled = tp.monte_carlo(product, inputs=inputs, samples=64)
    yield from dataset_names("monte_carlo(function)", sampled)
    yield from dataset_names("shares(function)", tp.shares(product, inputs=inputs, samples=32))


def product(a: Any, b: Any) -> Any:
    return a * b


def dotted_paths() -> Iterator[str]:
    """Modules and names that README, pages and examples show; each must be there."""
    pages = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").rglob("*.md"))]
    shown: set[str] = set()
    for page in [*pages, *sorted(EXAMPLES.rglob("*.py"))]:
        text = page.read_text(encoding="utf-8")
        for match in re.finditer(r"^\s*from (truepose[a-z_.]*) import (.+)$", text, re.MULTILINE):
            shown |= {f"{match[1]}.{name.split()[0]}" for name in re.split(r",\s*", match[2])}
        if PIN_PAGES in page.name:
            continue
        for match in re.finditer(r"\b(?:truepose|tp)((?:\.[A-Za-z_]\w*)+)", text):
            shown.add(f"truepose{match[1]}")
    for path in shown:
        if not path.endswith((".toml", ".csv", ".html", ".md")):
            resolve(path)
            yield f"path {path}"


def resolve(path: str) -> None:
    """Raise where a dotted path leads nowhere."""
    value: Any = importlib.import_module("truepose")
    way = "truepose"
    for name in path.split(".")[1:]:
        way = f"{way}.{name}"
        if not hasattr(value, name):
            importlib.import_module(way)
        value = getattr(value, name)


def recorded() -> Iterator[str]:
    """Keys of JSON, headers of CSV, commands and options, of a few recorded cases."""
    chosen = re.compile("|".join(RECORDED))
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for case in recorded_cases():
            if chosen.fullmatch(case.name):
                record_case(case, folder)
                yield from output_names(case, folder / case.name)


def output_names(case: Case, folder: Path) -> Iterator[str]:
    """The names in what a case printed and wrote."""
    for number, step in enumerate(case.steps, start=1):
        command = step[0]
        text = (folder / f"{number}.stdout").read_text(encoding="utf-8")
        if "--help" in step:
            yield from options(command, text)
        else:
            yield from text_names(command, text)
        output = step[step.index("-o") + 1] if "-o" in step else ""
        path = folder / "files" / output
        if output.endswith((".json", ".csv")) and path.exists():
            yield from text_names(command, path.read_text(encoding="utf-8"))


def text_names(command: str, text: str) -> Iterator[str]:
    """Keys of a JSON text, or the header of a CSV."""
    if text.startswith("{"):
        yield from (f"json {command}{key}" for key in json_keys(json.loads(text)))
    elif "," in text.partition("\n")[0] and not text.partition("\n")[0].endswith("."):
        rows = list(csv.reader(io.StringIO(text)))
        if len({len(row) for row in rows}) == 1:
            yield from (f"csv {command}.{name}" for name in rows[0])


def json_keys(value: Any, way: str = "") -> Iterator[str]:
    """Paths of keys, with [] for a list."""
    if isinstance(value, dict):
        for key, content in value.items():
            # A key with a point in it is a parameter or a part of the machine.
            name = "<name>" if "." in key else key
            yield f"{way}.{name}"
            yield from json_keys(content, f"{way}.{name}")
    elif isinstance(value, list):
        for content in value:
            yield from json_keys(content, f"{way}[]")
    elif isinstance(value, str) and value.startswith(("{", "[{")):
        with contextlib.suppress(json.JSONDecodeError):
            yield from json_keys(json.loads(value), way)


def options(command: str, text: str) -> Iterator[str]:
    """A command and its options, of its help."""
    command = "" if command.startswith("-") else f" {command}"
    yield f"command truepose{command}"
    for match in re.finditer(r"^  (-\w, )?(--[a-z-]+)( [A-Z\[][^\s]*)?", text, re.MULTILINE):
        yield f"option truepose{command} {match[1] or ''}{match[2]}{match[3] or ''}"


def file_keys() -> Iterator[str]:
    """Keys of the machine file and of measurements."""
    schema = REPOSITORY / "docs" / "machine_file.schema.json"
    yield from schema_keys(json.loads(schema.read_text(encoding="utf-8")), "machine-file ")
    page = (REPOSITORY / "docs" / "measurements.md").read_text(encoding="utf-8")
    for row in re.finditer(r"^\| (`[^|]+`[^|]*) \|", page, re.MULTILINE):
        yield from (f"measurements {name}" for name in re.findall(r"`([^`]+)`", row[1]))
    for path in sorted(INPUTS.glob("*.csv")):
        header = next(
            line for line in path.read_text(encoding="utf-8").splitlines() if line[0] != "#"
        )
        columns = [name.partition(" (")[0] for name in header.split(", ")]
        yield from (f"measurements {name}" for name in columns)


def schema_keys(schema: Any, way: str) -> Iterator[str]:
    """Paths of the keys that a JSON schema describes."""
    if isinstance(schema, list):
        for part in schema:
            yield from schema_keys(part, way)
        return
    if not isinstance(schema, dict):
        return
    for name, part in schema.get("properties", {}).items():
        path = f"{way}{'' if way.endswith(' ') else '.'}{name}"
        yield path
        yield from schema_keys(part, path)
    for name, part in schema.get("patternProperties", {}).items():
        yield f"{way}.<{name}>"
        yield from schema_keys(part, f"{way}.<{name}>")
    yield from schema_keys(schema.get("additionalProperties"), f"{way}.*")
    yield from schema_keys(schema.get("items"), f"{way}[]")
    for key in ("anyOf", "oneOf", "allOf"):
        yield from schema_keys(schema.get(key), way)


def registered() -> Iterator[str]:
    """Names under which sources, controllers, instruments and distributions are found."""
    from truepose.calibration import instruments
    from truepose.controllers import REGISTRY as CONTROLLERS
    from truepose.sources import REGISTRY as SOURCES

    yield from (f"source {source.name}" for source in SOURCES)
    yield from (f"controller {name}" for name in CONTROLLERS)
    yield from (f"instrument {name}" for name in instruments.REGISTRY)
    schema = (REPOSITORY / "docs" / "machine_file.schema.json").read_text(encoding="utf-8")
    for match in re.finditer(r'"distribution": \{\s*"description": "([^"]*)"', schema):
        yield from (f"distribution {name}" for name in match[1].split(", "))
    yield from (f"kind {path.stem}" for path in MACHINES.glob("*.toml"))


def public_names() -> str:
    """All of them, sorted, a name a line."""
    os.environ.update(ENVIRONMENT)
    prepare()
    # Recorded first: a case is a fork, and a fork has none of the kernel's threads.
    names = set(recorded())
    for source in (functions, dotted_paths, file_keys, registered):
        names |= set(source())
    return "\n".join([*sorted(" ".join(name.split()) for name in names), ""])


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else GOLDEN
    target.write_text(public_names(), encoding="utf-8")
