"""Tables of a budget's summary, of which no pose is kept but the worst."""

from __future__ import annotations

from typing import TYPE_CHECKING

from truepose.errors import Problem, RequestError
from truepose.language import grouped, say
from truepose.reporting.display import column, pose_text
from truepose.reporting.result_words import word
from truepose.reporting.study import Study
from truepose.reporting.table import Table
from truepose.runs.poses import reason_text

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine


def highest_at(study: Study) -> Table:
    """The largest linear maximum of all sources together, and the pose at which it is."""
    quantities = [str(name) for name in study.budget["quantity"].values]
    highest, poses = study.values("highest_linear_maximum"), study.values("highest_at")
    rows = []
    for name, value, pose in zip(quantities, highest, poses, strict=True):
        unit = study.units.error(name)
        size = f"{column([value * unit.per_si])[0]} {unit.label}"
        rows.append((word(name), size, pose_text(pose, study.machine.commanded, study.units)))
    return Table(
        "highest_at",
        say("Where the error is largest"),
        (say("quantity"), say("linear maximum"), say("pose")),
        tuple(rows),
        words=3,
        note=say(
            "Of {count} poses; the first of them with that error. Nothing is judged by a summary.",
            count=grouped(study.n_pose),
        ),
    )


def left_out_counts(study: Study) -> Table | None:
    """How many poses cannot be used and why; None where all can be used."""
    counts = study.values("left_out_count").tolist()
    if not counts:
        return None
    reasons = [str(name) for name in study.budget["reason"].values]
    return Table(
        "left_out",
        say(
            "Poses left out: {count} of {every}",
            count=grouped(sum(counts)),
            every=grouped(sum(counts) + study.n_pose),
        ),
        (say("status"), say("poses")),
        tuple(
            (reason_text(reason), grouped(count))
            for reason, count in zip(reasons, counts, strict=True)
        ),
        note=say("No result includes them."),
    )


def refuse_left_out(machine: Machine, summary: xr.Dataset) -> None:
    """Raise `RequestError` (unusable-pose) where poses were left out."""
    count = int(summary.attrs["poses_left_out"])
    if count == 0:
        return
    of = zip(summary["reason"].values, summary["left_out_count"].values, strict=True)
    raise RequestError(
        Problem(
            "unusable-pose",
            f"{grouped(count)} of {grouped(count + int(summary.attrs['poses_used']))} poses "
            "cannot be used",
            file=machine.file,
            line=machine.workspace.line if machine.workspace is not None else None,
            found=", ".join(f"{reason_text(str(reason))}: {grouped(n)}" for reason, n in of),
            expected="poses within reach and travel, off singularities",
        )
    )


__all__ = ["highest_at", "left_out_counts", "refuse_left_out"]
