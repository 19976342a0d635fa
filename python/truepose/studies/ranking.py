"""The best variants of a study, and why the others are not ok."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.studies.block import FAILED, INFEASIBLE, OK
from truepose.studies.dataset import KEY
from truepose.studies.objectives import MINIMISE, OBJECTIVES, Objective

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class WhyNotOk:
    """Why variants are not ok: of which `status`, how many, the `first` and what is said of it."""

    status: str
    count: int
    first: int
    reason: str


def objective_of(dataset: xr.Dataset) -> Objective:
    """What makes a variant better: what was minimised, or the linear maximum of the position."""
    asked = json.loads(dataset.attrs.get(KEY, "{}")).get(MINIMISE)
    return OBJECTIVES[asked or "error"]


def ranked(dataset: xr.Dataset) -> Indices:
    """Numbers of the variants that are ok, the best by `objective_of` first.

    In the order of the plan where the study has no such number.
    """
    fine = np.flatnonzero(dataset["status"].values == OK)
    objective = objective_of(dataset)
    if objective.variable in dataset:
        fine = fine[np.argsort(objective.of(dataset)[fine], kind="stable")]
    return fine.astype(np.intp)


def pareto(sizes: Floats) -> Flags:
    """(n,) which of n variants none other beats: is as small in every size (n, k), smaller in one.

    Of equal variants all are on the front, or none.
    """
    order = np.lexsort(sizes.T[::-1])
    on_front = np.zeros(len(sizes), np.bool_)
    front = np.empty((0, sizes.shape[1]))
    # Whoever beats a variant comes before it in this order, and so does one of the front that does.
    for number in order.tolist():
        own = sizes[number]
        beaten = (front <= own).all(axis=1) & (front < own).any(axis=1)
        if not beaten.any():
            on_front[number] = True
            front = np.vstack([front, own])
    return on_front


def causes(dataset: xr.Dataset) -> list[WhyNotOk]:
    """Each cause of variants that are not ok, the most frequent first."""
    status, codes = dataset["status"].values, dataset["code"].values
    groups: dict[tuple[str, str], list[int]] = {}
    for number in np.flatnonzero((status == INFEASIBLE) | (status == FAILED)).tolist():
        groups.setdefault((str(status[number]), str(codes[number])), []).append(number)
    rows = sorted(groups.items(), key=lambda cause: -len(cause[1]))
    reasons = dataset["reason"].values
    return [WhyNotOk(word, len(of), of[0], str(reasons[of[0]])) for (word, _), of in rows]


__all__ = ["WhyNotOk", "causes", "objective_of", "pareto", "ranked"]
