"""Results of `monte_carlo`, `worst_case`, `bounds` and `shares` made by hand, with their schemas.

Of a machine whose error is linear in its variables, `shift + effects @ t`, t uniform in [-1, 1]:
what each result must then be is known in closed form, or nearly.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from made_calibration import calibration
from truepose.reporting.study import Study
from truepose.reporting.uncertainty_tables import spread_over
from truepose.verdict.answer import Answer
from truepose.verdict.coverage import CoverageAnswer

Array = NDArray[np.float64]
PROBABILITY = 0.95
LEVELS = np.linspace(0.0, 1.0, 201)
PARAMETERS = ("strut.1.length", "strut.2.length", "drive.d1.offset", "batch A", "thermal: frame")
SOURCES = ("tolerance", "tolerance", "tolerance", "tolerance", "thermal")
SQUARED = "m^2, m rad, rad^2"


def sure_study(study: Study) -> Study:
    """The study with all these results: at two poses, the ellipses at up to 25; calibrated."""
    spread = spread_over(study.poses, study.positions)
    two = study.poses[[study.n_pose // 2, -1]] if study.n_pose > 1 else study.poses
    return replace(
        study,
        monte_carlo=monte_carlo(study.machine, two),
        ellipses=monte_carlo(study.machine, study.poses[spread]),
        worst_case=worst_case(study.machine, two),
        bounds=bounds(study.machine, two),
        shares=shares(study.machine, two),
        calibration=calibration(study.machine, study.poses),
        sampled=tuple(replace(each, coverage=drawn(each)) for each in study.sampled),
    )


def drawn(answer: Answer, draws: int = 4000) -> CoverageAnswer:
    """Machines whose squared lengths are uniform: 95 % of them are within the answer's number."""
    size, squares = answer.linear.value, (np.arange(draws) + 0.5) / draws
    return CoverageAnswer(
        answer.quantity,
        PROBABILITY,
        None,
        None,
        size,
        0.99 * size,
        1.01 * size,
        answer.linear.number,
        draws,
        0,
        0,
        1,
        1,
        1,
        size * np.sqrt(squares / PROBABILITY),
    )


def shift_and_effects(machine: Any, poses: Array) -> tuple[Array, Array]:
    """(pose, component) and (pose, component, parameter), m and rad."""
    place = (poses / 0.1).sum(axis=1)[:, None]
    component = np.arange(len(machine.components))
    shift = 1e-4 * np.cos(0.4 * place + component)
    turn = 0.3 * place[..., None] + component[:, None] + np.arange(len(PARAMETERS))
    size = np.array([3e-5, 2e-5, 5e-6, 1e-5, 1e-6])
    return shift, size * (1.5 + np.sin(turn))


def monte_carlo(machine: Any, poses: Array, count: int = 4000, **attrs: Any) -> xr.Dataset:
    """What `tp.monte_carlo` gives, from as many samples at each pose."""
    shift, effects = shift_and_effects(machine, poses)
    t = np.random.default_rng(1).uniform(-1.0, 1.0, (count, len(PARAMETERS)))
    error = shift[:, None] + np.einsum("pck,sk->psc", effects, t)
    lower, upper = (1 - PROBABILITY) / 2, (1 + PROBABILITY) / 2
    groups = _groups(machine)
    magnitude = np.stack([np.linalg.norm(error[..., at], axis=-1) for at in groups.values()], -1)
    covariance = np.stack([np.cov(each.T).reshape(2 * (each.shape[1],)) for each in error])
    position = error[..., : len(groups["position"])]
    within = covariance[:, : position.shape[-1], : position.shape[-1]]
    off = position - position.mean(axis=1, keepdims=True)
    distance = np.einsum("psi,pij,psj->ps", off, np.linalg.inv(within), off)
    reach = np.quantile(distance, PROBABILITY, axis=1)[:, None, None]
    each, size = ("pose", "component"), ("pose", "quantity")
    data = {
        "mean": (each, error.mean(axis=1), "c"),
        "standard_deviation": (each, error.std(axis=1, ddof=1), "c"),
        "lower": (each, np.quantile(error, lower, axis=1), "c"),
        "upper": (each, np.quantile(error, upper, axis=1), "c"),
        "shortest_lower": (each, np.quantile(error, lower + 0.001, axis=1), "c"),
        "shortest_upper": (each, np.quantile(error, upper + 0.001, axis=1), "c"),
        "minimum": (each, error.min(axis=1), "c"),
        "maximum": (each, error.max(axis=1), "c"),
        "covariance": ((*each, "other_component"), covariance, SQUARED),
        "quantile": ((*each, "level"), np.moveaxis(np.quantile(error, LEVELS, 1), 0, -1), "c"),
        "magnitude_mean": (size, magnitude.mean(axis=1), "q"),
        "magnitude_upper": (size, np.quantile(magnitude, PROBABILITY, axis=1), "q"),
        "magnitude_maximum": (size, magnitude.max(axis=1), "q"),
        "magnitude_quantile": (
            (*size, "level"),
            np.moveaxis(np.quantile(magnitude, LEVELS, axis=1), 0, -1),
            "q",
        ),
        "ellipse_centre": (("pose", "axis"), position.mean(axis=1), "m"),
        "ellipse": (("pose", "axis", "other_axis"), within * reach, "m^2"),
        "samples": (("pose",), np.full(len(poses), count), "1"),
        "failed": (("pose",), np.zeros(len(poses), int), "1"),
    }
    axes = [machine.components[at] for at in groups["position"]]
    coords = {
        "other_component": list(machine.components),
        "level": LEVELS,
        "axis": axes,
        "other_axis": axes,
    }
    given = {"seed": 7, "probability": PROBABILITY, "sampling": "random", "digits": 0}
    return _dataset(machine, poses, data, coords, given | {"interrupted": 0} | attrs)


def worst_case(machine: Any, poses: Array) -> xr.Dataset:
    """What `tp.worst_case` gives: of a linear machine, one number by both roads."""
    lower, upper, magnitude = _box(machine, poses)
    exact = np.maximum(np.abs(lower), np.abs(upper))
    each, size = ("pose", "component"), ("pose", "quantity")
    data = {
        "linear": (each, exact, "c"),
        "exact": (each, exact, "c"),
        "exact_lower": (each, lower, "c"),
        "exact_upper": (each, upper, "c"),
        "magnitude_linear": (size, 1.1 * magnitude, "q"),
        "magnitude_exact": (size, magnitude, "q"),
        "search": (("pose",), np.full(len(poses), "every vertex"), "1"),
        "vertices": (("pose",), np.full(len(poses), 2 ** len(PARAMETERS)), "1"),
    }
    return _dataset(machine, poses, data)


def bounds(machine: Any, poses: Array, status: str = "proven") -> xr.Dataset:
    """What `tp.bounds` gives at poses: 5 % outside of what is reached."""
    lower, upper, magnitude = _box(machine, poses)
    wide = 0.05 * (upper - lower)
    each, size = ("pose", "component"), ("pose", "quantity")
    lost = np.array([status != "proven"] * len(poses))
    lost[1:] = False
    data = {
        "lower": (each, np.where(lost[:, None], np.nan, lower - wide), "c"),
        "upper": (each, np.where(lost[:, None], np.nan, upper + wide), "c"),
        "reached_lower": (each, lower, "c"),
        "reached_upper": (each, upper, "c"),
        "magnitude": (size, np.where(lost[:, None], np.nan, 1.05 * magnitude), "q"),
        "reached_magnitude": (size, magnitude, "q"),
        "linear": (each, np.maximum(np.abs(lower), np.abs(upper)), "c"),
        "status": (("pose",), np.where(lost, status, "proven"), "1"),
    }
    return _dataset(machine, poses, data)


def region(machine: Any, status: str = "proven") -> xr.Dataset:
    """What `tp.bounds` gives over a region."""
    home = machine.home[: len(machine.commanded)][None]
    lower, upper, magnitude = (each[0] for each in _box(machine, home))
    each, size = ("component",), ("quantity",)
    groups = _groups(machine)
    data = {
        "lower": (each, lower - 1e-6, "c"),
        "upper": (each, upper + 1e-6, "c"),
        "reached_lower": (each, lower, "c"),
        "reached_upper": (each, upper, "c"),
        "magnitude": (size, 1.04 * magnitude, "q"),
        "reached_magnitude": (size, magnitude, "q"),
        "where_lower": (("component", "commanded"), np.tile(home, (len(lower), 1)), "f"),
        "where": (("component", "commanded"), 1.1 * np.tile(home, (len(lower), 1)), "f"),
        "where_magnitude": (("quantity", "commanded"), np.tile(home, (len(groups), 1)), "f"),
        "where_unproven": (("commanded",), home[0] * (1 if status != "proven" else np.nan), "f"),
        "boxes": ((), 321, "1"),
        "status": ((), status, "1"),
    }
    units = ["m" if name in "xyz" else "rad" for name in machine.commanded]
    coords = {
        "commanded": list(machine.commanded),
        "commanded_units": ("commanded", units),
    }
    return _dataset(machine, None, data, coords, {"gap": 0.05})


def shares(machine: Any, poses: Array, *, correlated: bool = False) -> xr.Dataset:
    """What `tp.shares` gives: of a linear machine, first, total and linear are one."""
    _, effects = shift_and_effects(machine, poses)
    variance = np.moveaxis(effects**2 / 3.0, -1, 1)
    share = variance / variance.sum(axis=1, keepdims=True)
    names = list(dict.fromkeys(SOURCES))
    of_source = np.stack(
        [share[:, [s == name for s in SOURCES]].sum(axis=1) for name in names], axis=1
    )
    each, grouped = ("pose", "parameter", "component"), ("pose", "source", "component")
    data: dict[str, tuple[tuple[str, ...], Any, str]] = {
        "first": (each, share, "1"),
        "total": (each, 1.01 * share, "1"),
        "linear": (each, share, "1"),
        "first_confidence": (each, 0.02 + 0 * share, "1"),
        "total_confidence": (each, 0.01 + 0 * share, "1"),
    }
    for name, factor in (("first", 1.0), ("total", 1.01), ("linear", 1.0)):
        data[f"source_{name}"] = (grouped, factor * of_source, "1")
        if name != "linear":
            data[f"source_{name}_confidence"] = (grouped, 0.02 + 0 * of_source, "1")
    if correlated:
        data["shapley"] = (each, share, "1")
    data["standard_deviation"] = (("pose", "component"), np.sqrt(variance.sum(axis=1)), "c")
    data["evaluations"] = (("pose",), np.full(len(poses), 7000), "1")
    data["failed"] = (("pose",), np.zeros(len(poses), int), "1")
    coords = {
        "parameter": list(PARAMETERS),
        "parameter_source": ("parameter", list(SOURCES)),
        "source": names,
    }
    return _dataset(machine, poses, data, coords, {"seed": 7, "samples": 1000})


def _box(machine: Any, poses: Array) -> tuple[Array, Array, Array]:
    """Least and most of each component, and a magnitude of each quantity, at each pose."""
    shift, effects = shift_and_effects(machine, poses)
    half = np.abs(effects).sum(axis=-1)
    most = np.abs(shift) + half
    sizes = [0.9 * np.linalg.norm(most[:, at], axis=1) for at in _groups(machine).values()]
    return shift - half, shift + half, np.stack(sizes, axis=1)


def _groups(machine: Any) -> dict[str, list[int]]:
    """Components of each quantity."""
    length = [at for at, name in enumerate(machine.components) if name in ("x", "y", "z")]
    angle = [at for at in range(len(machine.components)) if at not in length]
    return {"position": length} | ({"orientation": angle} if angle else {})


def _dataset(
    machine: Any,
    poses: Array | None,
    data: dict[str, tuple[tuple[str, ...], Any, str]],
    coords: dict[str, Any] | None = None,
    attrs: dict[str, Any] | None = None,
) -> xr.Dataset:
    """Units as `truepose.runs.dataset` writes them: "c", "q", "f" differ along a dim."""
    component = ["m" if name in ("x", "y", "z") else "rad" for name in machine.components]
    quantities = list(_groups(machine))
    quantity = ["m" if name == "position" else "rad" for name in quantities]
    along = {"c": ("component", component), "q": ("quantity", quantity)}
    along["f"] = ("commanded", ["m" if name in "xyz" else "rad" for name in machine.commanded])
    variables = {}
    for name, (dims, values, unit) in data.items():
        described = {"units": unit, "long_name": name.replace("_", " ")}
        if unit in along:
            dim, units = along[unit]
            described["units"] = ", ".join(dict.fromkeys(units))
            if len(set(units)) > 1:
                described["units_by"] = f"{dim}_units"
        variables[name] = (dims, values, described)
    labels: dict[str, Any] = {
        "component": list(machine.components),
        "component_units": ("component", component),
    }
    if any("quantity" in dims for dims, _, _ in data.values()):
        labels |= {"quantity": quantities, "quantity_units": ("quantity", quantity)}
    if poses is not None:
        labels["pose"] = np.arange(len(poses))
        labels["left_out_index"] = ("left_out", np.empty(0, int))
        labels["left_out_status"] = ("left_out", np.empty(0, "<U16"))
        for at, name in enumerate(machine.commanded):
            described = {"units": "m" if name in "xyz" else "rad", "long_name": name}
            labels[f"pose_{name}"] = ("pose", poses[:, at], described)
            labels[f"left_out_{name}"] = ("left_out", np.empty(0), described)
    return xr.Dataset(variables, labels | (coords or {}), {"truepose_version": "0"} | (attrs or {}))
