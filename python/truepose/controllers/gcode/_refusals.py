"""What a program asks that the machine, or its correction, cannot do: as problems of its lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from truepose.controllers.gcode._axes import AXES, MILLIMETRE, Axes
from truepose.controllers.gcode.division import TOO_MANY, TOO_SHORT, CannotCorrect, Limits, Moves
from truepose.controllers.gcode.proof import Proof, sizes
from truepose.errors import Problem, RequestError
from truepose.files.limits import LONGEST_MOVE, MOST_PIECES
from truepose.machine import Machine
from truepose.runs.poses import faults_text

_EXPECTED = "a pose that the machine can be commanded to, all along the move"


def of_move(
    failure: CannotCorrect, machine: Machine, axes: Axes, limits: Limits, moves: Moves, file: Path
) -> RequestError:
    """The refusal of a move of a batch."""
    line = int(moves.line[failure.move])
    at = axes.in_words(failure.pose)
    if failure.status == TOO_SHORT:
        if np.isfinite(failure.off):
            found = f"{machine.shown.small_length.text(failure.off)} off"
        else:
            found = "a way between two blocks that leaves what the machine can be commanded to,"
        return _refusal(
            "gcode-tolerance",
            "this move cannot be divided so that the tool stays on its path",
            file,
            line,
            found=f"{found} in a piece of less than "
            f"{machine.shown.length.text(2.0 * limits.least)}, near {at}",
            expected=f"within {machine.shown.small_length.text(limits.chord)}",
            hint="allow more with --tolerance; a jump like that is what play makes where the load "
            "of a drive or strut changes its sign",
        )
    if failure.status == TOO_MANY:
        return _refusal(
            "gcode-tolerance",
            "this move, with those round it, would become more blocks than are written",
            file,
            line,
            found=f"the program is off by {machine.shown.small_length.text(failure.off)} near {at}",
            expected=f"at most {MOST_PIECES:,} pieces of the moves that are divided together",
            hint="allow more with --tolerance, or give the move in parts",
        )
    return of_unusable(failure, machine, axes, moves, file)


def of_unusable(
    failure: CannotCorrect, machine: Machine, axes: Axes, moves: Moves, file: Path
) -> RequestError:
    """The refusal of a move that has a pose on it which the machine cannot be commanded to."""
    line = int(moves.line[failure.move])
    at = axes.in_words(failure.pose)
    why = faults_text(machine, machine.kernel.explain(failure.pose))
    status = failure.status.replace("_", " ")
    if failure.status in ("singular", "branch_lost"):
        return _refusal(
            "gcode-singularity",
            "this move leads onto or through a singularity",
            file,
            line,
            found=f"{at}: {why or 'the platform would not arrive there'}",
            expected="a way on which the struts hold the platform everywhere",
            hint="go round it, or turn the workpiece; `truepose check` looks at the workspace",
        )
    what = "onto or over a pose" if failure.of_program else "to a corrected pose"
    return _refusal(
        "gcode-pose",
        f"this move leads {what} that the machine cannot be commanded to",
        file,
        line,
        found=f"{at}: {status}" + (f", {why}" if why else ""),
        expected=_EXPECTED,
        hint="look at the offset of the workpiece (--offset) and at the units"
        if failure.of_program
        else "what lies on the way counts too; leave some travel for the correction",
    )


def of_uncommanded_axis(axes: Axes, moves: Moves, file: Path) -> RequestError | None:
    """The refusal of the first move on an axis that nobody can command; None: there is none."""
    if not axes.uncommanded.size:
        return None
    columns = axes.uncommanded
    moved = moves.start[:, columns] != moves.end[:, columns]
    both = np.isnan(moves.start[:, columns]) & np.isnan(moves.end[:, columns])
    places = np.argwhere(moved & ~both)
    if not places.size:
        return None
    move, column = places[0]
    letter = AXES[columns[column]]
    return _refusal(
        "gcode-axis",
        f"the platform moves in {letter}, but not as one asks it to",
        file,
        int(moves.line[move]),
        found=f"a move of {letter}",
        expected=f"moves of {', '.join(axes.names)} and of axes that are not the platform's",
        hint="what the platform does besides follows from its pose; take the word out",
    )


def of_long_move(machine: Machine, moves: Moves, file: Path) -> RequestError | None:
    """The refusal of the first move whose path is longer than is looked at; None: there is none."""
    longest = LONGEST_MOVE * machine.characteristic_length
    places = np.flatnonzero(moves.length * MILLIMETRE > longest)
    if not places.size:
        return None
    length = float(moves.length[places[0]]) * MILLIMETRE
    return _refusal(
        "gcode-division",
        "the path of this move is longer than any that is divided",
        file,
        int(moves.line[places[0]]),
        found=machine.shown.length.text(length),
        expected=f"at most {machine.shown.length.text(longest)}, {LONGEST_MOVE:,} times the "
        "characteristic length of the machine",
        hint="look at the centre of the arc and at its number of turns (P)",
    )


def of_tolerance(machine: Machine, tolerance: float, least: float, digits: int) -> RequestError:
    """The refusal of a tolerance, m, that the rounding of what is written exceeds by itself."""
    shown = machine.shown.small_length
    return RequestError(
        Problem(
            "bad-correction",
            f"no program of {digits} digits keeps this tolerance: its rounding is larger",
            found=f"{tolerance:g} m",
            expected=f"at least {shown.text(least)}",
            hint="allow more with --tolerance, or give more --digits",
        )
    )


def of_proof(machine: Machine, proof: Proof, worst: float, line: int) -> RequestError:
    """The refusal of a corrected program that does not keep what it should."""
    shown = machine.shown.small_length
    return _refusal(
        "gcode-proof",
        "the corrected program, read back, does not keep the tolerance; it is not written",
        Path(proof.source),
        line,
        found=shown.text(worst),
        expected=f"at most {shown.text(proof.tolerance)}",
        hint="give more --digits, or allow more with --tolerance",
    )


class NoBetter(RequestError):  # noqa: N818 - a no with its reason
    """A corrected program that is no better than the program was, with its `proof`."""

    def __init__(self, machine: Machine, proof: Proof) -> None:
        length, shown = machine.characteristic_length, machine.shown.small_length
        pairs = (
            (kind, old, new)
            for kind, old, new in zip(
                ("position", "orientation"),
                sizes(proof.before, length),
                sizes(proof.after, length),
                strict=True,
            )
            if old is not None and new is not None
        )
        kind, old, new = max(pairs, key=lambda pair: pair[2] - pair[1])
        where = f", {kind} times the characteristic length" if kind == "orientation" else ""
        super().__init__(
            Problem(
                "gcode-no-better",
                "the corrected program is no better than the program; it is not written",
                file=proof.source,
                found=f"{shown.text(new)} after, {shown.text(old)} before{where}",
                expected="a smaller error after than before",
                hint="give a smaller --tolerance or more --digits; --force writes it all the same",
            )
        )
        self.proof = proof


def _refusal(
    code: str, message: str, file: Path, line: int, *, found: str, expected: str, hint: str
) -> RequestError:
    return RequestError(
        Problem(code, message, file=str(file), line=line, found=found, expected=expected, hint=hint)
    )


def of_start(machine: Machine, axes: Axes, failure: CannotCorrect) -> RequestError:
    """The refusal of a start at which the machine cannot be."""
    because = faults_text(machine, machine.kernel.explain(failure.pose))
    why = failure.status.replace("_", " ") + (f", {because}" if because else "")
    return RequestError(
        Problem(
            "gcode-start",
            "the machine cannot be where the program is said to start",
            found=f"{axes.in_words(failure.pose)}: {why}",
            expected=_EXPECTED,
            hint="say where it stands: --start x=..,y=.., in machine coordinates",
        )
    )


__all__ = [
    "NoBetter",
    "of_long_move",
    "of_move",
    "of_proof",
    "of_start",
    "of_tolerance",
    "of_uncommanded_axis",
    "of_unusable",
]
