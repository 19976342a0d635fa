"""What no command takes out: known errors of freedoms that follow from the commanded ones."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from truepose.files.dimensions import FREEDOMS
from truepose.language import marked, say
from truepose.machine import Machine
from truepose.runs.controller_geometry import ROUNDING

if TYPE_CHECKING:
    import xarray as xr

CODE = "parasitic-remains"

_COMPONENTS = dict(zip(FREEDOMS, ("x", "y", "z", "rx", "ry", "rz"), strict=True))


def parasitic_remains(machine: Machine, residual: xr.DataArray) -> list[dict[str, str]]:
    """One warning, its code and sentence, where known errors remain after compensation; else none.

    `residual` (pose, component): of the machine at its shifts, m or rad.
    """
    free = [name for name in machine.dof if name not in machine.commanded]
    remaining = []
    for name in free:
        component = _COMPONENTS[name]
        size = float(np.abs(residual.sel(component=component)).max())
        if size > ROUNDING:
            unit = "um" if name in "xyz" else "urad"
            remaining.append(marked(f"{component} {1e6 * size:.4g} {unit}"))
    if not remaining:
        return []
    sentence = say(
        "{names} are parasitic: they follow from {commanded}, and no command takes their error "
        "out; of what is known remain at most {remaining}",
        names=", ".join(free),
        commanded=", ".join(machine.commanded),
        remaining=", ".join(remaining),
    )
    return [{"code": CODE, "sentence": sentence}]


__all__ = ["CODE", "parasitic_remains"]
