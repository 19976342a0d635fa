"""The budget of a block in one call of the kernel (`crates/kernel/src/batch/budget.rs`).

There a pose is linearised once for all sources, and every number is written once, where it stays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.machine import Machine
from truepose.probability.domain import Domain
from truepose.runs import percent
from truepose.sources import Deviation, PoseBlock, Source


@dataclass(frozen=True)
class Filled:
    """What the kernel says of a block beside the tables: codes (n,), and what was highest.

    `shifts`: the first status that is not ok of the sources at their shifts, each alone and then
    all together; `bands`: of what bands do about them; `edges`: at the ends of bands. `highest`:
    of tables the highest magnitudes over the poses where all three are ok.
    """

    shifts: np.ndarray
    bands: np.ndarray
    edges: np.ndarray
    highest: Mapping[str, Floats]


@dataclass(frozen=True)
class _Cause:
    """A source as `Machine.budget_at` of the kernel reads it."""

    parameters: Indices
    shift: Floats
    half: Floats
    lower: list[float]
    upper: list[float]
    overall: bool
    variables: list[int]
    sigmas: list[float]
    plain: bool


def fill(
    machine: Machine,
    block: PoseBlock,
    sources: Sequence[Source],
    deviations: Sequence[Deviation],
    kinds: Sequence[Indices],
    tables: Mapping[str, np.ndarray],
) -> Filled:
    """Write the budget of the `sources` at the n poses of a block into `tables`, by their names.

    The deviations are those of the sources; `kinds`: the components of each length. What a source
    does whose variables are not plain (`is_plain`) is written as if it had no band, and so is the
    length of all sources where one's domain is no box of [-1, 1] (`in_boxes`).
    """
    shifts, bands, edges, highest = machine.kernel.budget_at(
        block.joints,
        block.placements,
        [_cause(source, deviation) for source, deviation in zip(sources, deviations, strict=True)],
        [kind.tolist() for kind in kinds],
        in_boxes(deviations),
        percent.smallest(machine),
        {name: tables[name] for name in TABLES},
    )
    return Filled(shifts, bands, edges, highest)


def is_plain(deviation: Deviation) -> bool:
    """Whether all variables lie in [-1, 1], each by itself and independent."""
    return _is_box(deviation.domain) and deviation.banded_correlation is None


def in_boxes(deviations: Sequence[Deviation]) -> bool:
    """Whether they do so but for correlations, which do not change how far they can go."""
    return all(_is_box(deviation.domain) for deviation in deviations)


def _is_box(domain: Domain) -> bool:
    return domain.symmetric and not domain.directions


def _cause(source: Source, deviation: Deviation) -> _Cause:
    banded, (_, place) = deviation.banded, deviation.banded_variables
    variables = np.full(deviation.parameters.size, -1, np.intp)
    variables[banded] = place
    first = banded[np.unique(place, return_index=True)[1]]
    lower, upper = deviation.edge_variables
    return _Cause(
        deviation.parameters,
        deviation.shift,
        deviation.signed_half,
        lower.tolist(),
        upper.tolist(),
        source.sets_overall_edges,
        variables.tolist(),
        [deviation.distribution[column].sigmas for column in first],
        is_plain(deviation),
    )


TABLES = (
    "error",
    "error_lower",
    "error_upper",
    "worst",
    "reach",
    "uncertainty",
    "percent_lower",
    "percent_upper",
    "largest",
    "overall_error",
    "overall_error_lower",
    "overall_error_upper",
    "overall_percent_lower",
    "overall_percent_upper",
    "linear_maximum",
)
"""What the kernel fills."""


__all__ = ["TABLES", "Filled", "fill", "in_boxes", "is_plain"]
