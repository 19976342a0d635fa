"""Error budget: each source's error, all together, and the comparison; one combination a file.

`truepose.budget` is both this package and the public function of that name: the import system
puts a subpackage into its parent's namespace, so the package itself answers the call.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from truepose.budget.evaluate import SCHEMA, budget

if TYPE_CHECKING:
    import xarray as xr

    from truepose.budget.poses import Progress
    from truepose.machine import Condition, Machine


class _BudgetModule(ModuleType):
    def __call__(
        self,
        machine: Machine,
        poses: ArrayLike | None = None,
        condition: Condition | None = None,
        *,
        progress: Progress | None = None,
    ) -> xr.Dataset:
        return budget(machine, poses, condition, progress=progress)


_BudgetModule.__call__.__doc__ = budget.__doc__
sys.modules[__name__].__class__ = _BudgetModule

__all__ = ["SCHEMA", "budget"]
