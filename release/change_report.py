"""What a change does to public names and to speed, as Markdown for its pull request.

`python -m release.change_report COMMIT [--works NAME ...] [--output FILE]` compares this checkout
with where it left COMMIT: names as tests/house/public_names.py lists them, times as
benchmarks/against.py takes them, for which COMMIT is built. `--works` without a name takes no
times.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from release import ROOT

GOLDEN = "tests/golden/public_names.txt"
SHORT = ("bounds_at_pose", "forward_call", "forward_batch", "calibration")
"""Works of benchmarks/works.py that take seconds."""
NOTABLE = 0.1
"""Shared machines measure ratios of processor times to about this; beyond it they are marked."""
MOST = 200
"""Names that are listed of a kind; a change of more is read in the golden file."""


def main() -> int:
    """0: a report, whatever it says."""
    parser = argparse.ArgumentParser(prog="python -m release.change_report", description=__doc__)
    parser.add_argument("commit", metavar="COMMIT")
    parser.add_argument("--works", nargs="*", default=SHORT, metavar="NAME")
    parser.add_argument("--output", type=Path, help="a file that the report is added to")
    arguments = parser.parse_args()
    base = _git("merge-base", arguments.commit, "HEAD").strip()
    text = names_section(_git("show", f"{base}:{GOLDEN}"), public_names())
    if arguments.works:
        text += "\n" + speed_section(times(base, arguments.works))
    if arguments.output:
        with arguments.output.open("a", encoding="utf-8") as file:
            file.write(text)
    else:
        print(text, end="")
    return 0


def public_names() -> str:
    """The names that this checkout has, a line each."""
    with tempfile.TemporaryDirectory() as folder:
        written = Path(folder) / "names.txt"
        environment = os.environ | {"PYTHONPATH": str(ROOT / "tests")}
        script = ROOT / "tests" / "house" / "public_names.py"
        subprocess.run([sys.executable, script, written], env=environment, check=True)
        return written.read_text(encoding="utf-8")


def names_section(before: str, after: str) -> str:
    """Names that are gone and new; a changed signature is both."""
    old, new = before.splitlines(), after.splitlines()
    gone = [name for name in old if name not in set(new)]
    added = [name for name in new if name not in set(old)]
    text = "## Public names\n\n"
    if not gone and not added:
        return text + "None is gone, none is new.\n"
    for names, said in ((gone, "gone, and whoever relies on them is broken"), (added, "new")):
        if names:
            text += f"{len(names)} {said}:\n\n"
            text += "".join(f"* `{name}`\n" for name in names[:MOST])
            text += f"* and {len(names) - MOST} more\n" if len(names) > MOST else ""
            text += "\n"
    return text.rstrip("\n") + "\n"


def times(base: str, works: Sequence[str]) -> list[Sequence[str]]:
    """Cells of each work's lines: figure, before, after, ratio, asked, verdict, results."""
    from benchmarks.against import compared
    from benchmarks.built_commit import built_commit, this_tree
    from benchmarks.ratios import lines
    from benchmarks.works import WORKS

    trees = built_commit(base), this_tree()
    rows: list[Sequence[str]] = []
    for name in works:
        sides, equality = compared(name, trees)
        rows += [cells for cells, _ in lines(WORKS[name], *sides, equality)]
    return rows


def speed_section(rows: Sequence[Sequence[str]]) -> str:
    """A line a figure; ratios that noise does not explain are bold."""
    text = "## Speed\n\nLeast processor times of processes in turns.\n\n"
    text += "| work | before | after | before over after | results |\n|---|---|---|---|---|\n"
    for figure, before, after, ratio, _, _, results in rows:
        shown = f"**{ratio}**" if ratio and abs(float(ratio.split()[0]) - 1) > NOTABLE else ratio
        text += f"| {figure} | {before} | {after} | {shown} | {results} |\n"
    return text


def _git(*arguments: str) -> str:
    run = subprocess.run(
        ["git", *arguments], cwd=ROOT, stdout=subprocess.PIPE, encoding="utf-8", check=True
    )
    return run.stdout


if __name__ == "__main__":
    sys.exit(main())
