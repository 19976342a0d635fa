"""A fitted small model as one file: what is left over in comments, then the block to paste."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from truepose.controllers._export import Export
from truepose.controllers._fit import fit, heading
from truepose.controllers._small_model import Printed, SmallModel, stem
from truepose.machine import Machine


class BlockModel(SmallModel, Protocol):
    """A `SmallModel` that is written as one block."""

    def block(self, printed: Printed) -> list[str]:
        """Its lines."""
        ...


def in_one_file(
    machine: Machine,
    model: BlockModel,
    controller: str,
    *,
    ending: str,
    comment: str,
    notes: Sequence[str] = (),
    premises: Sequence[str] = (),
) -> Export:
    """The file `STEM_ENDING`; `comment` begins the lines of the heading and of the notes below it.

    `premises`: under what the numbers mean what is stated, in the file and in the statement.

    Raises `RequestError`: controller-cannot, no-workspace, no-pose-left.
    """
    fitted = fit(machine, model)
    above = (*heading(machine, fitted, controller), *premises, *notes)
    lines = [f"{comment} {line}" for line in above]
    text = "\n".join([*lines, *model.block(fitted.printed), ""])
    return Export({f"{stem(machine)}_{ending}": text}, (*fitted.statement(machine), *premises))


__all__ = ["BlockModel", "in_one_file"]
