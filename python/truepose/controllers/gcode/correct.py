"""Corrected programs: G-code whose poses take the actual machine where the program asks it to be.

The program is read, divided and written batch by batch, and what was written is read back by a
second interpreter and driven through the actual machine at once, so that a program of any size
takes little memory and none is handed over without its proof.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import cast, get_args

import numpy as np

from truepose._kernel import GcodeCorrector, GcodeError, threads
from truepose.compensation.commands import ActualMachine
from truepose.controllers.gcode import _refusals
from truepose.controllers.gcode._axes import AXES, Axes
from truepose.controllers.gcode.division import (
    CannotCorrect,
    Divided,
    Division,
    Interpolation,
    Limits,
    MachineState,
    Moves,
)
from truepose.controllers.gcode.exact_stops import (
    ACCELERATION,
    CountedStops,
    ExactStops,
    is_blending,
)
from truepose.controllers.gcode.program import (
    BATCH,
    PROGRAM,
    ProgramOptions,
    ProgramReading,
    bad_option,
    moves_of,
    problems_of,
)
from truepose.controllers.gcode.proof import Errors, Proof, Proving, improves
from truepose.controllers.gcode.tolerance import (
    MOST,
    PathTolerance,
    least_of,
    rounding_of,
    tolerance_for,
)
from truepose.controllers.gcode.work_offsets import Positions
from truepose.errors import Problem, RequestError
from truepose.files.text_file import on_disk, require_input
from truepose.files.wording import one_of
from truepose.files.writing import replacing, require_writable
from truepose.machine import Condition, Machine
from truepose.runs.arguments import checked
from truepose.runs.controller_geometry import (
    ROUNDING,
    nothing_to_correct,
    require_known_controller,
)
from truepose.runs.poses import required_sources

LOOKED_THROUGH = 1 << 15
"""Moves of a program from which the tolerance follows: reading a long one twice takes its time.

Later moves may be off by more, which makes the tolerance smaller than it need be.
"""

LEAST_PIECE = 1e-5
"""m: the shortest piece into which a move is divided."""

LONGEST_NAME = 40
"""Characters of the machine's name in a comment."""

TURN = 5e-4
"""s: the longest that a thread waits for its turn while both divide and prove."""

DIGITS = 6
"""Decimals of mm and degrees; inches have one more."""

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class _Options:
    """What was asked, checked.

    `tolerance`, m; None: it follows from the error before. `opened`: the file that the program is
    read from, which is another one than it is called where it comes from standard input.
    """

    tolerance: float | None
    interpolation: Interpolation
    digits: int
    reading: ProgramReading
    path_mode: str | None
    acceleration: float
    opened: Path = Path()

    def limits(self, tolerance: float) -> Limits:
        """What the division must hold."""
        return Limits(tolerance, min(LEAST_PIECE, tolerance), self.interpolation)

    def corrector(self, target: Path, machine: str) -> GcodeCorrector:
        """What reads a program and writes it anew, for a machine of this name."""
        name = "".join(c for c in machine if c.isascii() and c.isprintable() and c not in "()%")
        return GcodeCorrector(
            self.opened,
            target,
            **self.reading.arguments(),
            digits=self.digits,
            path_mode=self.path_mode,
            heading=f"truepose for {name[:LONGEST_NAME].strip()}: {self.reading.offsets.words}",
        )


@checked
def correct_program(
    machine: Machine,
    source: str | PathLike[str],
    target: str | PathLike[str] | None,
    condition: Condition | None = None,
    *,
    tolerance: float | None = None,
    interpolation: str = "either",
    units: str | None = None,
    start: Positions | None = None,
    offsets: Mapping[str, Positions] | None = None,
    parameter_file: str | PathLike[str] | None = None,
    block_delete: bool | None = None,
    digits: int = DIGITS,
    path_mode: str | None = None,
    acceleration: float = ACCELERATION,
    force: bool = False,
    progress: Progress | None = None,
) -> Proof:
    """Write the program `source` anew, corrected for the machine in `condition`, as `target`.

    `tolerance`, m: how far the tool may be off the programmed path; an angle counts times the
    characteristic length. Default: a share of the error before, as `Proof.tolerance_from` says,
    at most 5 µm. `interpolation`: "pose" where the controller solves its nominal inverse all along
    a block, "either" where it may also drive its joints straight to the block's end. `units`: "mm"
    or "inch" before G20 or G21. `start`: where the machine stands at first, by axis, m and rad,
    machine coordinates; default home. `block_delete`: whether lines that begin with / are left out.
    `digits`: decimals of mm and degrees. `path_mode`, such as "G64 P0.002", in the program's units:
    how pieces of a block are joined that ends in an exact stop (G61, G61.1). `acceleration`, m/s^2,
    of the tool: for the time that exact stops take, see `ExactStops`. `force`: write even what is
    no better than the program was. `target` None: nothing is written, only proven. `progress` is
    called with lines done, and 0 for their unknown number in all.

    `offsets` of "G54" to "G59.3", by axis, m and rad, with r, the rotation about Z;
    `parameter_file`: LinuxCNC's, which has them all. A program that selects one that is not known
    is refused (gcode-no-offset); one that selects none is taken in machine coordinates, or in the
    system that is active in the parameter file.

    What was written is read back and proven before it gets its name: see `Proof`. Raises
    `NoBetter`, a `RequestError` with that proof, where the error after is not less than the one
    before (gcode-no-better); nothing is written then. Raises `RequestError`: the program's problems
    with file, line and column (gcode-...), bad-correction for an option, no-source,
    output-not-writable, output-is-input; controller-unsaid, controller-contradicted for a
    calibrated file of which it is not known with which geometry its controller works;
    `TrueposeError` as `truepose.budget`.
    """
    require_known_controller(machine)
    program, written = Path(source), None if target is None else Path(target)
    parameters = None if parameter_file is None else Path(parameter_file)
    axes = Axes(machine)
    options = _options(
        axes,
        ProgramOptions(units, start, offsets, parameters, block_delete),
        tolerance,
        interpolation,
        digits,
        path_mode,
        acceleration,
    )
    _require_files(program, written, parameters)
    given = machine.condition if condition is None else condition
    required_sources(machine, given)
    actual = ActualMachine(machine, given)
    with on_disk(program) as opened, problems_of(program):
        options = replace(options, opened=opened)
        allowed = _tolerance(actual, axes, options)
        division = Division(actual, axes, options.limits(allowed.value))
        with _written(written) as temporary:
            session = _Session(division, program, temporary, options, allowed)
            proof = session.run("" if written is None else str(written), progress)
            if not (proof.improves or force):
                raise _refusals.NoBetter(machine, proof)
            return proof


def _tolerance(actual: ActualMachine, axes: Axes, options: _Options) -> PathTolerance:
    """The tolerance that was asked for, or the one that follows from the error before."""
    if options.tolerance is not None:
        division = Division(actual, axes, options.limits(options.tolerance))
        least = rounding_of(division, options.digits)
        if options.tolerance < least:
            raise _refusals.of_tolerance(actual.machine, options.tolerance, least, options.digits)
        return PathTolerance(options.tolerance, "asked")
    reader = options.reading.reader(options.opened)

    def batches() -> Iterator[Moves]:
        # What cannot be read is refused in the order of lines where the program is corrected.
        with suppress(GcodeError):
            left = LOOKED_THROUGH
            while left > 0 and (moves := moves_of(reader.read(min(BATCH, left)))):
                left -= len(moves.line)
                yield moves

    return tolerance_for(Division(actual, axes, options.limits(MOST)), batches(), options.digits)


class _Session:
    """One program on its way through division, writing and proof."""

    def __init__(
        self,
        division: Division,
        program: Path,
        temporary: Path,
        options: _Options,
        allowed: PathTolerance,
    ) -> None:
        self._division = division
        self._program = program
        self._options = options
        self._allowed = allowed
        self._reader = options.reading.reader(options.opened)
        self._writing = _Writing(division, temporary, options)
        length = division.actual.machine.characteristic_length
        self._stops = CountedStops(
            options.acceleration,
            options.acceleration / length,
            blended=options.path_mode is not None,
        )

    def run(self, target: str, progress: Progress | None) -> Proof:
        """Correct the whole program; `target` is what it will be called."""
        stand = self._start()
        count, approach = 0, None
        # While one batch is written and proven, the next is divided, where there are threads.
        with _quick_turns(), ThreadPoolExecutor(max_workers=1) as aside:
            task: Future[None] | None = None
            while moves := moves_of(self._reader.read(BATCH)):
                if approach is None:
                    approach = int(moves.line[0])
                count += len(moves.line)
                divided = self._divide(moves, stand)
                stand = divided.stand
                self._stops.add(moves, divided)
                if task is not None:
                    task.result()
                if threads() > 1:
                    task = aside.submit(self._writing.add, moves, divided)
                else:
                    self._writing.add(moves, divided)
                if progress is not None:
                    progress(self._reader.lines, 0)
            if task is not None:
                task.result()
            self._writing.finish()
        return self._proof(target, count, approach)

    def _start(self) -> MachineState:
        point = np.full(len(AXES), np.nan)
        for letter, value in self._options.reading.start.items():
            point[AXES.index(letter)] = value
        try:
            return self._division.at_start(point)
        except CannotCorrect as failure:
            raise _refusals.of_start(
                self._division.actual.machine, self._division.axes, failure
            ) from None

    def _divide(self, moves: Moves, stand: MachineState) -> Divided:
        division, program = self._division, self._program
        refusal = _refusals.of_uncommanded_axis(
            division.axes, moves, program
        ) or _refusals.of_long_move(division.actual.machine, moves, program)
        if refusal is not None:
            raise refusal
        try:
            return division.divide(moves, stand)
        except CannotCorrect as failure:
            machine = division.actual.machine
            raise _refusals.of_move(
                failure, machine, division.axes, division.limits, moves, program
            ) from None

    def _proof(self, target: str, moves: int, approach: int | None) -> Proof:
        """The proof of what is written; `RequestError` (gcode-proof) if it breaks its promise."""
        machine, limits = self._division.actual.machine, self._division.limits
        proving = self._writing.proving
        before, after = proving.errors()
        length = machine.characteristic_length
        least = least_of(self._division, self._options.digits)
        stops = self._stops.found()
        proof = Proof(
            machine=machine.name,
            source=str(self._program),
            target=target,
            coordinates=self._options.reading.offsets.words,
            commanded=machine.commanded,
            tolerance=limits.chord,
            tolerance_from=self._allowed,
            improves=improves(before, after, length, least),
            interpolation=limits.interpolation,
            start=self._options.reading.start,
            approach=approach,
            moves=moves,
            blocks=proving.blocks,
            points=proving.points,
            before=before,
            after=after,
            warnings=_warnings(machine, before, stops),
            exact_stops=stops,
            path_mode=self._options.path_mode,
        )
        for worst, unit in ((after.position, 1.0), (after.orientation, length)):
            if worst is not None and not worst.value * unit <= limits.chord:
                raise _refusals.of_proof(machine, proof, worst.value * unit, worst.line)
        return proof


def _warnings(machine: Machine, before: Errors, stops: ExactStops) -> tuple[dict[str, str], ...]:
    """What to know of a program that was right before, or that stands still more often now."""
    warnings = []
    known = [worst.value for worst in (before.position, before.orientation) if worst is not None]
    if known and max(known) < ROUNDING:
        warnings.append(nothing_to_correct(machine))
    if stops.after > stops.before:
        warnings.append(stops.warning())
    return tuple(warnings)


class _Writing:
    """Writes divided batches, reads the file back behind that, and proves what it finds."""

    def __init__(self, division: Division, temporary: Path, options: _Options) -> None:
        self.proving = Proving(division)
        self._temporary = temporary
        machine = division.actual.machine.name
        self._corrector = options.corrector(temporary, machine)
        self._back = options.reading.reader(temporary)
        self._waiting: list[tuple[Moves, Divided]] = []

    def add(self, moves: Moves, divided: Divided) -> None:
        """The next moves of the program, as it was divided."""
        size = self._temporary.stat().st_size
        self._write(divided)
        # Written text may wait before it reaches the file, in its order: when the file has grown,
        # all that was written earlier is in it.
        if self._temporary.stat().st_size > size:
            self._prove_waiting()
        self._waiting.append((moves, divided))

    def finish(self) -> None:
        """Write what is left of the program, and prove what is left to prove."""
        self._corrector.finish()
        self._prove_waiting()
        if len(self._back.read(1)):
            raise AssertionError("more was written than the moves of the program")

    def _write(self, divided: Divided) -> None:
        """Write a batch, of which the corrector may read some at a time."""
        until = np.cumsum(divided.counts)
        done = 0
        while done < len(until):
            count = len(self._corrector.read(len(until) - done))
            if not count:
                raise AssertionError("the program has become shorter")
            pieces = slice(until[done - 1] if done else 0, until[done + count - 1])
            self._corrector.write(
                divided.counts[done : done + count], divided.points[pieces], divided.shares[pieces]
            )
            done += count

    def _prove_waiting(self) -> None:
        """Read back, block by block, what was written, and compare."""
        for moves, divided in self._waiting:
            read_back = self._back.read(len(divided.points))
            if len(read_back) != len(divided.points):
                raise AssertionError("fewer blocks can be read back than were written")
            self.proving.add(moves, divided, read_back.start, read_back.end)
        self._waiting.clear()


@contextmanager
def _written(target: Path | None) -> Iterator[Path]:
    """A file that gets the target's name in the end; without a target it is gone then."""
    if target is not None:
        with replacing(target) as temporary:
            yield temporary
        return
    with tempfile.TemporaryDirectory(prefix="truepose-") as folder:
        yield Path(folder) / "corrected.ngc"


@contextmanager
def _quick_turns() -> Iterator[None]:
    """Let two threads of the interpreter take turns ten times as often.

    What one of them asks of the kernel takes less time than it would wait for its turn after it.
    """
    interval = sys.getswitchinterval()
    sys.setswitchinterval(min(interval, TURN))
    try:
        yield
    finally:
        sys.setswitchinterval(interval)


def _require_files(program: Path, written: Path | None, parameters: Path | None) -> None:
    """Refuse what cannot be read or written before any work is done."""
    require_input(program, PROGRAM)
    if written is None:
        return
    inputs = {"the program": program, "the parameter file": parameters}
    for name, file in inputs.items():
        there = file is not None and file.exists() and written.exists()
        if file is not None and there and written.samefile(file):
            raise _file_problem(
                "output-is-input",
                f"the corrected program would write over {name}",
                written,
                f"{name} itself",
                "another file",
            )
    require_writable(written, [written.suffix.lower()])


def _file_problem(
    code: str, message: str, file: Path, found: str, expected: str = "a file of G-code"
) -> RequestError:
    return RequestError(Problem(code, message, file=str(file), found=found, expected=expected))


def _options(
    axes: Axes,
    program: ProgramOptions,
    tolerance: float | None,
    interpolation: str,
    digits: int,
    path_mode: str | None,
    acceleration: float,
) -> _Options:
    """The options in the interpreter's form. Raises `RequestError`, all problems at once."""
    problems: list[Problem] = []

    def refuse(name: str, found: object, expected: str) -> None:
        problems.append(bad_option(name, found, expected))

    if tolerance is not None and not (np.isfinite(tolerance) and tolerance > 0.0):
        refuse("tolerance", tolerance, "a length above zero, m")
    if interpolation not in get_args(Interpolation):
        refuse("interpolation", interpolation, one_of(get_args(Interpolation)))
    if not (isinstance(digits, int) and 0 <= digits <= 8):
        refuse("number of digits", digits, "a whole number from 0 to 8")
    if path_mode is not None and not is_blending(path_mode):
        refuse("path mode", path_mode, "G64 with P above zero, and Q where wanted: G64 P0.002")
    if not (np.isfinite(acceleration) and acceleration > 0.0):
        refuse("acceleration", acceleration, "an acceleration above zero, m/s^2")
    reading = program.reading(axes, refuse)
    if problems:
        raise RequestError(*problems)
    return _Options(
        tolerance,
        cast("Interpolation", interpolation),
        digits,
        reading,
        path_mode,
        acceleration,
    )


__all__ = ["Positions", "correct_program"]
