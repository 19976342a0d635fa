"""Programs run through LinuxCNC's interpreter and ours, and their moves compared."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from system_package import missing
from truepose import _kernel

AXES = "XYZABCUVW"
LETTERS = "XYZABCUVWR"
SYSTEMS = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")
SYSTEM_PYTHON = Path("/usr/bin/python3")
SCRIPT = Path(__file__).with_name("linuxcnc_moves.py")
NONE = (0.0,) * 9
LINE, PLANE, FEED, END, CENTRE, TURNS, WIDTH = 0, 1, 2, slice(3, 12), slice(12, 14), 14, 15

Offsets = Mapping[str, Sequence[float]]
Moves = NDArray[np.float64]


@dataclass(frozen=True)
class Outcome:
    """A program's moves, rows as `linuxcnc_moves.py` has them, and what stopped it."""

    moves: Moves
    error: str | None


def require() -> None:
    """Skip the test where LinuxCNC is not installed."""
    found = (
        SYSTEM_PYTHON.exists()
        and not subprocess.run(
            [SYSTEM_PYTHON, "-c", "import gcode"], capture_output=True
        ).returncode
    )
    if not found:
        missing("LinuxCNC's interpreter is not installed (Debian: linuxcnc-uspace)")


def parameters(offsets: Offsets) -> str:
    """The offsets, and a tenth number, the rotation, as LinuxCNC keeps them; lengths in inches."""
    lines = []
    for system, name in enumerate(SYSTEMS):
        for axis, value in enumerate(offsets.get(name, ())):
            inches = value if LETTERS[axis] in "ABCR" else value / 25.4
            lines.append(f"{5221 + 20 * system + axis}\t{inches!r}\n")
    return "".join(lines)


CRASHED = "the interpreter crashed"


def theirs(
    paths: Sequence[Path], folder: Path, offsets: Offsets, workers: int = 2
) -> list[Outcome]:
    """What LinuxCNC makes of the programs, started with G21 at the origin of G54.

    A program that its interpreter crashes on has the error `CRASHED`.
    """
    stored = folder / "parameters"
    stored.write_text(parameters(offsets), encoding="ascii")
    shares = [paths[worker::workers] for worker in range(workers)]
    with ThreadPoolExecutor(workers) as pool:
        answers = list(pool.map(lambda share: _share(share, stored), shares))
    outcomes: list[Outcome] = []
    for place in range(len(paths)):
        outcomes.append(answers[place % workers][place // workers])
    return outcomes


def _share(paths: Sequence[Path], stored: Path) -> list[Outcome]:
    """The same for some of the programs, in one process as long as that lives."""
    outcomes: list[Outcome] = []
    while len(outcomes) < len(paths):
        left = paths[len(outcomes) :]
        process = subprocess.run(
            [SYSTEM_PYTHON, SCRIPT, stored],
            input="".join(f"{path}\n" for path in left).encode(),
            capture_output=True,
        )
        lines = process.stderr.decode(errors="replace").splitlines()
        assert process.returncode <= 0, lines[-20:]
        messages = dict(line.split(": ", 1) for line in lines if ": " in line)
        numbers = np.frombuffer(process.stdout)
        place = 0
        for path in left:
            if place == len(numbers):
                break
            count, failed = int(numbers[place]), bool(numbers[place + 1])
            rows = numbers[place + 2 : place + 2 + count * WIDTH].reshape(count, WIDTH)
            place += 2 + count * WIDTH
            outcomes.append(Outcome(rows, messages.get(str(path), "refused") if failed else None))
        if process.returncode and len(outcomes) < len(paths):
            outcomes.append(Outcome(np.zeros((0, WIDTH)), CRASHED))
    return outcomes


def ours(path: Path, offsets: Offsets, units: str | None = None) -> Outcome:
    """What our interpreter makes of a program started at the origin of G54."""
    reader = _kernel.GcodeReader(
        path,
        units=units,
        start=dict(zip(AXES, offsets.get("G54", (0.0,) * 9), strict=False)),
        offsets={
            name: dict(zip(LETTERS, offsets.get(name, NONE), strict=False)) for name in SYSTEMS
        },
        reference={name: dict.fromkeys(AXES, 0.0) for name in ("G28", "G30")},
        block_delete=False,
        axes=AXES,
    )
    error, blocks = None, []
    while error is None:
        try:
            moves = reader.read(1000)
        except _kernel.GcodeError as problem:
            # What was read together with the refused block is read again, one by one.
            error = f"{problem.line}:{problem.column} {problem.code}: {problem.message}"
            break
        if not len(moves):
            break
        centre = np.nan_to_num(moves.centre)
        rows = [moves.line, moves.plane, moves.kind > 0, moves.end, centre, moves.turns]
        blocks.append(np.column_stack(rows))
    return Outcome(np.concatenate(blocks) if blocks else np.zeros((0, WIDTH)), error)


_COMMENT = re.compile(r"\([^()]*\)|;.*")
_REFERENCE = re.compile(r"G0*(28|30)(?![\d.])(.*)")


def without_references(text: str, moves: Moves) -> Moves:
    """LinuxCNC's moves without those that G28 and G30 end in.

    Our interpreter gives the way to the intermediate point only.
    """
    keep = np.ones(len(moves), dtype=bool)
    if "28" in text or "30" in text:
        for number, line in enumerate(text.split("\n"), start=1):
            words = re.sub(r"[ \t\r]", "", _COMMENT.sub("", line)).upper()
            if _REFERENCE.search(words):
                at = np.flatnonzero(moves[:, LINE] == number)
                keep[at[-1:] if re.search("[XYZABCUVW]", words) else at] = False
    return moves[keep]


def without_standstill(moves: Moves, start: Sequence[float]) -> Moves:
    """Moves without straight ones that lead nowhere: LinuxCNC makes one of a bare G0 or G1."""
    before = np.vstack([np.asarray(start)[None], moves[:, END]])[:-1]
    still = (np.abs(moves[:, END] - before) < 1e-9).all(axis=1) & (moves[:, PLANE] == 0)
    return moves[~still]


def difference(text: str, mine: Moves, reference: Moves, offsets: Offsets) -> str | None:
    """What differs between our moves and LinuxCNC's by more than 1e-9 mm; None if nothing does."""
    start = offsets.get("G54", NONE)[:9]
    mine = without_standstill(mine, start)
    reference = without_standstill(without_references(text, reference), start)
    if len(mine) != len(reference):
        return f"{len(mine)} moves instead of {len(reference)}"
    off = np.abs(mine - reference) > 1e-9
    if off.any():
        row, column = np.argwhere(off)[0]
        return f"row {row}, column {column}:\n{mine[row]}\n{reference[row]}"
    return None
