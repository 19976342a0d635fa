"""Whether a machine changed between two files of it: `truepose compare`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from truepose.machine import Machine
from truepose.reporting import calibrated_files
from truepose.representation import Facts, Represented
from truepose.runs.arguments import checked

if TYPE_CHECKING:
    import xarray as xr

    from truepose.reporting.table import Table


@dataclass(frozen=True, eq=False, repr=False)
class MachineComparison(Represented):
    """Two machine files of one machine, compared. As text it reads as the command prints it.

    `dataset`, SI: parameter by parameter, and at the tool, at each pose of the workspace of `old`.
    """

    old: Machine
    new: Machine
    dataset: xr.Dataset

    @property
    def changed(self) -> bool:
        """Whether it changed beyond what both files say of their uncertainty."""
        return bool(self.dataset.attrs["changed"])

    @property
    def verdict(self) -> str:
        """The answer as a sentence."""
        return str(self.dataset.attrs["verdict"])

    @property
    def tables(self) -> list[Table]:
        """Where the two files come from, what differs of the parameters, and at the tool."""
        return calibrated_files.tables(self.dataset, self.old.shown)

    def __str__(self) -> str:
        from truepose.reporting import terminal

        return terminal.tables_text(self.tables) + self.verdict

    def _facts(self) -> Facts:
        yield "old", self.old.file or self.old.name
        yield "new", self.new.file or self.new.name
        yield "changed", self.changed
        yield "verdict", self.verdict

    def _repr_html_(self) -> str:
        """The answer, then the tables of the command."""
        from truepose.reporting.notebook import table_html

        return super()._repr_html_() + "".join(map(table_html, self.tables))


@checked
def compare(old: Machine, new: Machine, poses: ArrayLike | None = None) -> MachineComparison:
    """Tell whether a machine changed between two files of it.

    What `truepose compare` says of them: `str` of the result is what that prints. `poses`
    (..., n_commanded), SI: where the tool is looked at, by default the workspace of `old`. Two
    calibrations of an unchanged machine are told apart by chance in at most 5 % of cases. Raises
    `RequestError` (not-the-same-machine, bad-poses, no-workspace, no-pose-left).
    """
    from truepose.calibration.result import compare as comparing

    return MachineComparison(old, new, comparing.compare(old, new, poses))


def text(comparison: MachineComparison, form: str) -> Iterator[str]:
    """The pieces of a comparison as JSON, or its parameters as CSV."""
    from truepose.reporting.formats import json_text
    from truepose.reporting.result import Result

    result = Result("compare", comparison.old, comparison.dataset)
    return json_text.text(result) if form == "json" else calibrated_files.csv_text(result)


__all__ = ["MachineComparison", "compare", "text"]
