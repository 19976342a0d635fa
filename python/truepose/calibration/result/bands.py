"""What a machine file knows of its parameters: the bands of its tolerances as one covariance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.machine import Machine
from truepose.machine.families.parameters import is_of_family
from truepose.sources.tolerance import bands_of


@dataclass(frozen=True)
class ToleranceCovariance:
    """What tolerances say of the n parameters: `shift` (n,), and what varies about it.

    `effects` (n, v): +-1 times the standard deviation of each parameter, by the variable that it
    has; `correlation` (v, v) of the variables.
    """

    shift: Floats
    effects: Floats
    correlation: Floats

    @property
    def covariance(self) -> Floats:
        """(n, n) of all parameters, SI; zero where there is no tolerance."""
        return np.asarray(self.effects @ self.correlation @ self.effects.T)


def tolerance_covariance(machine: Machine, kept: Flags | None = None) -> ToleranceCovariance:
    """What the tolerances of a machine's file say of its parameters; `kept` (k,): these columns."""
    count = len(machine.parameters)
    bands = bands_of(machine)
    if bands is None:
        return ToleranceCovariance(np.zeros(count), np.zeros((count, 0)), np.zeros((0, 0)))
    some = np.ones(bands.parameters.size, np.bool_) if kept is None else kept
    shift = np.zeros(count)
    np.add.at(shift, bands.parameters, np.where(some, bands.shift[0], 0.0))
    effects = np.zeros((count, bands.n_variable))
    sigmas = np.array([distribution.sigmas for distribution in bands.distribution], np.float64)
    deviations = np.where(some, bands.signed_half[0] / sigmas, 0.0)
    np.add.at(effects, (bands.parameters, bands.variables), deviations)
    correlation = np.eye(bands.n_variable) if bands.correlation is None else bands.correlation
    return ToleranceCovariance(shift, effects, correlation)


@dataclass(frozen=True)
class Banded:
    """Bands to be written: one variable for each column, or for the columns of a group.

    `columns` (k,): parameters; `effects` (k, v): what one standard deviation of its one variable
    does to each, and one of every parameter of the family that moves it besides; `correlation`
    (v, v); `names` (v,) of groups and of the family's parameters, empty for a variable of one
    parameter. `deviations` (v,): standard ones, of the family's parameters in their own unit.
    """

    columns: Indices
    effects: Floats
    correlation: Floats
    names: tuple[str, ...]
    deviations: Floats

    def of_family(self) -> list[int]:
        """The variables that are parameters of the family."""
        return [at for at, name in enumerate(self.names) if is_of_family(name)]

    def own(self, column: int) -> int | None:
        """The variable of the k-th column that is no parameter of the family."""
        variables = np.flatnonzero(self.effects[column]).tolist()
        return next((at for at in variables if not is_of_family(self.names[at])), None)


_ROUNDING = 1e-12
"""Of the largest effect of an unknown: what is below is left by turning directions."""


def banded(columns: Indices, effects: Floats, covariance: Floats, names: tuple[str, ...]) -> Banded:
    """Variables for unknowns with `effects` (k, n) on columns (k,) and `covariance` (n, n).

    An unknown that shares its parameters with no other becomes a variable, of a group where it
    moves several. Where unknowns share parameters, which a machine file cannot say, each of these
    parameters has a variable of its own, and the covariance is the same. A parameter of the family
    is a variable in any case, for it may share what it moves.
    """
    effects = np.where(
        np.abs(effects) > _ROUNDING * np.abs(effects).max(axis=0, initial=0.0), effects, 0.0
    )
    effects = effects * (np.diagonal(covariance) > 0.0)
    moved = np.flatnonzero(effects.any(axis=1))
    rows: list[Floats] = []
    called: list[str] = []
    mixed: list[int] = []
    of_family = np.array([is_of_family(name) for name in names], np.bool_)
    shared = _shared(np.where(of_family, 0.0, effects))
    column_effects: list[tuple[int, int, float]] = []
    for unknown in range(effects.shape[1]):
        members: list[int] = np.flatnonzero(effects[:, unknown]).tolist()
        if shared[unknown]:
            mixed += members
        if shared[unknown] or not members:
            continue
        row = np.zeros(effects.shape[1])
        # A parameter's own variable is its deviation; a group's is the unknown, whatever the signs.
        alone = len(members) == 1 and not of_family[unknown]
        row[unknown] = np.sign(effects[members[0], unknown]) if alone else 1.0
        for member in members:
            effect = float(effects[member, unknown] * row[unknown])
            column_effects.append((member, len(rows), effect))
        rows.append(row)
        called.append("" if alone else names[unknown])
    for member in dict.fromkeys(mixed):
        column_effects.append((member, len(rows), 1.0))
        rows.append(np.where(of_family, 0.0, effects[member]))
        called.append("")
    to_variables = np.array(rows).reshape(len(rows), effects.shape[1])
    of_variables = to_variables @ covariance @ to_variables.T
    deviation = np.sqrt(np.diagonal(of_variables))
    scale = np.where(deviation > 0.0, deviation, 1.0)
    correlation = of_variables / np.outer(scale, scale)
    correlation = np.clip(0.5 * (correlation + correlation.T), -1.0, 1.0)
    np.fill_diagonal(correlation, 1.0)
    by_variable = np.zeros((len(columns), len(rows)))
    for at, variable, effect in column_effects:
        by_variable[at, variable] = effect * deviation[variable]
    return Banded(columns[moved], by_variable[moved], correlation, tuple(called), deviation)


def _shared(effects: Floats) -> list[bool]:
    """(n,) whether an unknown moves a parameter that others move too, or one linked to such."""
    linked = effects != 0.0
    shared = (linked & (linked.sum(axis=1) > 1)[:, np.newaxis]).any(axis=0)
    while True:
        touched = linked[:, shared].any(axis=1)
        more = (linked & touched[:, np.newaxis]).any(axis=0)
        if np.array_equal(more, shared):
            return [bool(flag) for flag in shared]
        shared = more
