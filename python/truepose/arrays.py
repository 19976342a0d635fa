"""The arrays that functions take and give, named by what is in them; shapes stand in docstrings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
"""Numbers, in SI units where they have one."""

Indices = NDArray[np.intp]
"""Places in another array, counted from 0."""

Flags = NDArray[np.bool_]
"""Yes or no, of each."""

Codes = NDArray[np.uint8]
"""Codes of the kernel, such as the status of a pose (`truepose._kernel.STATUS`)."""
