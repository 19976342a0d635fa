"""Imports: this folder's own modules, and the host of kinematics modules in `benchmarks`."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path += [str(place) for place in (HERE, HERE.parents[1]) if str(place) not in sys.path]
