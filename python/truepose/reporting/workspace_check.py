"""Which poses of the workspace the machine can use, and why not the others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from truepose.arrays import Codes, Flags, Floats
from truepose.reporting.display import number, pose_text, where_highest
from truepose.reporting.result import in_file_units, pose_in_file_units
from truepose.reporting.table import Table
from truepose.reporting.tables import MOST_LISTED
from truepose.runs.poses import OK

if TYPE_CHECKING:
    from truepose.files.shown_units import ShownUnits
    from truepose.machine import Machine

EXPLAINED = 2000
"""Poses left out that are looked into; where more are, evenly spaced ones."""


@dataclass(frozen=True)
class SkipReason:
    """One cause for leaving poses out: which part, in how many poses, at most by how much.

    `amount` in m for a strut, m or rad for a travel, rad for a strut that leans at its base_joint
    or platform_joint, a ratio for a singularity. It is negative where a strut would have to be
    shorter, or a joint coordinate is below its travel.
    """

    what: str
    name: str
    count: int
    amount: float
    unit: str

    def text(self, units: ShownUnits) -> str:
        """The cause for people."""
        if self.what == "singular":
            return f"singular: conditioning down to {self.amount:.2g}"
        unit = units.of(self.unit)
        by = f"{number(abs(self.amount) * unit.per_si, 3)} {unit.label}"
        if self.what == "travel":
            side = "below" if self.amount < 0.0 else "above"
            return f"drive {self.name}: up to {by} {side} its travel"
        if self.what in ("base_joint", "platform_joint"):
            joint = self.what.replace("_", " ")
            return f"strut {self.name}: leans up to {by} beyond the limit of its {joint}"
        side = "near" if self.amount < 0.0 else "far"
        return f"strut {self.name}: up to {by} too {side} to reach"


@dataclass(frozen=True)
class WorkspaceCheck:
    """What became of the poses of a workspace.

    `codes` (n_pose,): kernel status, `status` (n_pose,) the same by name. `worst_conditioning` of
    the usable poses (smallest over largest scaled singular value: 1 best, 0 singular) and the pose
    where it is, SI; NaN where no pose is usable.
    """

    poses: Floats
    codes: Codes
    status: NDArray[np.str_]
    reasons: tuple[SkipReason, ...]
    worst_conditioning: float
    worst_pose: Floats

    @property
    def usable(self) -> Flags:
        """(n_pose,) whether a pose can be used."""
        return np.asarray(self.status == "ok")


def check_workspace(machine: Machine) -> WorkspaceCheck:
    """Try every pose of the machine's workspace."""
    from truepose._kernel import STATUS

    poses = machine.poses()
    _, codes = machine.inverse(poses, status=True)
    conditioning, solved = machine.conditioning(poses, status=True)
    codes = np.where(codes == OK, solved, codes)
    usable = codes == OK
    worst = where_highest(-np.where(usable, conditioning, np.inf)) if usable.any() else 0
    return WorkspaceCheck(
        poses,
        codes,
        np.array(STATUS)[codes],
        _reasons(machine, poses[~usable]),
        float(conditioning[worst]) if usable.any() else float("nan"),
        poses[worst],
    )


def _reasons(machine: Machine, poses: Floats) -> tuple[SkipReason, ...]:
    """Causes by part and side, the one that stops most poses first."""
    by_cause: dict[tuple[str, str, str, bool], list[float]] = {}
    for pose in poses[:: max(1, -(-len(poses) // EXPLAINED))]:
        for cause in machine.kernel.explain(pose):
            amount = float(cause["amount"])
            what, name, unit = (str(cause[key]) for key in ("what", "name", "unit"))
            by_cause.setdefault((what, name, unit, amount < 0.0), []).append(amount)
    reasons = [
        SkipReason(
            what,
            name,
            len(amounts),
            min(amounts) if what == "singular" else max(amounts, key=abs),
            unit,
        )
        for (what, name, unit, _), amounts in by_cause.items()
    ]
    return tuple(sorted(reasons, key=lambda reason: -reason.count))


def table(machine: Machine, check: WorkspaceCheck) -> Table:
    """The workspace for people."""
    usable = int(check.usable.sum())
    rows = [("poses", f"{len(check.poses):,}"), ("usable", f"{usable:,}")]
    names, counts = np.unique(check.status[~check.usable], return_counts=True)
    rows += [
        (str(name).replace("_", " "), f"{count:,}")
        for name, count in zip(names, counts, strict=True)
    ]
    rows += [("because", reason.text(machine.shown)) for reason in check.reasons[:MOST_LISTED]]
    if usable:
        where = pose_text(check.worst_pose, machine.commanded, machine.shown)
        rows.append(("worst conditioning", f"{check.worst_conditioning:.3g} at {where}"))
    return Table(
        "workspace",
        "Workspace",
        ("", ""),
        tuple(rows),
        words=2,
        note="Conditioning: smallest over largest scaled singular value, 1 is best, 0 is singular.",
    )


def as_data(machine: Machine, check: WorkspaceCheck) -> dict[str, Any]:
    """The workspace for programs, in the units of the machine's file."""
    names, counts = np.unique(check.status, return_counts=True)
    reasons = []
    for reason in check.reasons:
        amount, units = in_file_units(machine, reason.amount, reason.unit)
        reasons.append({**vars(reason), "amount": amount, "unit": units})
    worst = dict(zip(machine.commanded, check.worst_pose.tolist(), strict=True))
    pose = pose_in_file_units(machine, worst)
    return {
        "poses": len(check.poses),
        "status": dict(zip(map(str, names), map(int, counts), strict=True)),
        "reasons": reasons,
        "worst_conditioning": check.worst_conditioning if check.usable.any() else None,
        "worst_pose": pose if check.usable.any() else None,
    }
