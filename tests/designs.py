"""Machines of the library with costs, for tests of allocations."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import truepose as tp
from build_machine import MACHINES

GRADES = '["2 um", "5 um", "10 um", "20 um", "50 um", "100 um"]'


def row(of: str, tie: str = "feature", bands: str = GRADES, cost: float = 4.0) -> str:
    """A row of tolerances, half widths that cost as 1 / t."""
    return (
        f'[[cost.tolerance]]\nof = "{of}"\nbands = {bands}\nat = "10 um"\ncost = {cost}\n'
        f'tie = "{tie}"\n'
    )


ROWS: dict[str, tuple[str, ...]] = {
    "planar_two_slider": (row("strut.*.length"), row("drive.*.offset")),
    "hexapod": (
        row("drive.*.offset"),
        row("strut.*.base.*", "joint"),
        row("strut.*.platform.*", "joint"),
    ),
    "linear_delta": (row("strut.*.length"), row("drive.*.offset"), row("strut.*.base.*", "kind")),
    "five_bar": (row("strut.*.length"), row("drive.*.origin.*", "joint")),
    "3rrr": (row("strut.*.length"), row("drive.*.origin.*", "joint")),
    "pentapod": (row("drive.*.offset"), row("strut.*.base.*", "joint")),
    "orthoglide": (row("strut.*.length"), row("drive.*.offset")),
}
"""Kind of machine -> rows of what may be chosen."""


def file_with(folder: Path, kind: str, *more: str, rows: Sequence[str] | None = None) -> Path:
    """The library's file of a kind with its rows of costs, or `rows`, and `more` text."""
    path = folder / f"{kind}.toml"
    cost = "".join(ROWS[kind] if rows is None else rows)
    text = (MACHINES / f"{kind}.toml").read_text()
    path.write_text(f'{text}\n[cost]\nunit = "EUR"\n\n{cost}\n{"".join(more)}')
    return path


def unseen(machine: tp.Machine, count: int, seed: int = 7) -> np.ndarray:
    """(count, d) poses of the workspace that no judge has seen."""
    assert machine.workspace is not None
    ends = np.array([(axis.start, axis.stop) for axis in machine.workspace.axes])
    shares = np.random.default_rng(seed).random((count, len(ends)))
    return np.asarray(ends[:, 0] + shares * (ends[:, 1] - ends[:, 0]))


def beyond(machine: tp.Machine, poses: np.ndarray, share: float = 1.0 + 1e-6) -> int:
    """At how many poses a machine exceeds its targets, in its condition and its cases.

    By `truepose.budget`, of the machine as its file has it, and nothing of the allocation.
    """
    count = 0
    for condition in (machine.condition, *machine.cases.values()):
        result = tp.budget(machine, poses, condition)
        largest = result["linear_maximum"].sel(quantity="position").values
        assert machine.accuracy.target is not None
        over = largest > machine.accuracy.target * share
        if machine.accuracy.angle_target is not None and "orientation" in result["quantity"]:
            turned = result["linear_maximum"].sel(quantity="orientation").values
            over |= turned > machine.accuracy.angle_target * share
        count += int(over.sum())
    return count
