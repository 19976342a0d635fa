"""The one form in which every error source says what it does: a `Deviation` of parameters.

A cause of error, whatever it is, moves parameters of the machine: `actual = nominal + deviation`.
A source returns, for one block of poses, only the parameters that it touches: the centre of the
deviation that is known (`shift`), the band about it that is not (`half`), and what correlates.
Budget, compensation and everything after them read this form and know no source.

All values are SI (m, rad, dimensionless), as the kernel's parameter vector has them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats, Indices
from truepose.probability.distributions import (
    ARCSINE,
    TRIANGULAR,
    TWO_POINT,
    UNIFORM,
    Distribution,
    normal,
)
from truepose.probability.domain import Domain
from truepose.representation import Represented
from truepose.sources.variation import WITH_MACHINE, Variation

if TYPE_CHECKING:
    from pydantic import BaseModel

    from truepose.machine import Condition, Machine, SourceBuilder
    from truepose.sources.pose_block import PoseBlock


OWN_GROUP = -1
"""Group of a column that moves by itself, correlated with no other."""


class GroupQuantity(NamedTuple):
    """What the variable of a group is, where it is the deviation of something by itself.

    Its `shift` and `half` band as of a column, in its own SI `unit`; the members deviate by what
    follows from it.
    """

    shift: float
    half: float
    unit: str


@dataclass(frozen=True, repr=False)
class Deviation(Represented):
    """What one source does to the k columns of parameters it touches, for n poses.

    `parameters` (k,): kernel parameter of each column. A parameter may stand in several columns
    (an own and a common cause, say); its deviation is then their sum.
    `shift` (n or 1, k): the known centre, which can be compensated.
    `half` (n or 1, k), at least 0: the half band about the shift, which remains.
    `groups` (k,): columns of one non-negative id share one variable t in [-1, 1] and deviate by
    `shift + sign * half * t`; `OWN_GROUP` columns each have a variable of their own. Of listed
    values that are not symmetric t ends where they do (`Distribution.ends`).
    `sign` (n or 1, k): signed coefficient (+1 or -1) in the common variable; of no effect in an
    own group.
    `distribution`: of each column's variable; one for all, or k of them, equal within a group.
    `edge` (k,): lengths and offsets, which `error_lower` and `error_upper` move to the ends of
    their bands; coordinates and directions are not moved there.
    `correlation` (n_variable, n_variable), of the numbers in `variables`: Pearson's coefficients
    of the variables t; None where all are independent.
    `group_names`: what a group is called, where it has a name.
    `group_quantities`: of groups that are the deviation of something by itself, as the radius is
    on which joint centres lie: then a parameter may be in it and have a column of its own too.
    `directions`: groups whose two or three variables are together a unit vector, as the components
    of a direction that is not known are.
    `variation` (k,): what each column's variable varies with, equal within a group, within a
    direction and among correlated variables; one with position has its law's distribution.

    Raises `ValueError` where shapes or values contradict this.
    """

    parameters: Indices
    shift: Floats
    half: Floats
    groups: Indices
    sign: Floats
    edge: Flags
    distribution: tuple[Distribution, ...] = field(default=())
    correlation: Floats | None = None
    group_names: Mapping[int, str] = field(default_factory=dict)
    group_quantities: Mapping[int, GroupQuantity] = field(default_factory=dict)
    directions: tuple[tuple[int, ...], ...] = ()
    variation: tuple[Variation, ...] = ()

    @classmethod
    def of(
        cls,
        parameters: ArrayLike,
        shift: ArrayLike = 0.0,
        half: ArrayLike = 0.0,
        *,
        groups: ArrayLike = OWN_GROUP,
        sign: ArrayLike = 1.0,
        edge: ArrayLike = True,
        distribution: Distribution | Sequence[Distribution] = UNIFORM,
        correlation: ArrayLike | None = None,
        group_names: Mapping[int, str] | None = None,
        group_quantities: Mapping[int, GroupQuantity] | None = None,
        directions: Sequence[Sequence[int]] = (),
        variation: Variation | Sequence[Variation] = WITH_MACHINE,
    ) -> Self:
        """A deviation from plain values: a number or a (k,) array stands for every pose."""
        columns = np.atleast_1d(np.asarray(parameters, np.intp))
        count = columns.size
        distributions = (
            (distribution,) * count if isinstance(distribution, Distribution) else distribution
        )
        return cls(
            columns,
            _table(shift, count),
            _table(half, count),
            np.broadcast_to(np.asarray(groups, np.intp), (count,)).copy(),
            _table(sign, count),
            np.broadcast_to(np.asarray(edge, np.bool_), (count,)).copy(),
            tuple(distributions),
            None if correlation is None else np.array(correlation, np.float64),
            dict(group_names or {}),
            dict(group_quantities or {}),
            tuple(tuple(groups) for groups in directions),
            (variation,) * count if isinstance(variation, Variation) else tuple(variation),
        )

    def __post_init__(self) -> None:
        count = self.parameters.size
        tables = {"shift": self.shift, "half": self.half, "sign": self.sign}
        for name, table in tables.items():
            if table.ndim != 2 or table.shape[1] != count:
                raise ValueError(f"{name} has shape {table.shape}, expected (n or 1, {count})")
            # A sum is finite only of finite numbers, and found in half the time.
            if not (np.isfinite(table.sum()) or np.isfinite(table).all()):
                raise ValueError(f"{name} has a value that is not finite")
        for name, size in (("groups", self.groups.size), ("edge", self.edge.size)):
            if size != count:
                raise ValueError(f"{name} has {size} entries, expected {count}")
        if len(self.distribution) != count:
            raise ValueError(f"{len(self.distribution)} distributions, expected {count}")
        if self.half.min(initial=0.0) < 0.0:
            raise ValueError("a half band is negative")
        if not (np.abs(self.sign) == 1.0).all():
            raise ValueError("a sign is neither +1 nor -1")
        shared: dict[int, Distribution] = {}
        for group, variable in zip(self.groups.tolist(), self.distribution, strict=True):
            if group != OWN_GROUP and shared.setdefault(group, variable) != variable:
                raise ValueError(f"group {group} has one variable but two distributions")
        self._check_directions(shared)
        self._check_correlation()
        self._check_variation()

    def _check_directions(self, shared: Mapping[int, Distribution]) -> None:
        """A component of a direction that is as likely anywhere (Archimedes): each is so spread."""
        listed = [group for groups in self.directions for group in groups]
        if len(set(listed)) < len(listed):
            raise ValueError("a group is a component of two directions")
        for groups in self.directions:
            spread = {2: ARCSINE, 3: UNIFORM}.get(len(groups))
            if any(shared.get(group) != spread for group in groups):
                raise ValueError(f"the groups {groups} are no components of a direction")

    def _check_correlation(self) -> None:
        given = self.correlation
        if given is None:
            return
        count = self.n_variable
        if given.shape != (count, count):
            raise ValueError(f"correlation has shape {given.shape}, expected ({count}, {count})")
        if not (np.abs(given) <= 1.0).all():
            raise ValueError("a correlation is not from -1 to 1")
        if not (np.array_equal(given, given.T) and (np.diagonal(given) == 1.0).all()):
            raise ValueError("a correlation is not symmetric, or not one with itself")

    def _check_variation(self) -> None:
        if not self.variation:
            object.__setattr__(self, "variation", (WITH_MACHINE,) * self.parameters.size)
        if len(self.variation) != self.parameters.size:
            raise ValueError(f"{len(self.variation)} variations, expected {self.parameters.size}")
        if all(one is WITH_MACHINE for one in self.variation):
            return
        shared: dict[int, Variation] = {}
        for group, own, spread in zip(
            self.groups.tolist(), self.variation, self.distribution, strict=True
        ):
            if group != OWN_GROUP and shared.setdefault(group, own) != own:
                raise ValueError(f"group {group} has one variable, but varies in two ways")
            if own.law is not None and own.law.distribution != spread:
                raise ValueError(f"{own.law} has not the distribution {spread}")
        for groups in self.directions:
            if len({shared[group] for group in groups}) > 1 or shared[groups[0]].law is not None:
                raise ValueError(f"the groups {groups} are one direction, but vary in two ways")
        if self.correlation is not None:
            ways = dict(zip(self.variables.tolist(), self.variation, strict=True))
            for one, other in np.argwhere(np.triu(self.correlation, 1)).tolist():
                if ways[one] != ways[other] or ways[one].law is not None:
                    raise ValueError(f"variables {one} and {other} correlate, but vary in two ways")

    @cached_property
    def of_quantities(self) -> Flags:
        """(k,) columns of groups that are the deviation of something by itself."""
        return np.isin(self.groups, list(self.group_quantities))

    @cached_property
    def signed_half(self) -> Floats:
        """(n or 1, k) deviation of each column when its variable is at +1, about the shift."""
        signed: Floats = np.where(self.groups == OWN_GROUP, 1.0, self.sign) * self.half
        return signed

    @cached_property
    def variables(self) -> Indices:
        """(k,) number of the variable that moves each column, 0 .. n_variable - 1."""
        own = self.groups == OWN_GROUP
        above = int(self.groups.max(initial=-1)) + 1
        named = np.where(own, above + np.arange(self.groups.size), self.groups)
        return np.asarray(np.unique(named, return_inverse=True)[1], np.intp)

    @property
    def n_variable(self) -> int:
        """How many variables there are, each of a column or of a group."""
        return int(self.variables.max(initial=-1)) + 1

    @cached_property
    def banded(self) -> Indices:
        """Columns whose band is not empty at some pose; of a direction all, or none."""
        wide: Flags = self.half.max(axis=0, initial=0.0) > 0.0
        for groups in self.directions:
            members = np.isin(self.groups, groups)
            wide[members] = wide[members].any()
        return np.flatnonzero(wide)

    @cached_property
    def banded_variables(self) -> tuple[Indices, Indices]:
        """Numbers (v,) of the variables that have a band, ascending.

        And which of these moves each banded column (n_banded,).
        """
        numbers, place = np.unique(self.variables[self.banded], return_inverse=True)
        return np.asarray(numbers, np.intp), np.asarray(place, np.intp)

    @cached_property
    def domain(self) -> Domain:
        """Where the variables that have a band, ascending, can lie."""
        place = self.banded_variables[1]
        first = self.banded[np.unique(place, return_index=True)[1]]
        directions = []
        for groups in self.directions:
            # In the order of the groups, which is that of the direction's axes.
            members = [np.flatnonzero(self.groups[first] == group) for group in groups]
            if all(member.size for member in members):
                directions.append(np.concatenate(members))
        return Domain.of([self.distribution[column] for column in first], directions)

    @cached_property
    def ends(self) -> tuple[Floats, Floats]:
        """(n or 1, k) lowest and highest deviation of each column, about the shift."""
        t = np.array([variable.ends for variable in self.distribution], np.float64).reshape(-1, 2)
        one, other = self.signed_half * t[:, 0], self.signed_half * t[:, 1]
        return np.minimum(one, other), np.maximum(one, other)

    @cached_property
    def edge_variables(self) -> Floats:
        """(2, k) variable of each column at its lower and upper edge; 0 of one that stays."""
        t = np.array([variable.ends for variable in self.distribution], np.float64).reshape(-1, 2)
        at_edges: Floats = np.where(self.edge, t.T, 0.0)
        return at_edges

    @cached_property
    def banded_correlation(self) -> Floats | None:
        """The correlation of the variables that have a band, ascending; None: all independent."""
        if self.correlation is None:
            return None
        numbers, _ = self.banded_variables
        correlation: Floats = self.correlation[np.ix_(numbers, numbers)]
        return None if np.array_equal(correlation, np.eye(numbers.size)) else correlation

    def at_edge(self, side: float) -> Floats:
        """(n or 1, k) deviations with lengths and offsets at an end of their bands.

        `side` -1 is the lower end of their variables, +1 the upper one (`shift - half` and
        `shift + half`, but for listed values that are not symmetric); all other columns stay at
        their shift. Members of a group go to the ends of their common variable, so that one with a
        negative sign moves the other way: other corners of the band cannot happen.
        """
        t = abs(side) * self.edge_variables[int(side > 0.0)]
        moved: Floats = self.shift + self.signed_half * t
        return moved


def _table(values: ArrayLike, count: int) -> Floats:
    table = np.asarray(values, np.float64)
    if table.ndim < 2:
        table = np.broadcast_to(table, (1, count))
    return np.ascontiguousarray(table)


class Source(Protocol):
    """An error source, built from what the machine file says about it.

    `tables` names the keys that it reads of each table of the file, as one pydantic model a
    table. `sets_overall_edges`: the overall error's minimum and maximum are taken with this
    source at its band edges (equations 3-6 of the paper); other sources stay at their shift.

    A source whose shift depends on the pose may also have `over_region`, which says how, so that
    bounds over a region can enclose it: see `truepose.uncertainty_analysis.bounds_over_region`.
    One that is what gives way under loads says under which by `yields_under`, a `Cause`; one that
    stands anywhere in a play while little presses on it has `dead_zones(machine)`, a `DeadZone` a
    column: so that a page can evaluate it anew (`truepose.live`).
    """

    name: ClassVar[str]
    doc: ClassVar[str]
    tables: ClassVar[Mapping[str, type[BaseModel]]]
    sets_overall_edges: ClassVar[bool]

    @classmethod
    def build(cls, parts: SourceBuilder) -> Self | None:
        """The source, or None when the file says nothing about it.

        Wrong or missing data are recorded with `parts.refuse`: the load fails once every source
        was asked.
        """
        ...

    def acts(self, condition: Condition) -> bool:
        """Whether a budget in this condition has a row for the source."""
        ...

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        """What the source does to the parameters at the poses of `block`.

        Raises `TrueposeError` where the condition asks for what the machine does not say.
        """
        ...


__all__ = [
    "ARCSINE",
    "OWN_GROUP",
    "TRIANGULAR",
    "TWO_POINT",
    "UNIFORM",
    "Deviation",
    "Distribution",
    "GroupQuantity",
    "Source",
    "normal",
]
