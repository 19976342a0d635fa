"""parameter: a dimension of the machine that was measured by itself, without a pose.

A rod on a length gauge, a joint circle on a coordinate measuring machine: the parameter as the
machine file has it, at the reference temperature and without loads.
"""

from __future__ import annotations

from truepose.calibration.instruments._base import Kind
from truepose.calibration.observables import OF_PARAMETERS

KIND = Kind(
    "parameter",
    "Dimensions of parts, measured by themselves: the length of a rod on a gauge.",
    "by measured dimensions of its parts",
    {observable: observable for observable in OF_PARAMETERS.values()},
    has_target=False,
    poses=0,
)
