"""The units that are known without pint are those that pint has."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from build_machine import MACHINES
from truepose.files.common_units import COMMON
from truepose.files.dimensions import DIMENSIONS
from truepose.files.units import FileUnit, parsed_unit, unit_of

NUMBERS = np.array([-37.25, 0.0, 0.1, 0.3, 1.0, 29.0, 210.0, 2.1e6])
UNITS = [(dimension, text) for dimension, units in COMMON.items() for text in units]


def test_every_dimension_has_its_unit() -> None:
    assert COMMON.keys() == DIMENSIONS.keys()
    for dimension, units in COMMON.items():
        si = DIMENSIONS[dimension].si
        assert si == "1" or units[si] == (1.0, 0.0)


@pytest.mark.parametrize(("dimension", "text"), UNITS)
def test_a_common_unit_is_what_pint_has(dimension: str, text: str) -> None:
    wanted = DIMENSIONS[dimension]
    unit, by_pint = unit_of(text, wanted), parsed_unit(text, wanted)
    assert unit == FileUnit(text, *COMMON[dimension][text])
    assert by_pint.scale == pytest.approx(unit.scale, rel=1e-15)
    assert (by_pint.to_si(NUMBERS) == unit.to_si(NUMBERS)).all()
    assert (by_pint.to_file(NUMBERS) == unit.to_file(NUMBERS)).all()


def test_a_usual_machine_file_is_read_without_pint() -> None:
    code = (
        "import sys, truepose;"
        f"truepose.load({str(MACHINES / 'hexapod.toml')!r});"
        "print('pint' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
