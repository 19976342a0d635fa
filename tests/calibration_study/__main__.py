"""The study's command line; see `calibration_study`."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from rich.console import Console
from rich.progress import track

from calibration_study.blunders import FACTORS, KINDS
from calibration_study.study import Rates, Result, as_row, drawn_set, of_row, rates, result_of

Member = tuple[str, int]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, or show what was run; 0."""
    options = _parser().parse_args(arguments)
    if options.command == "run":
        _run(options.output, options.kinds, options.count, options.seed, options.jobs,
             tuple(options.factors))  # fmt: skip
    done = _read(options.output)
    print(table_of(done, options.kinds))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="calibration_study")
    commands = parser.add_subparsers(dest="command", required=True)
    for name, words in (
        ("run", "draw sets, calibrate and judge them; goes on where a file of results ends"),
        ("table", "show what a file of results says"),
    ):
        command = commands.add_parser(name, help=words)
        command.add_argument("--output", type=Path, required=True, help="lines of JSON, one a set")
        command.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
        if name == "run":
            command.add_argument("--count", type=int, default=150, help="sets of each kind")
            command.add_argument("--seed", type=int, default=0, help="of the first set")
            command.add_argument("--jobs", type=int, default=1)
            command.add_argument(
                "--factors", type=float, nargs=2, default=FACTORS, metavar=("FROM", "TO"),
                help="sizes of graded blunders, in those that are detected in 99 %%",
            )  # fmt: skip
    return parser


def _run(
    output: Path,
    kinds: Iterable[str],
    count: int,
    seed: int,
    jobs: int,
    factors: tuple[float, float],
) -> None:
    done = {(each.kind, each.seed) for each in _read(output)}
    members = [(k, s) for k in kinds for s in range(seed, seed + count) if (k, s) not in done]
    output.parent.mkdir(parents=True, exist_ok=True)
    console = Console(stderr=True)
    with tempfile.TemporaryDirectory() as folder, output.open("a", encoding="utf-8") as file:
        work = partial(_of_member, folder=Path(folder), factors=factors)
        every = track(_made(work, members, jobs), "sets", len(members), console=console)
        for result in every:
            file.write(json.dumps(as_row(result)) + "\n")
            file.flush()


def _made(work: partial[Result], members: Sequence[Member], jobs: int) -> Iterator[Result]:
    if jobs == 1:
        yield from map(work, members)
        return
    with get_context("spawn").Pool(jobs) as pool:
        yield from pool.imap_unordered(work, members)


def _of_member(member: Member, folder: Path, factors: tuple[float, float]) -> Result:
    return result_of(drawn_set(*member, folder, factors))


def _read(path: Path) -> list[Result]:
    if not path.exists():
        return []
    lines = path.read_text(encoding="utf-8").splitlines()
    return [of_row(json.loads(line)) for line in lines if line]


def table_of(done: Sequence[Result], kinds: Iterable[str]) -> str:
    """Rates, kind by kind, and what does not hold with the seeds."""
    lines = [
        f"{'kind':<13} {'sets':>5} {'accepted':>9} {'beyond 95 %':>12} {'allowed':>8} "
        f"{'tool moved':>11} {'of it named':>12} {'named':>6} {'no answer':>10}"
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
        f"{own.no_answer:>10.2f}"
    )


def failures(kind: str, done: Sequence[Result]) -> dict[str, list[int]]:
    """Seeds of what should not be."""
    own = [each for each in done if each.kind == kind]
    found = {
        "accepted, the tool beyond": [e.seed for e in own if e.accepted and e.moved],
        "moved, not named first": [
            e.seed for e in own if kind != "none" and e.moved and not e.named
        ],
        "no answer": [e.seed for e in own if not e.found],
        "good, but refused": [e.seed for e in own if kind == "none" and not e.accepted],
    }
    return {words: sorted(seeds) for words, seeds in found.items() if seeds}


if __name__ == "__main__":
    sys.exit(main())
