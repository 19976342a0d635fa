"""The tab of other solutions: which joints reach the pose shown, and where else its joints lead."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from truepose._kernel import STATUS
from truepose.errors import Problem, RequestError
from truepose.runs.forward_solutions import STARTS, ForwardSolutions, forward_solutions
from truepose.runs.working_modes import InverseSolutions, inverse_solutions, mode_of_file
from truepose.studio.answers import EDITS, POSE, Question, Value, finite

NAME = "modes"
FOLLOWS = frozenset({EDITS, POSE})

MOST_STARTS = 50_000
"""Of one question: some seconds."""

MOST_TOLD = 40
"""Solutions that are told, the nearest first; of working modes, the file's own first."""


def give(question: Question) -> Iterator[Value]:
    """The joints by working mode, then the poses too to which the commanded ones lead.

    Those of the nominal machine, as `truepose.inverse_solutions` and `truepose.forward_solutions`
    say them. Raises `RequestError` (bad-argument) for a number of starts that is none.
    """
    machine, pose = question.machine, question.pose()
    starts = _starts(question.options.get("starts", STARTS))
    reached = inverse_solutions(machine, pose)
    _, _, codes = machine.kernel.place(pose[np.newaxis])
    told: dict[str, Any] = {
        "pose": pose.tolist(),
        "status": STATUS[codes[0]],
        "dof": list(machine.dof),
        "joints": list(machine.joints),
        "coordinates": [drive.coordinate for drive in machine.drives],
        "has_modes": reached.has_modes,
        **_modes(reached),
    }
    yield told
    if mode_of_file(machine) in reached.working_modes[:1]:
        result = forward_solutions(machine, reached.joints[0], reached.poses[0], starts=starts)
        yield told | {"forward": _solutions(result)}


def _modes(reached: InverseSolutions) -> dict[str, Any]:
    """Each working mode that reaches the pose, and how many are not told or do not reach it."""
    rows = zip(reached.working_modes, reached.joints.tolist(), reached.status, strict=True)
    modes = [{"mode": mode, "joints": joints, "status": status} for mode, joints, status in rows]
    return {
        "modes": modes[:MOST_TOLD],
        "modes_left_out": max(0, len(modes) - MOST_TOLD),
        "modes_unsolved": reached.unsolved,
    }


def _solutions(result: ForwardSolutions) -> dict[str, Any]:
    """The poses with what is known of each, and how they were looked for."""
    rows = []
    for at in range(min(len(result.poses), MOST_TOLD)):
        others = np.delete(result.apart[at], at)
        inside = result.in_workspace
        rows.append(
            {
                "pose": result.poses[at].tolist(),
                "distance": finite(result.apart[at, 0]),
                "nearest": finite(others.min(initial=np.inf)),
                "residual": finite(result.residual[at]),
                "joint_residual": finite(result.joint_residual[at]),
                "mode": result.working_modes[at],
                "status": result.status[at],
                "in_workspace": None if inside is None else bool(inside[at]),
                "reached": int(result.reached[at]),
            }
        )
    return {
        "solutions": rows,
        "apart": result.apart[:MOST_TOLD, :MOST_TOLD].tolist(),
        "left_out": len(result.poses) - len(rows),
        "found": len(result.poses),
        "starts": result.starts,
        "converged": result.converged,
        "seed": result.seed,
    }


def _starts(value: Any) -> int:
    if isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= MOST_STARTS:
        return value
    raise RequestError(
        Problem(
            "bad-argument",
            "starts: this is no number of starts",
            found=str(value)[:80],
            expected=f"a whole number from 1 to {MOST_STARTS}",
        )
    )


__all__ = ["FOLLOWS", "NAME", "give"]
