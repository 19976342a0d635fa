"""The units that most files are written in, so that reading one does not wait for pint.

A number in one of them is the same in SI, to the last digit, as by pint
(`tests/unit/files/test_common_units.py`), which is asked for whatever is not here.
"""

from __future__ import annotations

import math

_DEGREE = math.pi / 180.0
_INCH = 0.0254

COMMON: dict[str, dict[str, tuple[float, float]]] = {
    "length": {
        "m": (1.0, 0.0),
        "mm": (0.001, 0.0),
        "um": (1e-06, 0.0),
        "µm": (1e-06, 0.0),
        "in": (_INCH, 0.0),
    },
    "angle": {"rad": (1.0, 0.0), "mrad": (0.001, 0.0), "deg": (_DEGREE, 0.0), "°": (_DEGREE, 0.0)},
    "force": {"N": (1.0, 0.0), "kN": (1000.0, 0.0)},
    "moment": {"N m": (1.0, 0.0)},
    "temperature": {"K": (1.0, 0.0), "degC": (1.0, 273.15), "°C": (1.0, 273.15)},
    "temperature_difference": {"K": (1.0, 0.0)},
    "area": {"m^2": (1.0, 0.0), "mm^2": (1e-06, 0.0)},
    "stress": {"Pa": (1.0, 0.0), "GPa": (1e9, 0.0)},
    "stiffness": {"N/m": (1.0, 0.0), "N/um": (1e6, 0.0), "N/mm": (1000.0, 0.0)},
    "expansion": {"1/K": (1.0, 0.0)},
    "mass": {"kg": (1.0, 0.0)},
    "time": {"s": (1.0, 0.0), "min": (60.0, 0.0), "h": (3600.0, 0.0)},
    "acceleration": {"m/s^2": (1.0, 0.0)},
    "temperature_gradient": {"K/m": (1.0, 0.0)},
    "torsional_stiffness": {"N m/rad": (1.0, 0.0)},
    "second_moment": {"m^4": (1.0, 0.0), "mm^4": (1e-12, 0.0)},
    "ratio": {"ppm": (1e-06, 0.0), "um/m": (1e-06, 0.0)},
}
"""Of each dimension, text -> what `FileUnit` has: scale and offset."""
