"""What the machine's unknowns do at the tool over the workspace, and how well it is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats
from truepose.calibration.acceptance.observability import RowCovariance, covariance_root
from truepose.calibration.least_squares import (
    column_basis,
    column_norms,
    singular_decomposition,
)
from truepose.machine import Machine
from truepose.probability.normal_length import length_quantile
from truepose.representation import Represented

POSITION = "xyz"
ROTATION = "abc"
KEPT = 0.95
"""Probability of what is promised of the tool."""
SLIGHT = 1e-3
"""Of the largest effect of any unknown at the tool, by columns of length one: less is none."""


def tool_components(machine: Machine) -> list[str]:
    """The machine's components as they are called here: x y z, and a b c for rotations."""
    return [_ROTATIONS.get(name, name) for name in machine.components]


def commanded_components(machine: Machine) -> list[str]:
    """Those of them that are commanded; the others are parasitic motions."""
    return [name for name in tool_components(machine) if name in machine.commanded]


_ROTATIONS = {"rx": "a", "ry": "b", "rz": "c"}


@dataclass(frozen=True, eq=False, repr=False)
class ToolUncertainty(Represented):
    """Standard uncertainty of the tool, base frame, m and rad, inf where it is not determined.

    `standard` (n_pose, n_component); `position` and `rotation` (n_pose,): square roots of the sums
    of the squares of their components. `commanded`: the components that a command sets; the others
    are parasitic motions. `root` (n_pose, n_component, r): of the covariance.
    """

    components: tuple[str, ...]
    standard: Floats
    position: Floats
    rotation: Floats
    commanded: tuple[str, ...]
    root: Floats

    @property
    def position_max(self) -> float:
        """At the worst pose, m."""
        return float(self.position.max(initial=0.0))

    @property
    def rotation_max(self) -> float:
        """At the worst pose, rad."""
        return float(self.rotation.max(initial=0.0))

    @property
    def worst(self) -> tuple[float, float]:
        """`position_max` and `rotation_max`."""
        return self.position_max, self.rotation_max

    @cached_property
    def covariance(self) -> Floats:
        """(n_pose, n_component, n_component), inf in rows and columns that are not determined."""
        covariance: Floats = self.root @ self.root.transpose(0, 2, 1)
        open_ = np.isinf(self.standard)
        covariance[open_[:, :, np.newaxis] | open_[:, np.newaxis, :]] = np.inf
        return covariance

    @cached_property
    def within(self) -> tuple[float, float]:
        """What position (m) and rotation (rad) keep in 95 % at their worst pose, as commanded.

        The quantile of the length of the error over the freedoms that are commanded.
        """
        position, rotation = (
            float(length_quantile(self._commanded(names), KEPT).max(initial=0.0))
            for names in (POSITION, ROTATION)
        )
        return position, rotation

    def largest_variance(self, length: float) -> float:
        """Trace of the covariance of what is commanded at its worst pose, m², rotations times m."""
        position, rotation = (
            np.einsum("pcc->p", self._commanded(names)) for names in (POSITION, ROTATION)
        )
        return float((position + length**2 * rotation).max(initial=0.0))

    def _commanded(self, names: str) -> Floats:
        at = [
            index
            for index, name in enumerate(self.components)
            if name in names and name in self.commanded
        ]
        return self.covariance[:, at][:, :, at]

    @property
    def position_rms(self) -> float:
        """Root mean square over the poses, m."""
        return _rms(self.position)


@dataclass(frozen=True, eq=False)
class Considered:
    """The tool with all tolerances, those that were identified and those that were not.

    `labels` of the latter, and `every` tolerance. `before` is None where something that moves the
    tool has no tolerance; `alone` is `after` if those not identified were exact, `part` is what
    they contribute to it.
    `relative`: without what moves the whole machine in an instrument's unknown frame.
    """

    labels: tuple[str, ...]
    every: tuple[str, ...]
    before: ToolUncertainty | None
    after: ToolUncertainty
    alone: ToolUncertainty
    part: ToolUncertainty
    relative: bool


@dataclass(frozen=True, eq=False)
class SortedDirections:
    """Directions (k, n) that rows do not see, by what they do at the tool.

    `moving`: the tool moves. `gauge`: it moves as a rigid body over the whole workspace, together
    with an instrument's unknown frame: the machine stands elsewhere, but is the same machine.
    `harmless`: it does not move.
    """

    moving: Floats
    gauge: Floats
    harmless: Floats


@dataclass(frozen=True, eq=False)
class Tool:
    """`effects` (n_pose, n_component, n): d(error of the tool)/d(unknown), base frame.

    `positions` (n_pose, 3), m, or None. `length`: what a rotation is multiplied with to be compared
    with a displacement, the root mean square distance of the positions from their middle.
    `commanded`: components that a command sets.
    """

    components: tuple[str, ...]
    effects: Floats
    positions: Floats | None
    length: float
    commanded: tuple[str, ...]

    @classmethod
    def of(
        cls,
        effects: ArrayLike,
        components: Sequence[str],
        positions: ArrayLike | None,
        commanded: Sequence[str] | None = None,
    ) -> Tool:
        """All components are `commanded` where it is not said.

        Raises `ValueError` for shapes that do not fit.
        """
        array = np.asarray(effects, np.float64)
        if array.ndim != 3 or array.shape[1] != len(components):
            raise ValueError(
                f"the tool's sensitivity has shape {array.shape}, "
                f"expected (n_pose, {len(components)}, n_machine)"
            )
        points = None if positions is None else np.asarray(positions, np.float64)
        if points is not None and points.shape != (array.shape[0], 3):
            raise ValueError(
                f"the positions have shape {points.shape}, expected ({array.shape[0]}, 3)"
            )
        length = 1.0
        if points is not None and points.size:
            length = _rms(np.linalg.norm(points - points.mean(axis=0), axis=1)) or 1.0
        set_ = tuple(components if commanded is None else commanded)
        return cls(tuple(components), array, points, length, set_)

    @cached_property
    def moved(self) -> Flags:
        """(n,): unknowns that move the tool at all."""
        flags: Flags = np.any(self.effects != 0.0, axis=(0, 1))
        return flags

    def uncertainty(self, root: Floats, open_directions: Floats) -> ToolUncertainty:
        """Of a covariance root root^T, `root` (n, r), without limit in `open_directions` (k, n)."""
        # As one product of matrices, which is many times faster than one for each pose.
        n_pose, n_component, n = self.effects.shape
        of_root = self.effects.reshape(-1, n) @ root
        standard: Floats = np.sqrt(np.einsum("ij,ij->i", of_root, of_root))
        standard = standard.reshape(n_pose, n_component)
        if len(open_directions):
            effect = np.abs(self.effects @ open_directions.T)
            largest = effect.max(axis=(0, 1), initial=0.0)
            standard = np.where((effect > SLIGHT * largest).any(axis=2), np.inf, standard)
        return ToolUncertainty(
            self.components,
            standard,
            self._size(standard, POSITION),
            self._size(standard, ROTATION),
            self.commanded,
            of_root.reshape(n_pose, n_component, root.shape[1]),
        )

    def beforehand(self, prior: Floats) -> ToolUncertainty | None:
        """Of a prior covariance (n, n); None where an unknown that moves the tool has none."""
        if not np.isfinite(np.diagonal(prior)[self.moved]).all():
            return None
        return self.uncertainty(covariance_root(prior), np.zeros((0, len(prior))))

    def size_of(self, direction: Floats) -> float:
        """Largest displacement (m) over the workspace that a direction (n,) makes."""
        return float(self._size(self.effects @ direction, POSITION).max(initial=0.0))

    def sizes(self, moved: Floats) -> tuple[Floats, Floats]:
        """(n_pose,) position and rotation of displacements (n_pose, n_component), m and rad."""
        return self._size(moved, POSITION), self._size(moved, ROTATION)

    def displacement(
        self, change: Floats, after: ToolUncertainty, coverage: float
    ) -> tuple[float, bool]:
        """m by which other unknowns (n,) move the tool at most.

        And whether position or rotation moves by more than `coverage` standard uncertainties.
        """
        position, rotation = self.sizes(self.effects @ change[: self.effects.shape[2]])
        beyond = (position > coverage * after.position).any()
        beyond = beyond or (rotation > coverage * after.rotation).any()
        return float(position.max(initial=0.0)), bool(beyond)

    def moves(self, direction: Floats, lengths: Floats) -> bool:
        """Whether a direction (n,) does more than a slight part of what unknowns do.

        `lengths` (n,): of the unknowns' columns.
        """
        effect = float(np.linalg.norm(self._flat @ direction))
        return effect > SLIGHT * self._largest(lengths) * float(np.linalg.norm(direction * lengths))

    def sort(self, open_directions: RowCovariance, *, with_gauge: bool) -> SortedDirections:
        """The null directions by what they do; `with_gauge`: there are unknowns of instruments."""
        null = open_directions.null
        flat = self._flat
        none = np.zeros((0, flat.shape[1]))
        if len(null) == 0:
            return SortedDirections(none, none, none)
        slight = SLIGHT * self._largest(open_directions.lengths)
        harmless, rest = _split(flat @ null.T, null, slight)
        if not with_gauge or self.positions is None or len(rest) == 0:
            return SortedDirections(rest, none, harmless)
        fields = self._rigid_fields()
        effect = flat @ rest.T
        gauge, moving = _split(effect - fields @ (fields.T @ effect), rest, slight)
        return SortedDirections(moving, gauge, harmless)

    def relative(self, gauge: Floats) -> Tool:
        """The same without what the `gauge` directions (k, n) do."""
        if len(gauge) == 0:
            return self
        flat = self._flat
        basis = column_basis(flat @ gauge.T, SLIGHT)
        left = flat - basis @ (basis.T @ flat)
        effects = left.reshape(self.effects.shape) / self._weights()[:, np.newaxis]
        return replace(self, effects=effects)

    def _weights(self) -> Floats:
        return np.array([1.0 if name in POSITION else self.length for name in self.components])

    @cached_property
    def _flat(self) -> Floats:
        """(n_pose n_component, n), rotations as lengths."""
        weighted = self.effects * self._weights()[:, np.newaxis]
        return weighted.reshape(-1, self.effects.shape[2])

    @cached_property
    def _sizes(self) -> Floats:
        return column_norms(self._flat)

    def _largest(self, lengths: Floats) -> float:
        return float((self._sizes / lengths).max(initial=0.0))

    def _rigid_fields(self) -> Floats:
        """Orthonormal basis of what moves of the whole machine do at the tool."""
        assert self.positions is not None
        n_pose = len(self.positions)
        fields = np.zeros((n_pose, len(self.components), 6))
        arms = self.positions - self.positions.mean(axis=0)
        turns = np.cross(np.eye(3)[np.newaxis], arms[:, np.newaxis, :])  # (n_pose, axis, xyz)
        for index, component in enumerate(self.components):
            if component in POSITION:
                axis = POSITION.index(component)
                fields[:, index, axis] = 1.0
                fields[:, index, 3:] = turns[:, :, axis]
            else:
                fields[:, index, 3 + ROTATION.index(component)] = self.length
        return column_basis(fields.reshape(-1, 6), SLIGHT)

    def _size(self, values: Floats, components: str) -> Floats:
        chosen = [index for index, name in enumerate(self.components) if name in components]
        size: Floats = np.sqrt((values[:, chosen] ** 2).sum(axis=1))
        return size


def _split(effect: Floats, directions: Floats, slight: float) -> tuple[Floats, Floats]:
    """`directions` (k, n) as those whose `effect` (N, k) is slight, and the others."""
    sizes, right = singular_decomposition(effect)
    turned = right @ directions
    return turned[sizes <= slight], turned[sizes > slight]


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
