"""The study's command line; see `calibration_study`."""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track

from calibration_study.advice import GOOD_ENDS, follow
from calibration_study.blunders import FACTORS, KINDS
from calibration_study.in_use import used_of
from calibration_study.study import (
    Rates,
    Result,
    as_row,
    drawn_set,
    of_row,
    rates,
    result_of,
    share,
)

Member = tuple[str, int, float, float]
"""Kind, seed, and the sizes of a graded blunder, in those that are detected in 99 %."""
Row = dict[str, Any]

GRADES = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
POWER = ("bumped", "drift", "scale")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, or show what was run; 0."""
    options = _parser().parse_args(arguments)
    members = _members(options)
    if options.command != "table":
        _run(WORK[options.command], members, options.output, options.jobs)
    rows = _read(options.output)
    show = {"follow": _ends, "use": _uses, "power": _powers}.get(options.command, table_of)
    print(show(rows, options.kinds))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="calibration_study")
    commands = parser.add_subparsers(dest="command", required=True)
    for name, words in (
        ("run", "draw sets, calibrate and judge them"),
        ("power", "the same for step, trend and scale of given sizes"),
        ("follow", "do what the answers to refused sets ask for"),
        ("use", "command the machines with what is written for accepted good data"),
        ("table", "show what a file of `run` says"),
    ):
        command = commands.add_parser(name, help=f"{words}; goes on where the file of results ends")
        kinds = {"power": POWER, "use": ("none",)}.get(name, tuple(KINDS))
        command.add_argument("--output", type=Path, required=True, help="lines of JSON, one a set")
        command.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(kinds))
        command.add_argument("--count", type=int, default=150, help="sets of each kind")
        command.add_argument("--seed", type=int, default=0, help="of the first set")
        command.add_argument("--jobs", type=int, default=1)
        command.add_argument(
            "--factors", type=float, nargs=2, default=FACTORS, metavar=("FROM", "TO"),
            help="sizes of graded blunders, in those that are detected in 99 %%",
        )  # fmt: skip
    return parser


def _members(options: argparse.Namespace) -> list[Member]:
    grades = [(f, f) for f in GRADES] if options.command == "power" else [tuple(options.factors)]
    seeds = range(options.seed, options.seed + options.count)
    return [(kind, seed, *grade) for kind in options.kinds for grade in grades for seed in seeds]


def _run(
    work: Callable[[Member, Path], Row], members: Iterable[Member], output: Path, jobs: int
) -> None:
    done = {tuple(row["member"]) for row in _read(output)}
    left = [member for member in members if member not in done]
    output.parent.mkdir(parents=True, exist_ok=True)
    console = Console(stderr=True)
    with tempfile.TemporaryDirectory() as folder, output.open("a", encoding="utf-8") as file:
        made = _made(partial(_row_of, work, Path(folder)), left, jobs)
        for row in track(made, "sets", len(left), console=console):
            file.write(json.dumps(row) + "\n")
            file.flush()


def _made(work: Callable[[Member], Row], members: Sequence[Member], jobs: int) -> Iterator[Row]:
    if jobs == 1:
        yield from map(work, members)
        return
    with get_context("spawn").Pool(jobs) as pool:
        yield from pool.imap_unordered(work, members)


def _row_of(work: Callable[[Member, Path], Row], folder: Path, member: Member) -> Row:
    # Files of different sets have one name: each has a folder of its own.
    with tempfile.TemporaryDirectory(dir=folder) as own:
        return {"member": list(member), **work(member, Path(own))}


def _judge(member: Member, folder: Path) -> Row:
    kind, seed, *factors = member
    return as_row(result_of(drawn_set(kind, seed, folder, (factors[0], factors[1]))))


def _follow(member: Member, folder: Path) -> Row:
    kind, seed, *factors = member
    found = follow(drawn_set(kind, seed, folder, (factors[0], factors[1])))
    return {} if found is None else {"end": found.end, "steps": list(found.steps)}


def _use(member: Member, folder: Path) -> Row:
    kind, seed, *factors = member
    found = used_of(drawn_set(kind, seed, folder, (factors[0], factors[1])))
    return {each.way: each.ratio for each in found}


WORK: dict[str, Callable[[Member, Path], Row]] = {
    "run": _judge,
    "power": _judge,
    "follow": _follow,
    "use": _use,
}


def _read(path: Path) -> list[Row]:
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line]


def _results(rows: Iterable[Row]) -> list[Result]:
    return [of_row({k: v for k, v in row.items() if k != "member"}) for row in rows]


def table_of(rows: Sequence[Row], kinds: Iterable[str]) -> str:
    """Rates, kind by kind, and what does not hold with the seeds."""
    done = _results(rows)
    lines = [
        f"{'kind':<13} {'sets':>5} {'accepted':>9} {'beyond 95 %':>12} {'allowed':>8} "
        f"{'tool moved':>11} {'of it named':>12} {'named':>6} {'no answer':>10} {'excess':>7}"
    ]
    for kind in kinds:
        own = rates(kind, done)
        if own.count:
            lines.append(_line(own))
    for kind in kinds:
        for words, seeds in failures(kind, done).items():
            lines.append(f"{kind}: {words}: {' '.join(map(str, seeds))}")
    return "\n".join(lines)


def _line(own: Rates) -> str:
    return (
        f"{own.kind:<13} {own.count:>5} {own.accepted:>9.2f} {own.beyond_of_accepted:>12.2f} "
        f"{own.allowed:>8.2f} {own.moved:>11} {own.named_of_moved:>12.2f} {own.named:>6.2f} "
        f"{own.no_answer:>10.2f} {own.excess:>7.2f}"
    )


def failures(kind: str, done: Sequence[Result]) -> dict[str, list[int]]:
    """Seeds of what should not be."""
    own = [each for each in done if each.kind == kind]
    found = {
        "accepted, the tool beyond": [e.seed for e in own if e.accepted and e.beyond],
        "moved, not named first": [
            e.seed for e in own if kind != "none" and e.demanded and e.moved and not e.named
        ],
        "no answer": [e.seed for e in own if not e.found],
        "good, but refused": [e.seed for e in own if kind == "none" and not e.accepted],
    }
    return {words: sorted(seeds) for words, seeds in found.items() if seeds}


def _powers(rows: Sequence[Row], kinds: Iterable[str]) -> str:
    """A table in Markdown: how often a blunder of a size is named, and what it did otherwise."""
    lines = [
        "| blunder | size | named | named first | accepted, tool beyond the stated 95 % |",
        "|---|---|---|---|---|",
    ]
    for kind in kinds:
        for grade in GRADES:
            graded = _results(row for row in rows if row["member"][::2] == [kind, grade])
            # Larger than anybody would make: the size is not the one asked for.
            own = [each for each in graded if math.isfinite(each.factor)]
            if own:
                wrong = share(each.accepted and each.beyond for each in own)
                shares = [share(e.mentioned for e in own), share(e.named for e in own), wrong]
                cells = " | ".join(f"{100 * each:.0f} %" for each in shares)
                lines.append(f"| {kind} | {grade:g} | {cells} |")
    return "\n".join(lines)


def _ends(rows: Sequence[Row], kinds: Iterable[str]) -> str:
    """How refused sets end when their advice is followed."""
    lines = []
    for kind in kinds:
        ends = Counter(r["end"] for r in rows if r["member"][0] == kind and "end" in r)
        if ends:
            good = share(end in GOOD_ENDS for end in ends.elements())
            lines.append(f"{kind:<13} {ends.total():>4} refused, {good:.2f} end well: {dict(ends)}")
    return "\n".join(lines)


def _uses(rows: Sequence[Row], kinds: Iterable[str]) -> str:
    """How often the corrected machine is within the headline, by each way to command it."""
    ways = dict.fromkeys(way for row in rows for way in row if way != "member")
    lines = []
    for way in ways:
        ratios = [float(row[way]) for row in rows if way in row and row["member"][0] in kinds]
        within = share(ratio <= 1.0 for ratio in ratios)
        lines.append(f"{way:<11} {len(ratios):>4} sets, within the headline in {within:.3f}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
