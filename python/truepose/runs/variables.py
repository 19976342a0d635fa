"""Variables: what all sources leave unknown at the poses of a block, as one set of variables.

    deviation of the parameters = shift + sum over columns of half_width t[variable],   t in the
    domain

Each source brings its variables; which there are, their names and their numbers for drawing them
are worked out here once, for everything that combines them.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from truepose.arrays import Flags, Floats, Indices, sorted_union
from truepose.machine import Machine
from truepose.probability.domain import Domain
from truepose.representation import Represented
from truepose.runs.displacement import ParameterDeviation, sum_deviations
from truepose.sources import Deviation, PoseBlock, Source
from truepose.sources.deviation import Distribution
from truepose.sources.variation import Variation

STREAM_BYTES = 4
"""Of a hash: numbers of a variable and of its stream have room together in 64 bits."""

ROUNDING = 1e-14
"""By which a band is made wider where its middle and its half are rounded, so that none is lost."""


@dataclass(frozen=True, eq=False, repr=False)
class Variables(Represented):
    """The variables of all sources at the n poses of a block, and what they move.

    `shift`: parameters, each once, and their values (n or 1, k0) where all variables are 0;
    `alone`: the same of each source.
    `columns` (k,): kernel parameter of each column that has a band; one may repeat.
    `variable_of` (k,): which variable moves the column; `half_width` (n or 1, k): its deviation,
    m, rad or 1, where that variable is +1. `distributions`, `names` (unique) and `sources` of
    the n_variable variables, and the `domain` that they lie in. `streams`, `numbers`
    (n_variable,): identity for random numbers, whatever else acts: `stream_of` the source's name,
    and the variable's number in that source's deviation. `correlation`
    (n_variable, n_variable): Pearson's; None where all are independent. `variations` of the
    variables: what each varies with.
    """

    shift: ParameterDeviation
    alone: tuple[ParameterDeviation, ...]
    columns: Indices
    variable_of: Indices
    half_width: Floats
    distributions: tuple[Distribution, ...]
    names: tuple[str, ...]
    sources: tuple[str, ...]
    streams: Indices
    numbers: Indices
    correlation: Floats | None
    domain: Domain
    variations: tuple[Variation, ...]

    @property
    def directions(self) -> tuple[Indices, ...]:
        """Numbers of the variables that are together a unit vector."""
        return self.domain.directions

    @property
    def varies_along(self) -> Flags:
        """(n_variable,) whether two poses of one run may have two values of the variable."""
        return np.array([one.along_the_way for one in self.variations], np.bool_)

    def centred(self) -> Variables:
        """The same deviations with every single variable in [-1, 1], a band about its middle.

        For what needs a box about the shift; the distributions are no longer those of the
        variables.
        """
        if self.domain.symmetric:
            return self
        middle, half = self.domain.middle[self.variable_of], self.domain.half[self.variable_of]
        half = half * (1.0 + ROUNDING)
        ones = np.ones(len(self.names))
        return dataclasses.replace(
            self,
            shift=sum_deviations([self.shift, (self.columns, self.half_width * middle)]),
            half_width=self.half_width * half,
            domain=Domain(-ones, ones, self.directions),
        )

    def at(self, pose: int) -> Variables:
        """The same at one pose of the block."""
        return self.select(slice(pose, pose + 1))

    def select(self, poses: Flags | slice) -> Variables:
        """The same at some poses of the block, as `PoseBlock.select` has them."""
        return dataclasses.replace(
            self,
            shift=_rows(self.shift, poses),
            alone=tuple(_rows(shift, poses) for shift in self.alone),
            half_width=self.half_width if len(self.half_width) == 1 else self.half_width[poses],
        )

    def parameters_moved(self, t: Floats) -> ParameterDeviation:
        """Parameters, each once, and their deviations (s, k) where the variables are t (s, v).

        Of the variables at one pose.
        """
        parameters, shift, moves = self._matrix
        return parameters, shift + np.asarray(t, np.float64) @ moves

    @cached_property
    def _matrix(self) -> tuple[Indices, Floats, Floats]:
        """Parameters (k,), shift (1, k), and what each variable moves (n_variable, k), one pose."""
        parameters, shift = self.shift
        if len(shift) != 1 or len(self.half_width) != 1:
            raise ValueError("variables over several poses; take one of them with at()")
        every = sorted_union(parameters, self.columns)
        moves = np.zeros((len(self.names), every.size))
        np.add.at(
            moves, (self.variable_of, np.searchsorted(every, self.columns)), self.half_width[0]
        )
        centre = np.zeros((1, every.size))
        centre[:, np.searchsorted(every, parameters)] = shift
        moved = centre[0].astype(np.bool_) | moves.any(axis=0)
        return every[moved], centre[:, moved], moves[:, moved]


def variables_at(machine: Machine, block: PoseBlock, sources: Sequence[Source]) -> Variables:
    """All sources at the poses of `block`: the variables that have a band at one of them."""
    deviations = [source.deviation(machine, block.condition, block) for source in sources]
    return variables_of(machine, sources, deviations)


def variables_of(
    machine: Machine, sources: Sequence[Source], deviations: Sequence[Deviation]
) -> Variables:
    """The same from what each source says there."""
    parts = [
        _part(machine, source, deviation)
        for source, deviation in zip(sources, deviations, strict=True)
    ]
    counts = [len(part.names) for part in parts]
    first = np.cumsum([0, *counts])
    names = [name for part in parts for name in part.names]
    owners = [part.source for part in parts for _ in part.names]
    half_widths = [part.half_width for part in parts]
    rows = max((len(table) for table in half_widths), default=1)
    empty = np.empty(0, np.intp)
    alone = tuple((part.deviation.parameters, part.deviation.shift) for part in parts)
    return Variables(
        shift=sum_deviations(alone),
        alone=alone,
        columns=np.concatenate([empty, *(part.columns for part in parts)]),
        variable_of=np.concatenate(
            [empty, *(part.variable_of + at for part, at in zip(parts, first[:-1], strict=True))]
        ),
        half_width=np.concatenate(
            [
                np.empty((rows, 0)),
                *(np.broadcast_to(table, (rows, table.shape[1])) for table in half_widths),
            ],
            axis=1,
        ),
        distributions=tuple(distribution for part in parts for distribution in part.distributions),
        names=_unique(names, owners),
        sources=tuple(owners),
        streams=np.repeat([part.stream for part in parts], counts).astype(np.intp),
        numbers=np.concatenate([empty, *(part.numbers for part in parts)]),
        correlation=_correlation(parts, first),
        domain=Domain.of(
            [distribution for part in parts for distribution in part.distributions],
            [
                members + at
                for part, at in zip(parts, first[:-1], strict=True)
                for members in part.deviation.domain.directions
            ],
        ),
        variations=tuple(variation for part in parts for variation in part.variations),
    )


def stream_of(source: str) -> int:
    """The stream of random numbers of a source, by its name: others beside it do not change it."""
    return int.from_bytes(hashlib.sha256(source.encode()).digest()[:STREAM_BYTES], "big")


def _rows(moved: ParameterDeviation, poses: Flags | slice) -> ParameterDeviation:
    """Deviations at some poses of a block."""
    parameters, shift = moved
    return parameters, shift if len(shift) == 1 else shift[poses]


@dataclass(frozen=True, eq=False)
class _Part:
    """What one source brings: its columns that have a band, and their variables."""

    source: str
    stream: int
    deviation: Deviation
    columns: Indices
    variable_of: Indices
    half_width: Floats
    numbers: Indices
    names: tuple[str, ...]
    distributions: tuple[Distribution, ...]
    variations: tuple[Variation, ...]


def _part(machine: Machine, source: Source, deviation: Deviation) -> _Part:
    banded = deviation.banded
    numbers, variables = deviation.banded_variables
    columns = deviation.parameters[banded]
    first = [int(banded[np.flatnonzero(variables == at)[0]]) for at in range(numbers.size)]
    names = []
    for at, column in enumerate(first):
        moved = [machine.parameters[parameter] for parameter in columns[variables == at]]
        group = deviation.group_names.get(int(deviation.groups[column]))
        direction = any(at in members for members in deviation.domain.directions)
        if len(moved) == 1 and not direction and not deviation.of_quantities[column]:
            names.append(moved[0])
        else:
            names.append(group or f"{source.name}: {moved[0]} and others")
    return _Part(
        source=source.name,
        stream=stream_of(source.name),
        deviation=deviation,
        columns=columns,
        variable_of=variables,
        half_width=deviation.signed_half[:, banded],
        numbers=numbers,
        names=tuple(names),
        distributions=tuple(deviation.distribution[column] for column in first),
        variations=tuple(deviation.variation[column] for column in first),
    )


def _unique(names: Sequence[str], owners: Sequence[str]) -> tuple[str, ...]:
    """A name that several variables have goes with its source; if that is one too, with a count."""
    count = Counter(names)
    told = [
        name if count[name] == 1 or name.startswith(f"{owner}: ") else f"{owner}: {name}"
        for name, owner in zip(names, owners, strict=True)
    ]
    taken: set[str] = set()
    unique = []
    for name in told:
        number, tried = 1, name
        while tried in taken:
            number += 1
            tried = f"{name} ({number})"
        taken.add(tried)
        unique.append(tried)
    return tuple(unique)


def _correlation(parts: Sequence[_Part], first: Indices) -> Floats | None:
    """The sources' own, side by side: causes of different sources are independent."""
    correlations = [part.deviation.banded_correlation for part in parts]
    if all(correlation is None for correlation in correlations):
        return None
    matrix = np.eye(int(first[-1]))
    for at, correlation in enumerate(correlations):
        if correlation is not None:
            own = slice(int(first[at]), int(first[at + 1]))
            matrix[own, own] = correlation
    return matrix
