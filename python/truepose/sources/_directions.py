"""Directions that the file gives in axes of what carries a strut, turned into base axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats
from truepose.spatial import rotate_about

if TYPE_CHECKING:
    from truepose._kernel import Machine as KernelMachine
    from truepose.machine import Drive


def of_base_side(
    kernel: KernelMachine,
    drive: Drive | None,
    joints: Floats,
    direction: ArrayLike,
) -> Floats:
    """(n or 1, 3) unit `direction` (3,) in the axes of what carries a strut's base joint.

    A frame (`drive` None, or a telescopic one) and a carriage have base axes. An arm has base axes
    at angle 0 and turns about its drive's axis by scale q + offset, `joints` q (n, n_joint), rad.
    """
    given = np.asarray(direction, np.float64)
    if drive is None or drive.coordinate != "angle":
        return given[np.newaxis, :]
    nominal = dict(zip(kernel.parameters, kernel.nominal.tolist(), strict=True))
    scale, offset = nominal[f"{drive.part}.scale"], nominal[f"{drive.part}.offset"]
    angle = scale * joints[:, [kernel.joints.index(drive.name)]] + offset
    axis = np.asarray(drive.fields["axis"], np.float64)
    return rotate_about(given, axis, angle)
