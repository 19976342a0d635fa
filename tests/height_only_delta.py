"""The linear delta of oracles/cases/p02_delta_height_only.json in closed form, and its verdicts.

Rods from three vertical carriages to one point, unknowns as the file has them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oracle_cases import case
from truepose.calibration.acceptance import Candidate, Gate, assess
from truepose.calibration.identification.unknowns import Unknowns

Floats = NDArray[np.float64]

P02: dict[str, Any] = case("p02_delta_height_only")
RADIUS = P02["inputs"]["delta_radius_mm"] * 1e-3
ROD = P02["inputs"]["rod_mm"] * 1e-3
TOWERS = np.radians(P02["inputs"]["tower_angles_deg"])
NOISE = P02["inputs"]["noise_mm"] * 1e-3
POINTS = np.array(P02["inputs"]["probe_points_mm"]) * 1e-3
LABELS = (
    "delta radius",
    *(f"endstop {tower}" for tower in "abc"),
    *(f"tower angle {tower}" for tower in "ab"),
    *(f"rod length {tower}" for tower in "abc"),
)
UNITS = ("m",) * 4 + ("rad",) * 2 + ("m",) * 3
TO_FILE = np.array([1e3] * 4 + [180.0 / np.pi] * 2 + [1e3] * 3)
"""m and rad -> mm and degrees."""
HALF = np.array([0.5e-3] * 4 + [np.radians(0.2)] * 2 + [0.5e-3] * 3)
"""Half bands of a printed machine: half a millimetre, and on its tower circle as much in angle."""
NOMINAL = np.array([RADIUS, *[np.nan] * 5, *[ROD] * 3])
HEIGHTS, POSITIONS = "by heights alone", "by positions in x, y and z"


def jac_point_wrt_unknowns(points: Floats) -> Floats:
    """(n, 3, 9): closures |p - c|^2 = L^2 with carriages c, differentiated by hand."""
    found = np.zeros((len(points), 3, 9))
    for index, (x, y) in enumerate(points[:, :2]):
        along, by_unknown = np.zeros((3, 3)), np.zeros((3, 9))
        for tower, angle in enumerate(TOWERS):
            out = np.array([np.cos(angle), np.sin(angle)])
            rod = np.array([x, y]) - RADIUS * out
            down = -np.sqrt(ROD**2 - rod @ rod)
            along[tower] = *rod, down
            by_unknown[tower, 0] = -rod @ out
            by_unknown[tower, 1 + tower] = -down
            if tower < 2:
                by_unknown[tower, 4 + tower] = -RADIUS * (rod @ [-out[1], out[0]])
            by_unknown[tower, 6 + tower] = -ROD
        found[index] = -np.linalg.solve(along, by_unknown)
    return found


PROBED = jac_point_wrt_unknowns(POINTS)
GRID = np.linspace(-0.105, 0.105, 7)
WORKSPACE = np.array(
    [(x, y, z) for x in GRID for y in GRID for z in (0.0, 0.1) if x * x + y * y <= 0.105**2]
)
TOOL = jac_point_wrt_unknowns(WORKSPACE)


def rows_of(kind: str) -> Floats:
    return PROBED[:, 2] if kind == HEIGHTS else PROBED.reshape(-1, 9)


def unknowns(
    labels: tuple[str, ...] = LABELS,
    half: ArrayLike = HALF,
    units: tuple[str, ...] = UNITS,
    n_machine: int | None = None,
) -> Unknowns:
    """With tolerances of two standard deviations; a half band of inf is none."""
    bands = np.asarray(half, np.float64)
    n, count = len(labels), len(labels) if n_machine is None else n_machine
    return Unknowns(
        names=tuple(label.replace(" ", ".") for label in labels),
        units=units,
        labels=labels,
        n_machine=count,
        columns=np.arange(count),
        effects=np.eye(count, n),
        prior_mean=np.zeros(n),
        prior_covariance=np.diag((bands / 2.0) ** 2),
        half=bands,
    )


def residual_of(jacobian: Floats, seed: int = 1, size: float = 1.0) -> Floats:
    """Noise with what the fit takes away taken away, of normalised size `size`."""
    noise = np.random.default_rng(seed).normal(size=len(jacobian))
    left: Floats = noise - jacobian @ np.linalg.lstsq(jacobian, noise, rcond=None)[0]
    degrees = len(jacobian) - np.linalg.matrix_rank(jacobian)
    return left * size * np.sqrt(degrees) / np.linalg.norm(left) if degrees else 0.0 * left


IN_X_AND_Y = Candidate(
    "x and y", 22.0, "probe in x and y too", PROBED[:, :2].reshape(-1, 9) / NOISE
)


def verdict(kind: str, *, noise: float = NOISE, residual: float = 1.0, **other: Any) -> Gate:
    """On the delta, measured `kind`, its tolerances not used as priors unless `other` says so."""
    jacobian = rows_of(kind) / noise
    error = residual_of(jacobian, size=residual)
    settings: dict[str, Any] = {
        "values": np.zeros(9),
        "residual": error,
        "before": 10.0 * error,
        "use_prior": False,
        "tool": TOOL,
        "components": "xyz",
        "positions": WORKSPACE,
        "by": [kind],
        "nominal": NOMINAL,
        "candidates": [IN_X_AND_Y],
    } | other
    return assess(settings.pop("unknowns", unknowns()), jacobian=jacobian, **settings)


def codes(gate: Gate) -> set[str]:
    return {reason.code for reason in gate.reasons}


def warned(gate: Gate) -> set[str]:
    return {warning.code for warning in gate.warnings}
