"""strut-direction: where struts point, as a camera that looks at the legs sees it.

P. Renaud, N. Andreff, J.-M. Lavest, M. Dhome, Simplifying the kinematic calibration of parallel
mechanisms using vision-based metrology, IEEE Trans. Robotics 22 (2006) 12-22.
"""

from __future__ import annotations

from truepose.calibration.instruments._base import Kind, of_rotation

KIND = Kind(
    "strut-direction",
    "Unit vectors along struts, from base to platform: a camera that looks at the legs.",
    "by directions of struts alone",
    {f"direction.{axis}": f"direction.{axis}" for axis in "xyz"},
    frame=of_rotation,
    has_target=False,
)
