"""Which one band must be made tighter, and by how much, so that the accuracy asked is kept.

A band is what one drawing or data sheet says of parts that are alike, such as the length of all
struts: the variables of one source whose names differ in the part and the axis alone. The share of
its width at which the largest error comes down to the target is found to first order, by bisection,
and the verdict is then asked of the machines inside the narrower band.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.error_budget.largest import largest
from truepose.machine import Condition, Machine
from truepose.runs.arguments import checked
from truepose.runs.first_order import first_order
from truepose.runs.poses import OK
from truepose.runs.quantities import quantities
from truepose.runs.variables import Variables
from truepose.uncertainty_analysis.random_points import Drawing
from truepose.verdict.accuracy import answers, required_states
from truepose.verdict.answer import AFTER, Answer
from truepose.verdict.states import Population

LEAST = 0.05
"""Share of its width below which no band can be made: nobody makes rods twenty times better."""

PERCENT = 100
"""Shares are looked for in these parts of the whole."""

TRIES = 3
"""Verdicts asked of one band, each of a narrower one."""

MOST_POSES = 500
"""Poses at which bands are compared, those of the largest errors; the verdict is of all."""

MOST_SAMPLED, DRAWS = 4, 4000
"""At a coverage bands are compared at these few of them, with so many machines one."""

SEED = 0

_PART = re.compile(r"^(?P<kind>\w++)\.(?P<part>[^.]++)\.(?P<key>[\w.]*+)$")
_AXIS = re.compile(r"\.[xyz]$")
_COUNT = re.compile(r" \([0-9]++\)$")


@dataclass(frozen=True)
class ToleranceBand:
    """What is made tighter together: its `name`, such as strut.*.length, and its `source`."""

    name: str
    source: str

    @property
    def shown(self) -> str:
        """Its name, with its source where that is not a tolerance of the machine."""
        return self.name if self.source == "tolerance" else f"{self.source}: {self.name}"

    def members(self, variables: Variables) -> Flags:
        """(n_variable,) which of the variables it has."""
        named = zip(variables.names, variables.sources, strict=True)
        return np.array([band_of(name, source) == self for name, source in named], np.bool_)

    def tightened(self, variables: Variables, share: float) -> Variables:
        """The same variables, its own over a `share` of their widths."""
        scale = np.where(self.members(variables), share, 1.0)
        return dataclasses.replace(
            variables, half_width=variables.half_width * scale[variables.variable_of]
        )


@dataclass(frozen=True)
class Tightening:
    """One band over a `share` of its width, and the `answers` that the verdict then gives.

    `parts`: how many variables it has; `width`: from end to end as it is, m, rad or 1, NaN where
    its variables differ in that, and `unit`, "m" or "rad" or "".
    """

    band: ToleranceBand
    share: float
    answers: tuple[Answer, ...]
    parts: int
    width: float
    unit: str

    @property
    def enough(self) -> bool:
        """Whether everything asked is then met."""
        return all(answer.met is not False for answer in self.answers)


def band_of(name: str, source: str) -> ToleranceBand:
    """The band of a variable of a source.

    What tells it from another variable of its name, its source before it or a count behind it, is
    not its band's.
    """
    part = _PART.match(_COUNT.sub("", name.removeprefix(f"{source}: ")))
    if part is None:
        return ToleranceBand(name, source)
    return ToleranceBand(f"{part['kind']}.*.{_AXIS.sub('', part['key'])}", source)


@checked
def tightening(
    machine: Machine, condition: Condition | None = None, *, state: str = AFTER
) -> Tightening | None:
    """The band whose least tightening keeps the accuracy asked; where none does, the best.

    Over the file's workspace in one `state`, "before compensation" or "after compensation";
    `condition`, default the file's. Of the best band that is not enough the `share` is
    `LEAST`. None where nothing is asked, where all is met as it is to first order, or where there
    is no band.

    Raises as `truepose.accuracy`.
    """
    (state,) = required_states((state,))
    compared = _Compared.of(Population(machine, condition=condition), state)
    if compared is None:
        return None
    if float(compared.sizes(np.ones(len(compared.variables.names))).max()) <= 1.0:
        return None
    tried = {band: compared.size(band, LEAST) for band in compared.bands}
    enough = [band for band, size in tried.items() if size <= 1.0]
    if not enough:
        best = min(tried, key=lambda band: tried[band])
        return compared.asked(condition, best, LEAST)
    shares = {band: compared.widest(band) for band in enough}
    best = max(shares, key=lambda band: shares[band])
    asked = None
    for less in range(TRIES):
        percents = max(shares[best] - less**2, round(LEAST * PERCENT))
        asked = compared.asked(condition, best, percents / PERCENT)
        if asked.enough:
            break
    return asked


@dataclass(frozen=True, eq=False)
class _Compared:
    """Errors to first order at the worst poses of a state, for any widths of the bands.

    `errors`: for each quantity that is asked, the columns and the target; `value` (n, m),
    `effects` (n, m, v). `t` (s, v): machines drawn, where a share `probability` of all counts.
    """

    machine: Machine
    state: str
    variables: Variables
    bands: tuple[ToleranceBand, ...]
    asked_of: Mapping[str, tuple[Indices, float]]
    value: Floats
    effects: Floats
    probability: float | None
    t: Floats

    @classmethod
    def of(cls, population: Population, state: str) -> _Compared | None:
        """None where nothing is asked or nothing is unknown."""
        machine = population.machine
        kinds = quantities(machine.components)
        targets = {
            "position": machine.accuracy.target,
            "orientation": machine.accuracy.angle_target,
        }
        asked = {
            kind: (columns, limit)
            for kind, columns in kinds.items()
            if (limit := targets[kind]) is not None
        }
        if not asked:
            return None
        first = next(iter(population.states(state)))
        variables, at = first.variables, machine.accuracy.at
        if not variables.names:
            return None
        shape = (0, len(machine.components))
        compared = cls(
            machine,
            state,
            variables,
            tuple(dict.fromkeys(map(band_of, variables.names, variables.sources))),
            asked,
            np.empty(shape),
            np.empty((*shape, len(variables.names))),
            at,
            np.empty((0, len(variables.names))),
        )
        for part in population.states(state):
            value, effects, status = first_order(machine, part.block, part.variables)
            # Where machines are lost it is no matter of widths alone.
            lost = (part.status != OK).any() or (status != OK).any()
            if lost or part.variables.names != variables.names:
                return None
            compared = dataclasses.replace(
                compared,
                value=np.concatenate([compared.value, value]),
                effects=np.concatenate([compared.effects, effects]),
            ).at_worst(MOST_POSES)
        return compared if at is None else compared.at_worst(MOST_SAMPLED).with_draws()

    def at_worst(self, count: int) -> _Compared:
        """At so many poses at most, those of the largest errors as the bands are."""
        sizes = self.sizes(np.ones(len(self.variables.names)))
        worst = np.argsort(-sizes, kind="stable")[:count]
        return dataclasses.replace(self, value=self.value[worst], effects=self.effects[worst])

    def with_draws(self) -> _Compared:
        """With machines drawn."""
        of = self.variables
        drawing = Drawing(
            of.distributions,
            of.correlation,
            of.streams,
            of.numbers,
            of.names,
            SEED,
            of.directions,
        )
        return dataclasses.replace(self, t=drawing.variables(drawing.points(0).next(DRAWS)))

    def sizes(self, scale: Floats) -> Floats:
        """(n,) the largest error at each pose, by its target, with bands of `scale` (v,) widths."""
        effects = self.effects * scale
        of, limits = zip(*self.asked_of.values(), strict=True)
        if len(self.t):
            length = np.stack([self._quantile(effects, columns) for columns in of], axis=1)
        else:
            length = largest(self.value, effects, self.variables.domain, of).length
        return np.asarray((length / np.array(limits)).max(axis=1))

    def _quantile(self, effects: Floats, columns: Indices) -> Floats:
        """(n,) what the share of the machines drawn stays below."""
        assert self.probability is not None
        errors = self.value[:, None, columns] + np.einsum(
            "ncv,sv->nsc", effects[:, columns], self.t
        )
        return np.asarray(
            np.quantile(np.linalg.norm(errors, axis=2), self.probability, axis=1, method="higher")
        )

    def size(self, band: ToleranceBand, share: float) -> float:
        """The largest error by its target, with one band over a share of its width."""
        scale = np.where(band.members(self.variables), share, 1.0)
        return float(self.sizes(scale).max())

    def widest(self, band: ToleranceBand) -> int:
        """The largest percentage of its width that is enough; at `LEAST` it is."""
        low, high = round(LEAST * PERCENT), PERCENT
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (
                (middle, high) if self.size(band, middle / PERCENT) <= 1.0 else (low, middle)
            )
        return low

    def asked(self, condition: Condition | None, band: ToleranceBand, share: float) -> Tightening:
        """What the verdict is with one band over a share of its width."""
        population = Population(
            self.machine,
            condition=condition,
            changed=lambda variables: band.tightened(variables, share),
        )
        variables = self.variables
        columns = np.flatnonzero(band.members(variables)[variables.variable_of])
        lower, upper = variables.domain.lower, variables.domain.upper
        ends = (upper - lower)[variables.variable_of[columns]]
        widths = np.abs(variables.half_width[:, columns]) * ends
        alike = np.ptp(widths) <= 1e-9 * widths.max()
        units = {self.machine.units[column] for column in variables.columns[columns]}
        return Tightening(
            band,
            share,
            tuple(answers(population, self.state)),
            int(band.members(variables).sum()),
            float(widths.max()) if alike else float("nan"),
            units.pop() if len(units) == 1 else "",
        )


__all__ = ["LEAST", "Tightening", "ToleranceBand", "band_of", "tightening"]
