"""Blunders in a table of readings, one at a time, and what a person should be told of each.

A blunder of no size is made as people make it. A graded one has a size: `factor` times that at
which it is detected in 99 % of cases. That size is *linearised*: a signature b, the whitened change
of the readings for a unit of the blunder, is seen in the residuals as b^T M b, M what the fit
leaves of them (tolerances count as equations). A normal statistic with threshold 5.3, which chance
passes once in ten million, is passed in 99 % of cases where size x sqrt(b^T M b) is 7.6.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from calibration_study.kinematics import NoRootError
from calibration_study.truth import (
    Floats,
    Random,
    Table,
    Twin,
    assembled_elsewhere,
)
from truepose.calibration.identification.equations import whitened
from truepose.calibration.identification.placement import place_instruments
from truepose.calibration.identification.problem import IdentificationProblem, Prior
from truepose.calibration.identification.unknowns import unknowns_of
from truepose.calibration.measurements.read_csv import read_measurements
from truepose.errors import TrueposeError

DETECTED = 7.6
"""Standard deviations of the likeliest statistic: 99 % are above a threshold of 5.3."""
FACTORS = (1.0, 10.0)
"""Of graded blunders, in sizes that are detected in 99 %."""
MOST = {"bumped": 5e-3, "drift": 5e-3, "scale": 0.05, "outliers": 50e-3}
"""Larger ones nobody would make: what is not detected below cannot be asked for."""


@dataclass(frozen=True, eq=False)
class Spoilt:
    """Readings with a blunder, and `mended`, as they should have been.

    `rows` that it is in where only some are; `size`, SI, of a graded one, `factor` times what is
    detected in 99 %, nan where nothing detects it. `again`: the same blunder in rows that are
    measured later: who has a sign wrong once has it wrong again.
    """

    table: Table
    mended: Table
    rows: tuple[int, ...] = ()
    size: float = float("nan")
    factor: float = float("nan")
    again: Callable[[Table], Table] = lambda table: table


@dataclass(frozen=True, eq=False)
class Measured:
    """What blunders are made in: a machine, good readings, where they may be written down."""

    twin: Twin
    table: Table
    csv: Callable[[Table], Path]
    factors: tuple[float, float] = FACTORS
    _seen: dict[str, Floats] = field(default_factory=dict)

    def residual_root(self) -> Floats | None:
        """(m, m) M: of whitened readings what the fit leaves, instruments' unknowns fitted too.

        Linearised at the machine as filed, with the derivatives of the fit; None where it fails.
        """
        if "M" not in self._seen:
            try:
                machine = self.twin.loaded
                data = read_measurements(self.csv(self.table), machine)
                unknowns = unknowns_of(machine, data)
                standing = place_instruments(machine, data).measurements
                problem = IdentificationProblem(machine, standing, unknowns)
                rows = whitened(problem, unknowns.prior_mean)
            except TrueposeError:
                return None
            held = Prior.of(unknowns).rows
            every = np.vstack([rows, held])
            scale = np.linalg.norm(every, axis=0)
            left, sizes, _ = np.linalg.svd(every / np.where(scale > 0, scale, 1.0), False)
            left = left[: len(rows), sizes > 1e-9 * sizes[0]]
            self._seen["M"] = np.eye(len(rows)) - left @ left.T
        return self._seen["M"]

    def detected(self, change: Floats) -> float:
        """Units of a change (n, n_column), SI, of the readings that are detected in 99 %."""
        left = self.residual_root()
        if left is None:
            return float("inf")
        signature = (change / self.table.instrument.deviations()).ravel()
        seen = float(signature @ left @ signature)
        # Less than a thousandth of a per cent left is the rounding of the projector.
        enough = seen > 1e-10 * float(signature @ signature)
        return DETECTED / np.sqrt(seen) if enough else float("inf")

    def graded(
        self, kind: str, changes: list[Floats], random: Random, rows: tuple[int, ...] = ()
    ) -> Spoilt:
        """The sum of changes (n, n_column), each of its own size, made to the readings."""
        low, high = self.factors
        factor = float(np.exp(random.uniform(np.log(low), np.log(high))))
        values, size, capped = self.table.values, 0.0, False
        for change in changes:
            own = factor * self.detected(change)
            if own > MOST[kind]:
                own = MOST[kind] * float(random.uniform(0.3, 1.0))
                capped = True
            size = max(size, own)
            values = values + own * change
        known = float("nan") if capped else factor
        return Spoilt(self.table.with_values(values), self.table, rows, size, known)


Maker = Callable[[Measured, Random], "Spoilt | None"]


@dataclass(frozen=True)
class Kind:
    """A kind of blunder: `make` gives None where it cannot be made.

    `words`: a pattern that "code: sentence" of the right answer matches; `instruments`: that it can
    be made with; `graded`: whether it has a size.
    """

    name: str
    words: str
    instruments: tuple[str, ...]
    make: Maker
    graded: bool = False

    def is_named(self, told: str, rows: set[int], spoilt: Spoilt) -> bool:
        """Whether this is what the text says, or, of rows, whether all of them are named."""
        if spoilt.rows and set(spoilt.rows) <= rows:
            return True
        return not spoilt.rows and bool(self.words) and bool(re.search(self.words, told, re.I))


def _always(table: Table, spoil: Callable[[Table], Table]) -> Spoilt:
    """What is wrong in every row, whenever it was measured."""
    return Spoilt(spoil(table), table, again=spoil)


def _exchanged(count: int, one: int, other: int) -> list[int]:
    order = list(range(count))
    order[one], order[other] = other, one
    return order


def _none(measured: Measured, random: Random) -> Spoilt:
    return Spoilt(measured.table, measured.table)


def _sign(measured: Measured, random: Random) -> Spoilt:
    """One column of the other sign; of heights all there is, of a known frame any."""
    sign = np.ones(measured.table.values.shape[1])
    sign[int(random.integers(sign.size))] = -1.0
    return _always(measured.table, lambda table: table.with_values(sign * table.values))


def _mirror(measured: Measured, random: Random) -> Spoilt:
    """A left-handed frame: two axes change places."""
    order = [1, 0, *range(2, measured.table.values.shape[1])]
    return _always(measured.table, lambda table: table.with_values(table.values[:, order]))


def _swap(measured: Measured, random: Random) -> Spoilt | None:
    """Two columns of readings of one unit exchanged, or two of commands."""
    table, twin = measured.table, measured.twin
    commanded = twin.description["commanded"]
    of_one_unit = [
        (i, j)
        for i in range(len(commanded))
        for j in range(i)
        if (commanded[i] in "abc") == (commanded[j] in "abc")
    ]
    if table.instrument.known and random.uniform() < 0.5:
        pairs = [(i, j) for i in range(table.values.shape[1]) for j in range(i)]
        one, other = pairs[int(random.integers(len(pairs)))]
        order = _exchanged(table.values.shape[1], one, other)
        return _always(table, lambda own: own.with_values(own.values[:, order]))
    one, other = of_one_unit[int(random.integers(len(of_one_unit)))]
    order = _exchanged(len(commanded), one, other)
    if twin.loaded.kernel.place(table.poses[:, order])[2].any():
        return None  # it would be refused for being out of reach
    return _always(table, lambda own: replace(own, poses=own.poses[:, order]))


def _unit(measured: Measured, random: Random) -> Spoilt:
    """All lengths in another unit than the file says."""
    factor = float(random.choice([1000.0, 25.4, 10.0, 1 / 25.4, 1 / 10.0, 1 / 1000.0]))
    lengths = measured.table.instrument.deviations() == measured.table.instrument.sigma["m"]
    factors = np.where(lengths, factor, 1.0)
    return _always(measured.table, lambda table: table.with_values(factors * table.values))


def _shifted(measured: Measured, random: Random) -> Spoilt:
    """Every reading one row beside its command: the first was lost, or the first command."""
    table = measured.table
    last, first = slice(None, -1), slice(1, None)
    kept, read = (last, first) if random.uniform() < 0.5 else (first, last)
    mended = replace(table, poses=table.poses[kept], values=table.values[kept])
    return Spoilt(mended.with_values(table.values[read]), mended)


def _way(measured: Measured, random: Random) -> Floats:
    """(n_column,) a unit of displacement of the instrument, in its own axes."""
    table = measured.table
    way = np.zeros(table.values.shape[1])
    lengths = [i for i, name in enumerate(table.instrument.columns) if name in "xyz"]
    way[lengths] = random.normal(size=len(lengths))
    return way / np.linalg.norm(way)


def _bumped(measured: Measured, random: Random) -> Spoilt:
    """The instrument stands elsewhere from some row on."""
    count = measured.table.count
    first = int(random.integers(count // 4, count - count // 4))
    step = (np.arange(count) >= first)[:, np.newaxis] * _way(measured, random)
    return _staying(measured.graded("bumped", [step], random))


def _drift(measured: Measured, random: Random) -> Spoilt:
    """It wanders, as far at the end as the size says, evenly with the rows."""
    count = measured.table.count
    trend = (np.arange(count) / (count - 1.0))[:, np.newaxis] * _way(measured, random)
    return _staying(measured.graded("drift", [trend], random))


def _staying(made: Spoilt) -> Spoilt:
    """Rows that are measured later are as far off as the last one."""
    last = made.table.values[-1] - made.mended.values[-1]
    return replace(made, again=lambda table: table.with_values(table.values + last))


def _scale(measured: Measured, random: Random) -> Spoilt:
    """Lengths are read too large, by a share."""
    table = measured.table
    lengths = table.instrument.deviations() == table.instrument.sigma["m"]
    sign = float(random.choice([-1.0, 1.0]))
    made = measured.graded("scale", [sign * np.where(lengths, table.values, 0.0)], random)
    factors = np.where(lengths, 1.0 + sign * made.size, 1.0)
    return replace(made, again=lambda own: own.with_values(factors * own.values))


def _outliers(measured: Measured, random: Random) -> Spoilt:
    """One to three readings off, none in the same row."""
    table = measured.table
    count = int(random.integers(1, 4))
    rows = random.choice(table.count, count, replace=False)
    changes = []
    for row in rows:
        change = np.zeros_like(table.values)
        change[row, int(random.integers(table.values.shape[1]))] = float(random.choice([-1.0, 1.0]))
        changes.append(change)
    named = tuple(sorted(int(row) for row in rows))
    return measured.graded("outliers", changes, random, named)


def _wrong_branch(measured: Measured, random: Random) -> Spoilt | None:
    """In one row the machine stood in another of the poses that its joints allow."""
    table, twin = measured.table, measured.twin
    for row in random.permutation(table.count)[:3].tolist():
        joints, near = twin.commanded(table.poses[row : row + 1])[0]
        try:
            placed = assembled_elsewhere(twin, joints, near, random)
        except NoRootError:
            continue
        if placed is not None:
            values = table.values.copy()
            read = table.instrument.read(placed, twin.built, joints)
            noise = table.instrument.deviations() * random.standard_normal(read.size)
            values[row] = read + noise
            return Spoilt(table.with_values(values), table, (row,))
    return None


ANY = ("tracker", "pose", "heights", "bar", "scales")
POINTS = ("tracker", "known tracker", "pose")

KINDS = {
    kind.name: kind
    for kind in (
        Kind("none", "", ANY, _none),
        Kind(
            "sign",
            r"flipped|\bsign|negat|mirror|left-handed|upside",
            ("known tracker", "heights"),
            _sign,
        ),
        Kind(
            "mirror", r"flipped|\bsign|mirror|left-handed|swapped|exchanged", ("tracker",), _mirror
        ),
        Kind("swap", r"swapped|exchanged|each other's place|flipped|mirror", POINTS[:2], _swap),
        Kind("unit", r"wrong-unit|\bunit of|by a factor|\binch", ("tracker", "pose", "bar"), _unit),
        Kind("shifted rows", r"shifted|one row too", (*POINTS, "bar"), _shifted),
        Kind("bumped", r"bump|\bstep|moved from|stands elsewhere", POINTS, _bumped, True),
        Kind("drift", r"drift|trend|wander", POINTS, _drift, True),
        Kind("scale", r"scale|ppm", (*POINTS, "bar"), _scale, True),
        Kind("outliers", r"outlier", ANY, _outliers, True),
        Kind("wrong branch", r"branch|assembl", POINTS, _wrong_branch),
    )
}
"""By name. Heights are probed on a bed, with machines that are commanded in x, y and z."""

__all__ = ["KINDS", "Kind", "Measured", "Spoilt"]
