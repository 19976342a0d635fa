"""What tables and figures read from any result: its names, its poses, its worst pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.language import marked
from truepose.reporting.display import is_position, pose_text, where_highest

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine


def percent_text(probability: float) -> str:
    """A probability as people write it: "95 %"."""
    return marked(f"{100.0 * probability:.6g} %")


def components(result: xr.Dataset) -> list[str]:
    """Names of the error components of a result."""
    return [str(name) for name in result["component"].values]


def quantities(result: xr.Dataset) -> list[str]:
    """Names of the magnitudes of a result: position, orientation."""
    return [str(name) for name in result["quantity"].values]


def position_of(result: xr.Dataset) -> list[int]:
    """Indices of the components that say where the tool is, or how it turns if it only does."""
    names = components(result)
    return [at for at, name in enumerate(names) if is_position(name)] or list(range(len(names)))


def poses_of(machine: Machine, result: xr.Dataset) -> Floats:
    """(n_pose, n_commanded) poses of a result, m and rad."""
    return np.stack([result[f"pose_{name}"].values for name in machine.commanded], axis=-1)


def at_text(machine: Machine, result: xr.Dataset, pose: int) -> str:
    """One pose of a result for people, counted in the result."""
    return pose_text(poses_of(machine, result)[pose], machine.commanded, machine.shown)


def worst_pose(result: xr.Dataset, magnitude: str) -> int:
    """Index of the pose at which a magnitude (pose, quantity) of the position is highest."""
    sizes = np.asarray(result[magnitude].values)[:, 0]
    return where_highest(sizes) if np.isfinite(sizes).any() else 0
