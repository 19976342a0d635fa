"""The tab of the calibration: what a dropped file of measurements says of the machine.

With the defaults of `truepose calibrate`. The file is read from memory; a temporary one is never
made of it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.calibration.calibrate import calibrate
from truepose.calibration.measurements.read_csv import measurements_of_text
from truepose.calibration.planning.plan import counted_poses, plan
from truepose.errors import Problem, RequestError
from truepose.runs.quantities import quantities
from truepose.studio.answers import EDITS, DroppedFile, Question, Value, finite

if TYPE_CHECKING:
    import xarray as xr

    from truepose.calibration.measurements import Measurements

NAME = "calibration"
FOLLOWS = frozenset({EDITS})

MOST_RESIDUALS = 200
"""Readings that are told, those farthest off first."""
MOST_UNKNOWNS = 100
"""Unknowns that are told, those that the measurements say most of first."""


def give(question: Question) -> Iterator[Value]:
    """The verdict, suspicions, residuals and unknowns; empty where no file is named.

    Raises `RequestError` with every problem of the file, and as `truepose.calibrate`.
    """
    number = question.options.get("file")
    if number is None:
        yield {}
        return
    dropped = question.files.get(number) if isinstance(number, int) else None
    if dropped is None:
        raise RequestError(
            Problem(
                "file-missing",
                "there is no such dropped file",
                found=str(number)[:80],
                expected="one that is held in memory; drop it again",
            )
        )
    data = measurements_of_text(dropped.name, dropped.content, _text(dropped), question.machine)
    told = _told(calibrate(question.machine, data).dataset, question)
    yield told
    count = question.options.get("plan")
    if count is not None:
        yield told | {"planned": _planned(question, data, count)}


def _planned(question: Question, data: Measurements, count: Any) -> dict[str, Any]:
    """The poses to measure next with the instruments of the file, and what they buy.

    Raises as `truepose.plan`.
    """
    planned = plan(
        question.machine, data.instruments, counted_poses(count), progress=question.progress
    )
    kinds = list(quantities(question.machine.components))
    return {
        "poses": planned.poses.tolist(),
        "rank": planned.rank.tolist(),
        "rms": {kind: [finite(v) for v in planned.rms[:, at]] for at, kind in enumerate(kinds)},
    }


def _text(dropped: DroppedFile) -> str:
    try:
        return dropped.content.decode("utf-8-sig")
    except UnicodeDecodeError as failure:
        raise RequestError(
            Problem(
                "not-utf8",
                "the file is not UTF-8 text",
                dropped.name,
                found=f"the byte 0x{dropped.content[failure.start]:02x}",
                expected="UTF-8 text",
                hint="save the file as UTF-8",
            )
        ) from None


def _told(result: xr.Dataset, question: Question) -> dict[str, Any]:
    attrs = result.attrs
    return {
        "accepted": bool(attrs["accepted"]),
        "answer": str(attrs["answer"]),
        "reasons": json.loads(attrs["reasons"]),
        "suspicions": [
            {key: suspicion.get(key) for key in ("code", "sentence", "refuses")}
            for suspicion in json.loads(attrs["suspicions"])
        ],
        "residuals": _residuals(result, question),
        "unknowns": _unknowns(result),
        "fit": {
            name: finite(attrs[name])
            for name in ("rms_before", "rms_after", "birge", "degrees_of_freedom", "observations")
        },
    }


def _residuals(result: xr.Dataset, question: Question) -> list[dict[str, Any]]:
    """Each reading with its pose, and its residual over its uncertainty, before and after."""
    after = result["normalised_after"].values
    order = np.argsort(-np.nan_to_num(np.abs(after)), kind="stable")[:MOST_RESIDUALS]
    dof = question.machine.dof
    told = []
    for at in order.tolist():
        row = int(result["observation_row"].values[at])
        told.append(
            {
                "line": int(result["row_line"].values[row]),
                "pose": [finite(result[f"row_{name}"].values[row]) for name in dof],
                "observable": str(result["observation_what"].values[at]),
                "residual": finite(after[at]),
                "residual_before": finite(result["normalised_before"].values[at]),
            }
        )
    return told


def _unknowns(result: xr.Dataset) -> list[dict[str, Any]]:
    share = result["data_share"].values
    order = np.argsort(-np.nan_to_num(share), kind="stable")[:MOST_UNKNOWNS]
    return [
        {
            "name": str(result["unknown"].values[at]),
            "label": str(result["unknown_label"].values[at]),
            "unit": str(result["unknown_units"].values[at]),
            "found": finite(result["value"].values[at]),
            "uncertainty": finite(result["standard_uncertainty"].values[at]),
            "uncertainty_before": finite(result["prior_uncertainty"].values[at]),
            "share": finite(share[at]),
        }
        for at in order.tolist()
    ]


__all__ = ["FOLLOWS", "NAME", "give"]
