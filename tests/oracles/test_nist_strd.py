"""NIST's Statistical Reference Datasets for nonlinear regression, from both starts.

Data, starting values and certified values, to 11 digits, are NIST's own files
(https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml, public domain), as they are. The models
are written here from the formulas in those files; their derivatives are exact, by a complex step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from oracle_cases import Published
from truepose.calibration import Solution, covariance, least_squares

FOLDER = Path(__file__).parent / "cases" / "nist_strd"
STEP = 1e-40
"""Imaginary step: its square vanishes, so the imaginary part is the derivative to rounding."""

Array = NDArray[np.float64]
Model = Callable[..., NDArray[np.complex128]]


def _arctan(z: NDArray[np.complex128]) -> NDArray[np.complex128]:
    return np.arctan(z.real) + 1j * z.imag / (1 + z.real**2)


def _gauss(b, x):
    peaks = [b[2 + k] * np.exp(-((x - b[3 + k]) ** 2) / b[4 + k] ** 2) for k in (0, 3)]
    return b[0] * np.exp(-b[1] * x) + peaks[0] + peaks[1]


def _cubic(b, x):
    above = b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3
    return above / (1 + b[4] * x + b[5] * x**2 + b[6] * x**3)


def _cycles(b, x):
    def cycle(period, cosine, sine):
        angle = 2 * np.pi * x / period
        return cosine * np.cos(angle) + sine * np.sin(angle)

    return b[0] + cycle(12, b[1], b[2]) + cycle(b[3], b[4], b[5]) + cycle(b[6], b[7], b[8])


def _lanczos(b, x):
    return b[0] * np.exp(-b[1] * x) + b[2] * np.exp(-b[3] * x) + b[4] * np.exp(-b[5] * x)


MODELS: dict[str, Model] = {
    "Bennett5": lambda b, x: b[0] * (b[1] + x) ** (-1 / b[2]),
    "BoxBOD": lambda b, x: b[0] * (1 - np.exp(-b[1] * x)),
    "Chwirut1": lambda b, x: np.exp(-b[0] * x) / (b[1] + b[2] * x),
    "Chwirut2": lambda b, x: np.exp(-b[0] * x) / (b[1] + b[2] * x),
    "DanWood": lambda b, x: b[0] * x ** b[1],
    "ENSO": _cycles,
    "Eckerle4": lambda b, x: b[0] / b[1] * np.exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
    "Gauss1": _gauss,
    "Gauss2": _gauss,
    "Gauss3": _gauss,
    "Hahn1": _cubic,
    "Kirby2": lambda b, x: (b[0] + b[1] * x + b[2] * x**2) / (1 + b[3] * x + b[4] * x**2),
    "Lanczos1": _lanczos,
    "Lanczos2": _lanczos,
    "Lanczos3": _lanczos,
    "MGH09": lambda b, x: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "MGH10": lambda b, x: b[0] * np.exp(b[1] / (x + b[2])),
    "MGH17": lambda b, x: b[0] + b[1] * np.exp(-x * b[3]) + b[2] * np.exp(-x * b[4]),
    "Misra1a": lambda b, x: b[0] * (1 - np.exp(-b[1] * x)),
    "Misra1b": lambda b, x: b[0] * (1 - (1 + b[1] * x / 2) ** -2),
    "Misra1c": lambda b, x: b[0] * (1 - (1 + 2 * b[1] * x) ** -0.5),
    "Misra1d": lambda b, x: b[0] * b[1] * x / (1 + b[1] * x),
    "Nelson": lambda b, x: b[0] - b[1] * x[:, 0] * np.exp(-b[2] * x[:, 1]),
    "Rat42": lambda b, x: b[0] / (1 + np.exp(b[1] - b[2] * x)),
    "Rat43": lambda b, x: b[0] / (1 + np.exp(b[1] - b[2] * x)) ** (1 / b[3]),
    "Roszman1": lambda b, x: b[0] - b[1] * x - _arctan(b[2] / (x - b[3])) / np.pi,
    "Thurber": _cubic,
}


@dataclass(frozen=True)
class Certificate:
    """Starts (2, n), certified values and standard deviations (n,), and the data."""

    starts: Array
    values: Array
    deviations: Array
    cost: float
    x: Array
    y: Array


def certificate(name: str) -> Certificate:
    """Reads a file: its lines 41 on hold the values, its lines 61 on the data."""
    lines = (FOLDER / f"{name}.dat").read_text(encoding="ascii").splitlines()
    rows = [line.split("=")[1].split() for line in lines[40:60] if line.strip().startswith("b")]
    table = np.array(rows, float)
    cost = next(line for line in lines if line.startswith("Residual Sum of Squares"))
    data = np.array([line.split() for line in lines[60:] if line.strip()], float)
    y, x = data[:, 0], data[:, 1:]
    return Certificate(
        table[:, :2].T,
        table[:, 2],
        table[:, 3],
        float(cost.split(":")[1]),
        x if x.shape[1] > 1 else x[:, 0],
        np.log(y) if name == "Nelson" else y,
    )


def digits(found: Array, certified: Array) -> float:
    """Least number of matching significant digits, at most the 11 that are certified."""
    wrong = np.abs(found - certified) / np.abs(certified)
    return float(np.min(-np.log10(np.maximum(wrong, 1e-11))))


def solve(name: str, start: int) -> tuple[Certificate, Solution]:
    data, model = certificate(name), MODELS[name]

    def residual(b: Array) -> Array:
        return model(b, data.x).real - data.y

    def jacobian(b: Array) -> Array:
        columns = [model(b + 1j * STEP * unit, data.x).imag / STEP for unit in np.eye(b.size)]
        return np.stack(columns, axis=1)

    return data, least_squares(residual, jacobian, data.starts[start])


@pytest.mark.filterwarnings("ignore:(overflow|invalid|divide):RuntimeWarning")
@pytest.mark.parametrize("start", [0, 1], ids=["far", "near"])
@pytest.mark.parametrize("name", MODELS)
def test_certified_values(name: str, start: int, published: Published) -> None:
    # Start 1 (far) is the harder one.
    data, found = solve(name, start)
    assert found.converged
    within = 1e-8 * np.abs(data.values)
    published(f"{name}: certified parameters", data.values, found.values, within=within)
    assert digits(found.values, data.values) >= 8.0
    if name != "Lanczos1":  # its certified sum, 1e-25, is rounding of its data
        assert digits(np.array([found.cost]), np.array([data.cost])) >= 9.0


@pytest.mark.parametrize("name", [name for name in MODELS if name != "Lanczos1"])
def test_certified_deviations(name: str) -> None:
    data, found = solve(name, 1)
    spread, free = covariance(found.jacobian, found.cost / (data.y.size - data.values.size))
    assert free.shape == (0, data.values.size)
    assert digits(np.sqrt(np.diagonal(spread)), data.deviations) >= 5.0


def test_every_file_is_used() -> None:
    assert sorted(path.stem for path in FOLDER.glob("*.dat")) == sorted(MODELS)
