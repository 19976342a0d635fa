"""The tab of studies: stores in the machine's folder, and which of their variants are the best.

A study is made by `truepose study`; here it is read, while it is still running too.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.arrays import Indices
from truepose.errors import Problem, RequestError
from truepose.studies.block import FAILED, INFEASIBLE, NOT_COMPUTED, OK
from truepose.studies.dataset import KEY
from truepose.studies.ranking import causes, ranked
from truepose.studies.store import ENDING, StudyStore, require_packages
from truepose.studio.answers import EDITS, Question, Value, finite
from truepose.studio.inside import folder_to_read

if TYPE_CHECKING:
    import xarray as xr

NAME = "studies"
FOLLOWS = frozenset({EDITS})

MOST_STORES = 50
"""Stores that are listed, in the order of their names."""

MOST_VARIANTS, MOST_SETTINGS, LEAST_VARIANTS = 40, 240, 4
"""Variants that are told, and settings of them together; so many are told of however many."""

MOST_DRAWN, MOST_AXES = 200, 6
"""Variants that are drawn, chosen evenly by their size, over so many variables."""

MOST_CAUSES = 5
"""Reasons of variants that are not ok, the most frequent first."""


def give(question: Question) -> Iterator[Value]:
    """The studies beside the file, and one of them, where one is named.

    Raises `RequestError` (bad-argument, extra-missing, file-missing) and as `StudyStore`.
    """
    stores = sorted(_studies(question.folder))
    left_out = max(0, len(stores) - MOST_STORES)
    told: dict[str, Any] = {"stores": stores[:MOST_STORES], "stores_left_out": left_out}
    name = question.options.get("store")
    if name is None:
        yield told
        return
    if not isinstance(name, str):
        raise RequestError(
            Problem("bad-argument", "store: expected the name of a store", found=str(name)[:80])
        )
    require_packages()
    store = StudyStore(folder_to_read(question.folder, name))
    accuracy = question.machine.accuracy
    asked = {"position": accuracy.target, "orientation": accuracy.angle_target}
    yield told | {"study": {"store": name, "asked": asked, **_told(store.key, store.read())}}


def _studies(folder: Path) -> Iterator[str]:
    """Names of the stores of studies in a folder, and in no other that a link leads to."""
    for place in folder.glob(f"*{ENDING}"):
        try:
            folder_to_read(folder, place.name)
            about = json.loads((place / "zarr.json").read_text(encoding="utf-8"))
            is_study = KEY in about["attributes"]
        except (RequestError, OSError, ValueError, TypeError, LookupError):
            continue
        if is_study:
            yield place.name


def _told(key: dict[str, Any], dataset: xr.Dataset) -> dict[str, Any]:
    status, variables = dataset["status"].values, list(map(str, dataset["variable"].values))
    best = ranked(dataset)
    most = max(LEAST_VARIANTS, min(MOST_VARIANTS, MOST_SETTINGS // len(variables)))
    words = (OK, INFEASIBLE, FAILED, NOT_COMPUTED)
    return {
        "machine_hash": key["machine_hash"],
        "settings": [list(one.split("=", 1)) for one in key["settings"]],
        "variants": status.size,
        "counts": {word: int((status == word).sum()) for word in words},
        "variables": variables,
        "units": list(map(str, dataset["variable_units"].values)),
        "rows": [_row(dataset, number) for number in best[:most].tolist()],
        "left_out": max(0, best.size - most),
        "causes": [asdict(one) for one in causes(dataset)[:MOST_CAUSES]],
        "drawn": _drawn(dataset, best, variables),
    }


def _row(dataset: xr.Dataset, number: int) -> dict[str, Any]:
    row: dict[str, Any] = {
        "number": number,
        "settings": list(map(str, dataset["setting"].values[number])),
        "reach": float(dataset["reach"].values[number]),
    }
    for name in ("known", "linear_maximum"):
        if name in dataset:
            row[name] = _by_quantity(dataset, dataset[name].values[number])
    if "answer" in dataset:
        row["answers"] = {
            str(state): list(map(str, answers))
            for state, answers in zip(
                dataset["state"].values, dataset["answer"].values[number], strict=True
            )
        }
    return row


def _by_quantity(dataset: xr.Dataset, values: Any) -> dict[str, Any]:
    names = map(str, dataset["quantity"].values)
    return {name: finite(value) for name, value in zip(names, values, strict=True)}


def _drawn(dataset: xr.Dataset, best: Indices, variables: list[str]) -> dict[str, Any]:
    """The largest errors of variants, over those variables that are numbers."""
    if not best.size or "linear_maximum" not in dataset:
        return {"numbers": [], "axes": {}, "sizes": {}}
    if best.size > MOST_DRAWN:
        evenly = np.linspace(0, best.size - 1, MOST_DRAWN).round().astype(np.intp)
        best = best[evenly]
    values = dataset["value"].values[best]
    axes = [at for at in range(len(variables)) if np.isfinite(values[:, at]).all()][:MOST_AXES]
    sizes = dataset["linear_maximum"].values[best]
    names = map(str, dataset["quantity"].values)
    return {
        "numbers": best.tolist(),
        "axes": {variables[at]: values[:, at].tolist() for at in axes},
        "sizes": {name: [finite(size) for size in sizes[:, at]] for at, name in enumerate(names)},
    }


__all__ = ["FOLLOWS", "NAME", "give"]
