"""The error of one machine in one condition, to first order in the half widths to be chosen.

    error = value + fixed t + sum over features of slope half_width s

at a pose: `value` where all known deviations take the tool, `fixed` what the bands that are not
chosen do, `slope` what a unit of a feature's half width does, with t and s in their domain. Before
compensation the command is the nominal one, after it the corrected one.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats, Indices, sorted_union
from truepose.compensation.corrected import corrected
from truepose.design.allocated_bands import AllocatedBands
from truepose.error_budget.largest import Largest, largest
from truepose.machine import Condition
from truepose.probability.domain import Domain
from truepose.runs.displacement import displacement
from truepose.runs.first_order import first_order
from truepose.runs.poses import OK
from truepose.runs.quantities import quantities
from truepose.runs.run import Run
from truepose.runs.variables import Variables
from truepose.sources import PoseBlock, acting


@dataclass(frozen=True, eq=False)
class LinearErrors:
    """The first order at n poses; rows of poses that do not belong to the run are 0.

    `belongs` (n,): poses that the machine as drawn, and at its shifts, can take. `lost` (n,): those
    of them where the commanded machine has no error, whatever the tolerances. `value` (n, m),
    `fixed` (n, m, w) and its `domain`, `slopes` (n, m, f). `block` and `variables` of what is
    neither lost nor outside, in order.
    """

    belongs: Flags
    lost: Flags
    value: Floats
    fixed: Floats
    domain: Domain
    slopes: Floats
    block: PoseBlock | None
    variables: Variables | None

    @property
    def usable(self) -> Flags:
        """(n,) poses with an error."""
        return np.asarray(self.belongs & ~self.lost)


class ErrorModel:
    """A machine with its options set, in one condition, before or after compensation."""

    def __init__(self, bands: AllocatedBands, condition: Condition, *, after: bool) -> None:
        self.bands, self.condition, self.after = bands, condition, after
        self.machine = bands.fixed
        self.kinds: list[Indices] = list(quantities(self.machine.components).values())
        self._member = bands.member
        self._sources = acting(self.machine, condition)

    def at(self, poses: Floats) -> LinearErrors:
        """At poses (n, n_commanded), SI; n is at most `BLOCK`."""
        count, m = len(poses), len(self.machine.components)
        belongs, lost = np.zeros((2, count), np.bool_)
        value, slopes = np.zeros((count, m)), np.zeros((count, m, len(self.bands.features)))
        nothing = np.empty(0)
        errors = LinearErrors(
            belongs,
            lost,
            value,
            np.zeros((count, m, 0)),
            Domain(nothing, nothing),
            slopes,
            None,
            None,
        )
        run = Run(self.machine, poses, self.condition, sources=self._sources)
        for block, variables in run.with_variables():  # one block, or none
            belongs[block.indices] = True
            status = np.full(block.indices.size, OK, np.uint8)
            if self.after:
                block, variables, status = corrected(self.machine, block, self._sources)
            errors = self._filled(errors, block, variables, status)
        return errors

    def largest(self, errors: LinearErrors, halves: Floats) -> Largest:
        """The largest lengths (n, q) with half widths (f,); of no meaning where not usable."""
        effects, domain = self.effects(errors, halves)
        return largest(errors.value, effects, domain, self.kinds)

    def effects(self, errors: LinearErrors, halves: Floats) -> tuple[Floats, Domain]:
        """What every variable does at +1, (n, m, w + v), and where they lie."""
        own = (errors.slopes * halves) @ self._member
        ones = np.ones(own.shape[2])
        domain = Domain(
            np.concatenate([errors.domain.lower, -ones]),
            np.concatenate([errors.domain.upper, ones]),
            errors.domain.directions,
        )
        return np.concatenate([errors.fixed, own], axis=2), domain

    def support(
        self, errors: LinearErrors, quantity: Indices, directions: Floats
    ) -> tuple[Floats, Floats]:
        """What is known and fixed along unit directions (n, k) of a quantity's components.

        And what a unit of each feature's half width adds along it, signed (n, f).
        """
        along = errors.value.shape[1]
        u = np.zeros((len(directions), along))
        u[:, quantity] = directions[:, : quantity.size]
        known = np.einsum("nm,nm->n", u, errors.value)
        fixed = errors.domain.support(np.einsum("nm,nmw->nw", u, errors.fixed))
        return known + fixed, np.einsum("nm,nmf->nf", u, errors.slopes)

    def exact(self, errors: LinearErrors, halves: Floats, t: Floats) -> tuple[Floats, Flags]:
        """Exact errors (s, m) at the usable poses, one machine each, and whether there is one.

        `t` (s, w + v): the variables, those of `effects`; s poses, as many as are usable.
        """
        block, variables = errors.block, errors.variables
        assert block is not None
        assert variables is not None
        width = errors.fixed.shape[2]
        parameters, shift = variables.shift
        own = self.bands.slopes * halves[self.bands.feature_of]
        half_width = own * t[:, width + self.bands.variable_of[self.bands.feature_of]]
        every = sorted_union(parameters, variables.columns, self.bands.columns)
        moved = np.zeros((len(t), every.size))
        moved[:, np.searchsorted(every, parameters)] = shift
        _add(moved, every, variables.columns, variables.half_width * t[:, variables.variable_of])
        _add(moved, every, self.bands.columns, half_width)
        error, status = displacement(self.machine, block.joints, block.placements, (every, moved))
        return error, np.asarray(status == OK, np.bool_)

    # --- inside

    def _filled(
        self, errors: LinearErrors, block: PoseBlock, variables: Variables, status: np.ndarray
    ) -> LinearErrors:
        """The errors at the poses of a block; those where there is none are lost."""
        at_shift, fixed, regular = first_order(self.machine, block, variables)
        good = np.asarray((status == OK) & (regular == OK), np.bool_)
        errors.lost[block.indices[~good]] = True
        if not good.all():
            block, variables = block.select(good), variables.select(good)
            at_shift, fixed = at_shift[good], fixed[good]
        errors.value[block.indices] = at_shift
        everywhere = np.zeros((*errors.value.shape, fixed.shape[2]))
        everywhere[block.indices] = fixed
        if self.bands.columns.size and block.indices.size:
            parameters, shift = variables.shift
            of_columns, _ = self.machine.kernel.sensitivity_moved(
                block.joints,
                block.placements,
                self.bands.columns,
                parameters,
                np.ascontiguousarray(shift),
            )
            gathered = np.zeros((self.bands.columns.size, len(self.bands.features)))
            gathered[np.arange(self.bands.columns.size), self.bands.feature_of] = self.bands.slopes
            errors.slopes[block.indices] = of_columns @ gathered
        return dataclasses.replace(
            errors, fixed=everywhere, domain=variables.domain, block=block, variables=variables
        )


def _add(moved: Floats, every: Indices, columns: Indices, values: Floats) -> None:
    """Add values (s, k) of columns (k,) to the parameters that they are of."""
    for column, place in enumerate(np.searchsorted(every, columns).tolist()):
        moved[:, place] += values[:, column]


__all__ = ["ErrorModel", "LinearErrors"]
