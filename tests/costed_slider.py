"""machines/planar_two_slider.toml with costs, and its errors in closed form."""

from __future__ import annotations

import numpy as np

from designs import row

# The machine of machines/planar_two_slider.toml, in mm, N and K.
RAILS = np.array([0.0, 600.0])
ROD, AREA, MODULUS, EXPANSION, WARMER = 500.0, 28.2743338823, 210e3, 1.1e-5, 15.0
FORCE = np.array([1200.0, -1500.0])

LENGTHS, OFFSETS = (0.02, 0.05, 0.1), (0.01, 0.03, 0.08)
ROWS = (
    row("strut.*.length", bands='["20 um", "50 um", "100 um"]', cost=9.0),
    row("drive.*.offset", bands='["10 um", "30 um", "80 um"]', cost=5.0),
)
COSTS = [[9.0 * 0.01 / half for half in LENGTHS], [5.0 * 0.01 / half for half in OFFSETS]]


def tool(carriage: np.ndarray, rod: np.ndarray) -> np.ndarray:
    """(..., 2) where two rods (..., 2) on carriages of heights (..., 2) meet, below them."""
    across, up = RAILS[1] - RAILS[0], carriage[..., 1] - carriage[..., 0]
    apart = np.hypot(across, up)
    along = (rod[..., 0] ** 2 - rod[..., 1] ** 2 + apart**2) / (2.0 * apart)
    off = np.sqrt(rod[..., 0] ** 2 - along**2)
    x = RAILS[0] + (along * across + off * up) / apart
    y = carriage[..., 0] + (along * up - off * across) / apart
    return np.stack([x, y], axis=-1)


def errors(pose: np.ndarray, rod: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """(..., 2) the error at poses (..., 2): rods that deviate by so much, carriages off by so much.

    Besides, the rods are warm, and stretched by the force on the tool.
    """
    height = pose[..., 1:] + np.sqrt(ROD**2 - (pose[..., :1] - RAILS) ** 2)
    run = (pose[..., :1] - RAILS) / ROD
    rise = (pose[..., 1:] - height) / ROD
    # What the rods pull the tool with is in balance with the force on it.
    turned = run[..., 0] * rise[..., 1] - run[..., 1] * rise[..., 0]
    tension = np.stack(
        [
            (FORCE[0] * rise[..., 1] - FORCE[1] * run[..., 1]) / turned,
            (FORCE[1] * run[..., 0] - FORCE[0] * rise[..., 0]) / turned,
        ],
        axis=-1,
    )
    grown = ROD * EXPANSION * WARMER + tension * ROD / (MODULUS * AREA)
    return tool(height + offset, ROD + grown + rod) - pose
