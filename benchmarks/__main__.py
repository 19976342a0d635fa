"""Runs benchmarks, each in a fresh process on its own cores, and writes their rows."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

from benchmarks import BENCHMARKS
from benchmarks.rows import Benchmark, Row
from benchmarks.surroundings import surroundings
from benchmarks.tables import Page, Section

RESULTS = Path(__file__).with_name("RESULTS.md")
COLUMNS = ("measured", "asked", "", "times behind it")
HEAD = """\
# Benchmark results

Written by `make bench`, a section a module of `benchmarks/`, which says what is measured;
`make bench ONLY=name` measures one alone and replaces its rows only. Ratios of speed are of best
times of several in one run: processor time on one core; wall time for two threads and for the
million poses. Both sides were first checked to agree to 1e-12. Of samples and of regions there is
one run, of a few seconds or more. The ratios to an earlier commit are in
[AGAINST.md](AGAINST.md)."""


def main() -> int:
    """0 if all that was asked is met, 1 if not; benchmarks that fail end the run."""
    names = [benchmark.name for benchmark in BENCHMARKS]
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)}")
    parser.add_argument("--print-only", action="store_true", help="leave RESULTS.md as it is")
    parser.add_argument("--measure", choices=names, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.measure:
        print(json.dumps(measured_here(arguments.measure)))
        return 0
    if unknown := set(arguments.names) - set(names):
        parser.error(f"no benchmark {', '.join(sorted(unknown))}; there are {', '.join(names)}")

    chosen = [
        benchmark
        for benchmark in BENCHMARKS
        if (benchmark.name in arguments.names if arguments.names else benchmark.usual)
    ]
    print(estimate(chosen), flush=True)
    met = True
    for benchmark in chosen:
        start = time.perf_counter()
        answer = measured_apart(benchmark)
        seconds = time.perf_counter() - start
        rows = [Row(**fields) for fields in answer["rows"]]
        print(f"{benchmark.name}, {seconds:.0f} s", flush=True)
        show(rows)
        met &= all(row.met for row in rows)
        if rows and not arguments.print_only:
            record(benchmark.name, rows, seconds, answer["instruction_set"])
    return 0 if met else 1


def estimate(chosen: Sequence[Benchmark]) -> str:
    """How long it will take, by the times that the last runs took."""
    page = Page.read(RESULTS, HEAD.splitlines(), COLUMNS)
    known = page.seconds([benchmark.name for benchmark in chosen], version("truepose"))
    unknown = [benchmark.name for benchmark in chosen if benchmark.name not in known]
    parts = [f"about {sum(known.values()) / 60.0:.1f} minutes, by the last runs"] if known else []
    parts += [f"{', '.join(unknown)}: of no known duration"] if unknown else []
    return "; ".join(parts)


def show(rows: Sequence[Row]) -> None:
    """Print what was measured."""
    for row in rows:
        what, figure, asked, verdict, detail = row.cells()
        note = f"  [{asked}: {verdict.strip('*')}]" if asked else ""
        print(f"{what}: {figure}{note}\n    {detail}", flush=True)


def record(name: str, rows: Sequence[Row], seconds: float, instruction_set: str) -> None:
    """Put the rows of one benchmark into RESULTS.md; all others stay as they are."""
    page = Page.read(RESULTS, HEAD.splitlines(), COLUMNS)
    section = page.sections.setdefault(name, Section())
    run = f"{seconds:.0f} s; {surroundings(instruction_set)}"
    section.replace(version("truepose"), run, [row.cells() for row in rows])
    RESULTS.write_text(page.text([benchmark.name for benchmark in BENCHMARKS]), encoding="utf-8")


def measured_here(name: str) -> dict[str, object]:
    """The rows of one benchmark, measured in this process, and the instruction set that ran."""
    rows = importlib.import_module(f"benchmarks.{name}").measure()
    from truepose import _kernel

    return {"rows": [asdict(row) for row in rows], "instruction_set": _kernel.instruction_set()}


def measured_apart(benchmark: Benchmark) -> dict[str, object]:
    """The same from a process of its own, held on as many cores as the benchmark may use."""
    threads = str(benchmark.cores)
    environment = os.environ | {
        "OMP_NUM_THREADS": threads,
        "OPENBLAS_NUM_THREADS": threads,
        "TRUEPOSE_THREADS": threads,
    }
    allowed = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()
    if allowed:
        # A child inherits the cores of its parent; the last ones are least used by others.
        os.sched_setaffinity(0, sorted(allowed)[-benchmark.cores :])
    try:
        run = subprocess.run(
            [sys.executable, "-m", "benchmarks", "--measure", benchmark.name],
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
            check=False,
        )
    finally:
        if allowed:
            os.sched_setaffinity(0, allowed)
    if run.returncode:
        sys.exit(f"benchmark {benchmark.name} failed; see above")
    return json.loads(run.stdout)


if __name__ == "__main__":
    sys.exit(main())
