"""How the parts of a machine move, to first order, about where its shifts and its command take it.

Rows of an array (..., v + m) are linear forms: times the v variables of a pose, and the m
components of what the platform moves beyond that, they are how far something moves, m or rad.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.machine import Machine
from truepose.probability.domain import Domain
from truepose.runs.first_order import rows_of
from truepose.runs.quantities import POSITIONS
from truepose.runs.variables import Variables
from truepose.sources import PoseBlock
from truepose.spatial import cross, left_jacobian, quaternion_to_matrix, tangents, vector_to_matrix

ROTATIONS = ("rx", "ry", "rz")


class Names:
    """Where the parameters of a machine stand."""

    def __init__(self, machine: Machine) -> None:
        self._at = {name: at for at, name in enumerate(machine.parameters)}

    def has(self, name: str) -> bool:
        """Whether there is such a parameter."""
        return name in self._at

    def __getitem__(self, name: str) -> int:
        return self._at[name]

    def point(self, path: str) -> Indices:
        """(3,) of a point, as `strut.1.base`."""
        return np.array([self._at[f"{path}.{axis}"] for axis in "xyz"], np.intp)

    def tilts(self, path: str) -> Indices:
        """(2,) of how a direction is tilted, as `drive.d1.axis`."""
        return np.array([self._at[f"{path}.{name}"] for name in "uv"], np.intp)


@dataclass(frozen=True, eq=False)
class Motion:
    """Some poses of a block with the machine at its shifts, and what its variables move there.

    `joints` (n, n_joint) as commanded. `position` (n, 3), m, and `rotation` (n, 3, 3): where the
    machine takes the platform; `turned` (n, 3): rotation vector from the pose asked for to there.
    `parameters` (n or 1, n_parameter): values; `columns`, `variable_of`, `half_width`
    and `domain` are those of the variables; `effects` (n, m, v + m) on displacement and rotation
    vector, of the variables, and of these components themselves.
    """

    components: tuple[str, ...]
    joints: Floats
    position: Floats
    rotation: Floats
    turned: Floats
    parameters: Floats
    columns: Indices
    variable_of: Indices
    half_width: Floats
    domain: Domain
    effects: Floats

    @classmethod
    def at(
        cls,
        machine: Machine,
        block: PoseBlock,
        variables: Variables,
        first: tuple[Floats, Floats],
        poses: slice,
    ) -> Motion:
        """At some `poses`; `first` are value (n, m) and effects (n, m, v) of all of the block."""
        value, effects = first[0][poses], first[1][poses]
        placements = block.placements[poses]
        moved, turned = np.zeros((len(value), 3)), np.zeros((len(value), 3))
        for at, name in enumerate(machine.components):
            into, names = (moved, POSITIONS) if name in POSITIONS else (turned, ROTATIONS)
            into[:, names.index(name)] = value[:, at]
        itself = np.broadcast_to(np.eye(value.shape[1]), (*value.shape, value.shape[1]))
        columns, shift = variables.shift
        shift = rows_of(shift, poses)
        parameters = np.repeat(machine.nominal[np.newaxis], len(shift), axis=0)
        parameters[:, columns] += shift
        return cls(
            machine.components,
            block.joints[poses],
            placements[:, :3] + moved,
            vector_to_matrix(turned) @ quaternion_to_matrix(placements[:, 3:]),
            turned,
            parameters,
            variables.columns,
            variables.variable_of,
            rows_of(variables.half_width, poses),
            variables.domain,
            np.concatenate([effects, itself], axis=2),
        )

    def reach(self, rows: Floats) -> Floats:
        """(...,) the most that linear forms (..., v + m) are over the variables, either way."""
        down, up = self.domain.reach(rows[..., : self.domain.lower.size])
        return np.maximum(down, up)

    @cached_property
    def linear(self) -> list[int]:
        """Components of the displacement."""
        return [at for at, name in enumerate(self.components) if name in POSITIONS]

    @cached_property
    def angular(self) -> list[int]:
        """Components of the rotation vector."""
        return [at for at, name in enumerate(self.components) if name in ROTATIONS]

    @cached_property
    def spin(self) -> Floats:
        """(n, 3, a) from a change of the rotation vector's components to a turn of the platform.

        The left Jacobian of the rotation vector to where the platform is, exp(v): its norm is 1.
        """
        into = [ROTATIONS.index(self.components[at]) for at in self.angular]
        if len(into) < 3:
            return np.broadcast_to(np.eye(3)[:, into], (len(self.turned), 3, len(into)))
        return left_jacobian(self.turned)

    @cached_property
    def turns(self) -> Floats:
        """(n, 3, v + m) turn of the platform."""
        turns: Floats = self.spin @ self.effects[:, self.angular]
        return turns

    @cached_property
    def turn_reach(self) -> Floats:
        """(n, 3) the most of each component of the turn."""
        return self.reach(self.turns)

    def of_platform(self, along: Floats, arm: Floats) -> Floats:
        """(n, c, v + m) motion along directions (n, c, 3) of arms (n, c, 3) from the tool."""
        into = [POSITIONS.index(self.components[at]) for at in self.linear]
        slopes = np.empty((*along.shape[:2], len(self.components)))
        slopes[:, :, self.linear] = along[:, :, into]
        if self.angular:
            slopes[:, :, self.angular] = cross(arm, along) @ self.spin
        rows: Floats = slopes @ self.effects
        return rows

    def of_parameter(self, parameter: int) -> list[tuple[int, Floats]]:
        """Which variables move it, and by how much (n or 1,)."""
        return self._movers.get(parameter, [])

    @cached_property
    def _movers(self) -> dict[int, list[tuple[int, Floats]]]:
        movers: dict[int, list[tuple[int, Floats]]] = {}
        columns, variables = self.columns.tolist(), self.variable_of.tolist()
        for at, (parameter, variable) in enumerate(zip(columns, variables, strict=True)):
            movers.setdefault(parameter, []).append((variable, self.half_width[:, at]))
        return movers

    def forms(self, parameters: Sequence[int] | Indices) -> Floats:
        """(n or 1, k, v + m) linear forms of some parameters."""
        rows = np.zeros((len(self.half_width), len(parameters), self.effects.shape[2]))
        for row, parameter in enumerate(parameters):
            for variable, half_width in self.of_parameter(int(parameter)):
                rows[:, row, variable] += half_width
        return rows

    def add(self, rows: Floats, parameter: int, slopes: Floats) -> None:
        """Add to forms (n, c, v + m) what they change by with a parameter, slopes (n or 1, c)."""
        for variable, half_width in self.of_parameter(parameter):
            rows[:, :, variable] += slopes * half_width[:, np.newaxis]

    def values(self, parameters: Indices) -> Floats:
        """(n or 1, ...) of parameters (...)."""
        return self.parameters[:, parameters]

    def arms(self, points: Indices, tool: Indices) -> Floats:
        """(n, c, 3) from the tool point to points of the platform (c, 3), base axes."""
        own = self.values(points) - self.values(tool)[:, np.newaxis]
        return np.asarray(own @ np.swapaxes(self.rotation, 1, 2))


@dataclass(frozen=True, eq=False)
class Tilt:
    """A direction that may be tilted, at n or 1 sets of parameters: c = axis + u t1 + v t2.

    `axis` (n, 3) is c / |c|, `tangents` (n, 2, 3) t1 and t2 over |c|; `reach` (n,) the most of the
    part that variables add, over |c|; `along` (n,): most of that part, 1 being all, along the axis.
    """

    axis: Floats
    tangents: Floats
    reach: Floats
    along: Floats

    @classmethod
    def of(cls, motion: Motion, nominal: Floats, parameters: Indices) -> Tilt:
        """Of a nominal direction (3,) and the parameters u and v."""
        axis = nominal / np.linalg.norm(nominal)
        across = tangents(axis)
        given = axis + motion.values(parameters) @ across
        size = np.linalg.norm(given, axis=1)
        axis = given / size[:, np.newaxis]
        scaled = across / size[:, np.newaxis, np.newaxis]
        moved = np.linalg.norm(motion.reach(motion.forms(parameters)), axis=1) / size
        along = np.linalg.norm(np.einsum("jk,nk->nj", across, axis), axis=1)
        return cls(axis, scaled, moved, along)

    @cached_property
    def slopes(self) -> Floats:
        """(n, 2, 3) derivatives of the unit axis to u and v."""
        along = np.einsum("njk,nk->nj", self.tangents, self.axis)
        slopes: Floats = self.tangents - along[:, :, np.newaxis] * self.axis[:, np.newaxis]
        return slopes
