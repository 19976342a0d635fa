"""Runs the benchmarks, each in a fresh process on its own cores, and writes RESULTS.md."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

from benchmarks import BENCHMARKS
from benchmarks.rows import Benchmark, Row

RESULTS = Path(__file__).with_name("RESULTS.md")
COLUMNS = ("what", "measured", "asked", "", "times behind it")


def main() -> int:
    """0 if all that was asked is met, 1 if not; benchmarks that fail end the run."""
    names = [benchmark.name for benchmark in BENCHMARKS]
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)}")
    parser.add_argument("--measure", choices=names, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.measure:
        print(json.dumps(measured_here(given.measure)))
        return 0
    if unknown := set(given.names) - set(names):
        parser.error(f"no benchmark {', '.join(sorted(unknown))}; there are {', '.join(names)}")

    chosen = [benchmark for benchmark in BENCHMARKS if benchmark.name in (given.names or names)]
    rows: list[Row] = []
    instruction_set = ""
    for benchmark in chosen:
        answer = measured_apart(benchmark)
        instruction_set = answer["instruction_set"]
        for row in (Row(**fields) for fields in answer["rows"]):
            what, figure, asked, verdict, detail = row.cells()
            note = f"  [{asked}: {verdict.strip('*')}]" if asked else ""
            print(f"{what}: {figure}{note}\n    {detail}", flush=True)
            rows.append(row)
    if not given.names:
        RESULTS.write_text("\n".join(document(rows, instruction_set)) + "\n", encoding="utf-8")
        print(f"written to {RESULTS}")
    return 0 if all(row.met for row in rows) else 1


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


def document(rows: list[Row], instruction_set: str) -> Iterator[str]:
    """RESULTS.md, line by line."""
    yield "# Benchmark results"
    yield ""
    yield "Written by `make bench`; the modules of `benchmarks/` say what is measured. Ratios of"
    yield "speed are of best times of several in one run: processor time on one core; wall time for"
    yield "two threads and for the million poses. Both sides were first checked to agree to 1e-12."
    yield "Of samples and of regions there is one run, of a few seconds or more."
    yield ""
    yield f"* Processor: {processor()}, {os.cpu_count()} cores"
    yield f"* Instruction set that the kernel chose: {instruction_set}"
    yield f"* System: {platform.system()} {platform.machine()}, Python {platform.python_version()}"
    packages = ", ".join(f"{name} {version(name)}" for name in ("truepose", "numpy", "scipy"))
    yield f"* Packages: {packages}"
    yield ""
    yield f"| {' | '.join(COLUMNS)} |"
    yield f"|{'---|' * len(COLUMNS)}"
    for row in rows:
        yield f"| {' | '.join(row.cells())} |"


def processor() -> str:
    """The processor's name as the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else "unknown"


if __name__ == "__main__":
    sys.exit(main())
