"""Whether the numbers of a studio and its page are those of the commands for a saved file."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import truepose as tp
from truepose.reporting.result import in_file_units
from truepose.verdict.answer import Answer

CLOSE = 1e-12
"""m and rad; what the page's quick numbers and the studio's may differ by."""
ROUNDED = 1e-14
"""Of a size, that of printed components may differ by."""


@dataclass(frozen=True)
class OfCommands:
    """What they say of a file: what `truepose budget` prints as JSON, and the verdict."""

    machine: tp.Machine
    budget: Mapping[str, Any]
    verdict: Sequence[Answer]

    @classmethod
    def of(cls, saved: Path) -> OfCommands:
        """Ask them."""
        machine = tp.load(saved)
        arguments = [sys.executable, "-m", "truepose", "budget", str(saved), "--format", "json"]
        ended = subprocess.run(arguments, capture_output=True, text=True, check=False)
        assert ended.returncode == 0, ended.stderr
        return cls(machine, json.loads(ended.stdout), tp.accuracy(machine))


def differences(
    commands: OfCommands, given: Mapping[str, Any], shown: Callable[[str], float | None]
) -> list[str]:
    """What is not as the commands have it.

    `given`: the studio's answers by name; `shown`: the SI number that the page has at a place.
    """
    machine, document = commands.machine, commands.budget
    known, wrong = given["known"], list[str]()

    def same(what: str, ours: Any, theirs: Any) -> None:
        if ours != theirs:
            wrong.append(f"{what}: {ours!r}, not {theirs!r}")

    printed = {name: one["values"] for name, one in document["variables"].items()}
    components = document["coordinates"]["component"]["values"]
    numbers = document["coordinates"]["pose"]["values"]
    (there,) = np.flatnonzero((machine.poses() == known["pose"]).all(axis=1)).tolist()
    at_pose = numbers.index(there) if there in numbers else None
    for column, name in enumerate(components):
        unit = "m" if name in "xyz" else "rad"
        ours = known["error"] and in_file_units(machine, known["error"][column], unit)[0]
        theirs = None if at_pose is None else printed["overall_error"][at_pose][column]
        same(f"known error at the pose, {name}", ours, theirs)
    for at, kind in enumerate(document["coordinates"]["quantity"]["values"]):
        unit = {"position": "m", "orientation": "rad"}[kind]
        columns = [n for n, name in enumerate(components) if (name in "xyz") == (unit == "m")]
        ours = {
            name: in_file_units(machine, known[name][kind]["value"], unit)[0]
            for name in ("highest", "largest")
        }
        highest = max(row[at] for row in printed["linear_maximum"])
        same(f"linear maximum over the workspace, {kind}", ours["highest"], highest)
        sizes = [math.hypot(*(row[n] for n in columns)) for row in printed["overall_error"]]
        if not math.isclose(ours["largest"], max(sizes), rel_tol=ROUNDED):
            same(f"known error over the workspace, {kind}", ours["largest"], max(sizes))
        for place, name in (("linear", "highest"), ("known", "largest")):
            own = known[name][kind]["value"]
            same(f"{name} in the page, {kind}", shown(f"studio.largest.{place}.{kind}"), own)
        quick, slow = shown(f"before.known.{kind}"), shown(f"studio.known.{kind}")
        if quick is None or slow is None or not abs(quick - slow) <= CLOSE:
            same(f"known error in the page, {kind}, quick to the studio's", quick, slow)
    for row, answer in zip(given["verdict"], commands.verdict, strict=True):
        of = f"{answer.state} {answer.quantity}"
        same(f"verdict, {of}", row["answer"], answer.answer)
        for name in ("witness", "linear", "bound"):
            same(f"{name}, {of}", row[name]["value"], getattr(answer, name).value)
    return wrong
