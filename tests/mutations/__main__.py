"""The command line of the mutations; see the package."""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random

from mutations.grammar import spoilt
from mutations.inputs import KINDS, Kind
from truepose.errors import TrueposeError

SECONDS = 5.0
"""Of a processor that reading one file may take: what else the computer does counts for nothing."""

SECONDS_OF_A_COMMAND = 60.0
"""Likewise with the start of Python and the answer, which is a search for the largest error."""

MEMORY = 500_000_000
"""Bytes that the process may have in all, with what it needs for itself."""

COMMAND = "from truepose.cli import main; main()"


def main(arguments: Sequence[str] | None = None) -> int:
    """Spoil and read; 1 where anything failed."""
    parser = argparse.ArgumentParser(prog="mutations")
    parser.add_argument("--count", type=int, default=2000, help="of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=list(KINDS), action="append")
    parser.add_argument("--command", action="store_true", help="through the command line")
    options = parser.parse_args(arguments)
    failed = False
    for name in options.kind or KINDS:
        begun, answers, slowest = time.perf_counter(), Counter[str](), 0.0
        who = resource.RUSAGE_CHILDREN if options.command else resource.RUSAGE_SELF
        before = resource.getrusage(who).ru_maxrss * 1024
        tries = failures(name, options.count, options.seed, in_command=options.command)
        for number, answer, seconds in tries:
            if not answer.islower():
                print(f"{name} {options.seed} {number}: {answer}", flush=True)
                failed = True
            answers[answer.split("\n", 1)[0][:60]] += 1
            slowest = max(slowest, seconds)
        used = resource.getrusage(who).ru_maxrss * 1024
        taken = time.perf_counter() - begun
        print(
            f"{name}: {sum(answers.values())} in {taken:.0f} s, slowest {slowest:.2f} s, ", end=""
        )
        print(f"{used / 1e6:.0f} MB, {dict(answers)}", flush=True)
        # What the process had needed before, for other things, counts for nothing.
        failed = failed or used > max(MEMORY, before)
    return int(failed)


def failures(
    name: str, count: int, seed: int, *, in_command: bool = False
) -> Iterator[tuple[int, str, float]]:
    """(number, answer, seconds) of `count` spoilt files of a kind.

    The answer is "read" or "refused"; of a failure what it is, with a capital letter.
    """
    kind = KINDS[name]
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        if kind.companion is not None:
            (folder / kind.companion_name).write_text(kind.companion, "utf-8")
        for number in range(count):
            text = mutation(kind, name, seed, number)
            (folder / kind.file).write_text(text, "utf-8", newline="")
            begun = _processor(in_command)
            answer = _of_command(kind, folder) if in_command else _in_process(kind, folder)
            seconds = _processor(in_command) - begun
            if answer.islower() and seconds > (SECONDS_OF_A_COMMAND if in_command else SECONDS):
                answer = f"Slow: {seconds:.1f} s"
            yield number, answer, seconds


def mutation(kind: Kind, name: str, seed: int, number: int) -> str:
    """The spoilt file of this number."""
    numbers = Random(f"{name} {seed} {number}")  # noqa: S311 - nothing secret
    return spoilt(numbers.choice(kind.texts), numbers)


def _processor(of_commands: bool) -> float:
    """Seconds that this process, or all commands that it ran, have computed."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN if of_commands else resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def _in_process(kind: Kind, folder: Path) -> str:
    try:
        kind.read(folder)
    except TrueposeError as refusal:
        str(refusal)
        return "refused"
    except Exception:
        return f"Uncaught: {traceback.format_exc()}"
    except BaseException as failure:
        if type(failure).__name__ != "PanicException":
            raise
        return f"Panic: {failure}"
    return "read"


def _of_command(kind: Kind, folder: Path) -> str:
    words = [word.format(folder=folder) for word in kind.arguments]
    try:
        run = subprocess.run(
            [sys.executable, "-c", COMMAND, *words],
            capture_output=True, text=True, timeout=300, check=False,
            preexec_fn=_with_little_memory,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return "Hangs: more than five minutes"
    if run.returncode in (0, 1) and "Traceback" not in run.stderr:
        return "read"
    if run.returncode == 2 and "Traceback" not in run.stderr:
        return "refused"
    return f"Code {run.returncode}: {run.stderr}"


def _with_little_memory() -> None:
    # Address space, of which libraries take more than they use.
    resource.setrlimit(resource.RLIMIT_AS, (4 * MEMORY, 4 * MEMORY))


if __name__ == "__main__":
    sys.exit(main())
