"""Records all that a user sees of truepose, and compares two records.

    PYTHONPATH=python:tests python tests/house/recorder.py record FOLDER [--only GLOB] [--jobs 2]
    PYTHONPATH=python:tests python tests/house/recorder.py compare OLD NEW [--relative 1e-9]
        [--mask-sentences]

A record is a folder for each case with what every step of it was given and gave: arguments, exit
code, stdout, stderr, and the files written, netCDF as text. Recorded twice at one commit it is the
same to the last byte. The inputs are those beside this file and the machines and examples of this
checkout; the package is the one that PYTHONPATH names, which may be another commit's. For that
reason nothing but the command line and the public names is used here.
"""

from __future__ import annotations

import argparse
import fnmatch
import importlib
import multiprocessing
import os
import pkgutil
import re
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path

from house.comparison import compare_records
from house.recorded_cases import MACHINES, REPOSITORY, Case, recorded_cases

ENVIRONMENT = {
    "COLUMNS": "100",
    "LINES": "40",
    "NO_COLOR": "1",
    "TERM": "dumb",
    "LC_ALL": "C.UTF-8",
    "TZ": "UTC",
    "PYTHONHASHSEED": "0",
    "TRUEPOSE_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
}
"""What the machine that records must not decide."""
CRASHED = 70
"""Exit code of a step that ended with an exception that is no refusal."""
CODE = re.compile(r"\b(?:error|warning)\[([a-z0-9-]+)\]|\"code\": \"([a-z0-9-]+)\"")


def prepare() -> None:
    """Import everything once, so that the fork of a case has nothing left to import."""
    package = importlib.import_module("truepose")
    for module in pkgutil.walk_packages(package.__path__, "truepose."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    for name in ("h5netcdf", "jinja2", "plotly", "rich.console", "rich.progress", "xarray"):
        importlib.import_module(name)
    # The first machine file that is read builds the models of all.
    package.load(MACHINES / "planar_two_slider.toml")


def in_fork(work: Callable[[], int], stdout: Path, stderr: Path) -> int:
    """Exit code of `work` in a process of its own, its streams in files."""
    sys.stdout.flush()
    sys.stderr.flush()
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    code = CRASHED
    try:
        for number, path in ((1, stdout), (2, stderr)):
            opened = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
            os.dup2(opened, number)
        null = os.open(os.devnull, os.O_RDONLY)
        os.dup2(null, 0)
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        sys.stderr = open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        try:
            code = work()
        except SystemExit as ending:
            code = ending.code if isinstance(ending.code, int) else int(ending.code is not None)
        except BaseException as failure:  # a traceback names lines, which change
            last = traceback.format_exception_only(failure)[-1].rstrip()
            print(f"NOT CAUGHT: {last}", file=sys.stderr)
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)


def command_line(arguments: tuple[str, ...]) -> int:
    """The exit code of `truepose ARGUMENTS...`."""
    from truepose.cli import main

    sys.argv = ["truepose", *arguments]
    main()
    return 0


def script(arguments: tuple[str, ...], stdout: Path, stderr: Path) -> int:
    """Run a Python script in an interpreter of its own."""
    with stdout.open("wb") as out, stderr.open("wb") as err:
        return subprocess.run(
            [sys.executable, *arguments], stdout=out, stderr=err, check=False
        ).returncode


def record_case(case: Case, folder: Path) -> float:
    """Run a case in a folder of its own and write what it gave; the processor's seconds."""
    begun = seconds_of_children()
    place = folder / case.name
    place.mkdir(parents=True)
    before = Path.cwd()
    with tempfile.TemporaryDirectory(prefix="record") as temporary:
        os.chdir(temporary)
        try:
            for name, content in case.files.items():
                path = Path(name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content if isinstance(content, bytes) else content.encode())
            given = contents(Path())
            for number, step in enumerate(case.steps, start=1):
                run_step(step, number, place)
            for name, text in sorted(contents(Path()).items()):
                if given.get(name) != text:
                    keep(Path(name), place / "files")
        finally:
            os.chdir(before)
    return seconds_of_children() - begun


def seconds_of_children() -> float:
    """Processor time of the steps so far."""
    times = os.times()
    return times.children_user + times.children_system


def run_step(step: tuple[str, ...], number: int, place: Path) -> None:
    """One command of a case: `truepose` without its name, or `python FILE ...`."""
    stdout, stderr = place / f"{number}.stdout", place / f"{number}.stderr"
    if step[:1] == ("python",):
        code = script(step[1:], stdout, stderr)
    else:
        code = in_fork(lambda: command_line(step), stdout, stderr)
    here = str(Path.cwd()).encode()
    for path in (stdout, stderr):
        content = path.read_bytes().replace(here, b"<folder>")
        path.write_bytes(content.replace(str(REPOSITORY).encode(), b"<repository>"))
    shown = " ".join(repr(word) if " " in word else word for word in step)
    (place / f"{number}.exit").write_text(f"{shown}\nexit code {code}\n", encoding="utf-8")


def contents(folder: Path) -> dict[str, bytes]:
    """Path -> content of the files below a folder."""
    return {
        str(path): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    }


def keep(path: Path, folder: Path) -> None:
    """Copy a file that was written into the record; netCDF as text."""
    target = folder / path
    target.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".nc":
        target.with_suffix(".nc.txt").write_text(dataset_text(path), encoding="utf-8")
    else:
        shutil.copyfile(path, target)


def dataset_text(path: Path) -> str:
    """Every variable, coordinate and attribute of a netCDF file, with all digits."""
    import numpy as np
    import xarray as xr

    lines = []
    with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as dataset:
        lines.append(f"sizes: {dict(dataset.sizes)}")
        lines += [f"attribute {key}: {value!r}" for key, value in dataset.attrs.items()]
        for kind, variables in (("coordinate", dataset.coords), ("variable", dataset.data_vars)):
            for name, variable in variables.items():
                lines.append(f"{kind} {name} {variable.dims} {variable.dtype}")
                lines += [f"  {key}: {value!r}" for key, value in variable.attrs.items()]
                values = np.ravel(variable.values).tolist()
                lines += [f"    {value!r}" for value in values]
    return "\n".join(lines) + "\n"


def codes_seen(folder: Path) -> set[str]:
    """Codes of problems that stand anywhere in a record."""
    seen = set()
    for path in folder.rglob("*"):
        if path.is_file():
            for match in CODE.finditer(path.read_text(encoding="utf-8", errors="replace")):
                seen.add(match[1] or match[2])
    return seen


def record(folder: Path, only: str = "*", jobs: int = 1) -> int:
    """Record all cases whose name matches into a new folder; the number of cases."""
    os.environ.update(ENVIRONMENT)
    cases = [case for case in recorded_cases() if fnmatch.fnmatch(case.name, only)]
    folder = folder.resolve()
    if folder.exists() and any(folder.iterdir()):
        raise SystemExit(f"{folder} is not empty")
    folder.mkdir(parents=True, exist_ok=True)
    context = multiprocessing.get_context("spawn")
    begun = time.monotonic()
    # The longest first, so that no process is left with one at the end.
    cases.sort(key=lambda case: (-case.weight, case.name))
    with context.Pool(jobs, initializer=prepare) as pool:
        pairs = [(case, folder) for case in cases]
        seconds = pool.starmap(record_case, pairs, chunksize=1)
    slow = sorted(zip(seconds, (case.name for case in cases), strict=True), reverse=True)[:8]
    passed = time.monotonic() - begun
    print(f"{len(cases)} cases in {passed:.0f} s; processor time {sum(seconds):.0f} s")
    print("slowest:", ", ".join(f"{name} {taken:.1f} s" for taken, name in slow))
    return len(cases)


def summary(folder: Path) -> None:
    """Print what a whole record does not reach."""
    from truepose.errors import CATALOGUE

    seen = codes_seen(folder)
    never = [code for code in CATALOGUE if code not in seen]
    print(f"{len(CATALOGUE) - len(never)} of {len(CATALOGUE)} codes seen; never:", *never)
    crashed = [
        str(path.relative_to(folder).parent)
        for path in sorted(folder.rglob("*.stderr"))
        if "NOT CAUGHT" in path.read_text(encoding="utf-8", errors="replace")
    ]
    if crashed:
        print("ended with an exception:", *crashed)


def main() -> int:
    """The program; exit code 1 where two records differ."""
    parser = argparse.ArgumentParser(description="Record what users see, and compare records.")
    commands = parser.add_subparsers(dest="command", required=True)
    recording = commands.add_parser("record")
    recording.add_argument("folder", type=Path)
    recording.add_argument("--only", default="*", help="cases to record, a pattern of their names")
    recording.add_argument("--jobs", type=int, default=2)
    comparing = commands.add_parser("compare")
    comparing.add_argument("old", type=Path)
    comparing.add_argument("new", type=Path)
    comparing.add_argument("--relative", type=float, default=0.0)
    comparing.add_argument("--mask-sentences", action="store_true")
    options = parser.parse_args()
    if options.command == "record":
        record(options.folder, options.only, options.jobs)
        if options.only == "*":
            summary(options.folder)
        return 0
    return compare_records(options.old, options.new, options.relative, options.mask_sentences)


if __name__ == "__main__":
    sys.exit(main())
