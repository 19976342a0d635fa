"""One machine with its results, and what every table and figure reads from them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.reporting.display import is_position

if TYPE_CHECKING:
    import xarray as xr

    from truepose.files.shown_units import ShownUnits
    from truepose.machine import Machine
    from truepose.plausibility import Oddity
    from truepose.verdict.answer import Answer
    from truepose.verdict.tightening import Tightening


def warnings_of(dataset: xr.Dataset) -> list[dict[str, str]]:
    """What a result warns of: `code` and `sentence` of each, without its full stop."""
    warnings: list[dict[str, str]] = json.loads(dataset.attrs.get("warnings") or "[]")
    return warnings


@dataclass(frozen=True)
class Study:
    """A machine, its error budget and, where it was asked for, its compensation.

    `budget` and `compensation` are the Datasets of `truepose.budget` and `truepose.compensate`
    over the same poses, `over_time` that of `truepose.over_time`, where there is a temperature
    log, `strain` that of `truepose.strain`, where the machine is over-constrained. `worst_case`,
    `monte_carlo`, `bounds` and `shares` are those of the functions of these names at a few of the
    poses, `ellipses` is a `monte_carlo` at more of them with fewer samples; `missing` says, by
    name, why one of them is not there. `calibration` is that of `truepose.calibrate`, where there
    are measurements. `accuracy` are the answers of `truepose.accuracy` over the same poses,
    `sampled` the same at a coverage of 95 %, `tightening` that of `truepose.tightening`, where they
    are not met after compensation. `oddities` are those of `truepose.oddities`. All
    values here are SI.
    """

    machine: Machine
    budget: xr.Dataset
    compensation: xr.Dataset | None = None
    accuracy: tuple[Answer, ...] = ()
    sampled: tuple[Answer, ...] = ()
    over_time: xr.Dataset | None = None
    strain: xr.Dataset | None = None
    worst_case: xr.Dataset | None = None
    monte_carlo: xr.Dataset | None = None
    ellipses: xr.Dataset | None = None
    bounds: xr.Dataset | None = None
    shares: xr.Dataset | None = None
    missing: Mapping[str, str] = field(default_factory=dict)
    calibration: xr.Dataset | None = None
    oddities: tuple[Oddity, ...] = ()
    tightening: Tightening | None = None

    @property
    def strained(self) -> xr.Dataset:
        """The internal forces, where the machine has any."""
        assert self.strain is not None
        return self.strain

    @property
    def calibrated(self) -> xr.Dataset:
        """The calibration, where there is one."""
        assert self.calibration is not None
        return self.calibration

    @property
    def time(self) -> xr.Dataset:
        """The results over time, where there are any."""
        assert self.over_time is not None
        return self.over_time

    @cached_property
    def drawn(self) -> tuple[Answer, ...]:
        """Those of `sampled` that have the machines that were drawn, of which any has an error."""
        return tuple(
            answer
            for answer in self.sampled
            if answer.coverage is not None and np.isfinite(answer.coverage.sizes[:1]).any()
        )

    @cached_property
    def components(self) -> tuple[str, ...]:
        """Names of the error components: x y z (m), rx ry rz (rad), those the platform has."""
        return tuple(str(name) for name in self.budget["component"].values)

    @cached_property
    def positions(self) -> list[int]:
        """Indices of the components that are lengths."""
        return [index for index, name in enumerate(self.components) if is_position(name)]

    @cached_property
    def rotations(self) -> list[int]:
        """Indices of the components that are angles."""
        return [index for index, name in enumerate(self.components) if not is_position(name)]

    @cached_property
    def sources(self) -> tuple[str, ...]:
        """Names of the error sources, in the order of the registry."""
        return tuple(str(name) for name in self.budget["source"].values)

    @cached_property
    def by_rank(self) -> list[int]:
        """Indices of the sources, the largest first."""
        return [int(index) for index in np.argsort(self.values("rank"), kind="stable")]

    @cached_property
    def has_band(self) -> tuple[bool, ...]:
        """Per source: whether it can do more than its error at the shift, anywhere."""
        # Of a summary, which has no poses, there is the highest alone.
        summed = "highest_reach" in self.budget
        reach = self.values("highest_reach" if summed else "reach").max(
            axis=(-1,) if summed else (0, 2)
        )
        return tuple(bool(far > 0.0) for far in reach)

    @cached_property
    def n_pose(self) -> int:
        """Number of poses that were evaluated."""
        used = self.budget.sizes.get("pose")
        return int(self.budget.attrs["poses_used"] if used is None else used)

    @cached_property
    def numbers(self) -> Indices:
        """(n_pose,) number of each pose in the poses asked for, from 0, as files have it."""
        return np.asarray(self.budget["pose"].values, np.intp)

    @cached_property
    def poses(self) -> Floats:
        """(n_pose, n_commanded) commanded poses, m and rad."""
        return self._stacked("pose_", self.machine.commanded)

    @cached_property
    def left_out(self) -> Floats:
        """(n_left_out, n_commanded) poses that cannot be used, m and rad."""
        return self._stacked("left_out_", self.machine.commanded)

    @cached_property
    def left_out_statuses(self) -> tuple[str, ...]:
        """Why each pose of `left_out` cannot be used."""
        return tuple(str(status) for status in self.values("left_out_status"))

    @cached_property
    def units(self) -> ShownUnits:
        """The units for people."""
        return self.machine.shown

    def shown(self, errors: Floats) -> Floats:
        """Errors (..., component), SI, in the units for people."""
        return self.units.errors(errors, self.components)

    def values(self, name: str) -> Floats:
        """One variable of the budget as an array, in the axis order of the schema."""
        return np.asarray(self.budget[name].values)

    def _stacked(self, prefix: str, names: tuple[str, ...]) -> Floats:
        return np.stack([self.values(prefix + name) for name in names], axis=-1)

    def compensated(self, name: str) -> Floats:
        """One variable of the compensation at the poses of the budget.

        Missing (NaN) at a pose whose corrected command the machine cannot follow.
        """
        assert self.compensation is not None
        values = np.asarray(self.compensation[name].values)
        here, there = self.values("pose"), np.asarray(self.compensation["pose"].values)
        if np.array_equal(here, there):
            return values
        aligned = np.full((len(here), *values.shape[1:]), np.nan)
        _, at, of = np.intersect1d(here, there, return_indices=True)
        aligned[at] = values[of]
        return aligned

    def position_norm(self, errors: Floats) -> Floats:
        """Length of the position part of errors (..., component) -> (...), m."""
        return np.asarray(np.linalg.norm(errors[..., self.positions], axis=-1))

    def rotation_norm(self, errors: Floats) -> Floats:
        """Angle of the rotation part of errors (..., component) -> (...), rad."""
        return np.asarray(np.linalg.norm(errors[..., self.rotations], axis=-1))

    @cached_property
    def overall_worst(self) -> Floats:
        """(n_pose, n_component) the most that all sources together can do to each component.

        |overall error with every source at its shift| + each source's linear band, the bands
        added because sources do not know of each other; or the exact error at an edge where that
        is larger. No machine has all of them at once: `largest` is what one can do.
        """
        linear = np.abs(self.values("overall_error")) + self.values("reach").sum(axis=1)
        exact = [np.abs(self.values(f"overall_error_{edge}")) for edge in ("lower", "upper")]
        return np.asarray(np.maximum.reduce([linear, *exact]))

    @cached_property
    def largest(self) -> Floats:
        """(n_pose,) linear maximum of the position, of the orientation where nothing moves."""
        return np.asarray(self.values("linear_maximum")[:, 0])

    @cached_property
    def remaining_largest(self) -> Floats:
        """(n_pose,) the same after compensation; missing where no corrected command leads."""
        return np.asarray(self.compensated("linear_maximum")[:, 0])
