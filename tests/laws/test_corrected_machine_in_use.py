"""The built machine, commanded with what is written for it, is where the headline says it is.

Truth is NumPy (`calibration_study`); what is commanded comes from the calibrated file alone.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calibration_study.in_use import used_of
from calibration_study.study import CHANCE, drawn_set, share
from sweeps import sweep

EACH = 20


@pytest.mark.parametrize("seeds", [range(1), pytest.param(range(EACH), marks=sweep)], ids=str)
def test_the_corrected_machine_is_within_the_headline(seeds: range, tmp_path: Path) -> None:
    """Commanded with the compensation, the program and the pose map of the file that is written."""
    every = [each for seed in seeds for each in used_of(drawn_set("none", seed, tmp_path))]
    assert every
    for way in {each.way for each in every}:
        own = [each for each in every if each.way == way]
        least = 0.95 - CHANCE * np.sqrt(0.95 * 0.05 / len(own))
        assert share(each.ratio <= 1.0 for each in own) >= least, own
