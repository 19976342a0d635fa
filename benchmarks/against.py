"""How much quicker this commit is than another one, on the same work in one run.

`python -m benchmarks.against COMMIT [WORK ...]` builds the other commit beside this one and lets
processes of both do each piece of work in turns, on one core; the ratios of the least processor
times, and how equal the results are, go to AGAINST.md. Both read the other commit's machine files.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.built_commit import ROOT, Tree, built_commit, this_tree
from benchmarks.ratios import Agreement, Side, agreement, lines, spread, ten_over_three
from benchmarks.surroundings import surroundings
from benchmarks.tables import Page, Section
from benchmarks.works import WORKS

PAGE = Path(__file__).with_name("AGAINST.md")
COLUMNS = ("before", "after", "before over after", "asked", "", "results")
HEAD = """\
# Against earlier commits

Written by `make bench-against COMMIT=sha`, which builds that commit beside this one; a section a
commit, a line a figure and version. `benchmarks/works.py` says what the work is. Processes of both
do it in turns, on one core and one thread; the figures are the least of all their processor times,
and of their peak memories. Results are compared relative to the largest number of each."""
TEN, THREE = "budget_of_ten", "budget_of_three"

Sides = tuple[Side, Side]


def main() -> int:
    """0 if all that was asked is met and results are equal, 1 if not."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.against", description=__doc__)
    parser.add_argument("commit", metavar="COMMIT")
    parser.add_argument("works", nargs="*", metavar="WORK", help=f"of {', '.join(WORKS)}")
    parser.add_argument("--small", action="store_true", help="do only a little, and write nothing")
    arguments = parser.parse_args()
    if unknown := set(arguments.works) - set(WORKS):
        parser.error(f"no work {', '.join(sorted(unknown))}; there are {', '.join(WORKS)}")
    before, after = built_commit(arguments.commit), this_tree()
    met = True
    sides: dict[str, Sides] = {}
    for name in arguments.works or WORKS:
        start = time.perf_counter()
        sides[name], equality = compared(name, (before, after), small=arguments.small)
        rows = lines(WORKS[name], *sides[name], equality)
        if name in (TEN, THREE) and sides.keys() >= {TEN, THREE}:
            rows += ten_over_three(sides[TEN], sides[THREE])
        for cells, as_asked in rows:
            print(" | ".join(cells), flush=True)
            met &= as_asked
        seconds = time.perf_counter() - start
        print(f"    {name}: {seconds:.0f} s{_disturbance(sides[name])}", flush=True)
        if not arguments.small:
            record(before, after, [cells for cells, _ in rows])
    return 0 if met else 1


def compared(
    name: str, trees: tuple[Tree, Tree], *, small: bool = False
) -> tuple[Sides, Agreement]:
    """One piece of work by both commits in turns, and how equal their first results are."""
    sides, work = (Side(), Side()), WORKS[name]
    machines = trees[0].machines
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"{which}.npz" for which in ("before", "after")]
        for turn in range(1 if small else work.processes):
            for side, tree, file in zip(sides, trees, files, strict=True):
                if side.missing:
                    continue
                extra = ["--small"] if small else []
                extra += ["--results", str(file)] if turn == 0 else []
                side.take(_of_process(name, tree, machines, extra))
        results = [dict(np.load(file)) for file in files if file.exists()]
    if len(results) < len(files):
        return sides, Agreement(work.incomparable or "not compared", kept=True)
    return sides, agreement(work, *results)


def _of_process(name: str, tree: Tree, machines: Path, extra: Sequence[str]) -> dict[str, object]:
    """What a fresh process says, which imports the package of a tree and this tree's benchmarks."""
    command = [sys.executable, "-m", "benchmarks.works", name, "--machines", str(machines), *extra]
    environment = tree.environment()
    run = subprocess.run(
        command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True, check=True
    )
    answer: dict[str, object] = json.loads(run.stdout)
    if not Path(str(answer["package"])).is_relative_to(tree.path):
        raise RuntimeError(f"{answer['package']} was measured, which is not of {tree.path}")
    return answer


def record(before: Tree, after: Tree, rows: Sequence[Sequence[str]]) -> None:
    """Put lines into AGAINST.md; other figures and versions stay as they are."""
    page = Page.read(PAGE, HEAD.splitlines(), COLUMNS)
    section = page.sections.setdefault(f"{before.version} at {before.commit}", Section())
    from truepose import _kernel

    version = f"{after.version} at {after.commit}"
    section.update(version, surroundings(_kernel.instruction_set()), rows)
    PAGE.write_text(page.text(), encoding="utf-8")


def _disturbance(sides: Sides) -> str:
    """By how much the median of the processes is above the least."""
    medians = [f"{spread(side.seconds):.2f}" for side in sides if side.seconds]
    return f", medians over least times {', '.join(medians)}" if medians else ""


if __name__ == "__main__":
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})  # processes inherit it
    sys.exit(main())
