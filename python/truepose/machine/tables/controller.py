"""`[controller]`: with which geometry the controller works out the joints."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from truepose.files.file_table import FileTable

Holds = Literal["drawing", "calibrated"]


class ControllerTable(FileTable):
    """The geometry that the controller works with, which is the nominal one of this file."""

    holds: Holds = Field(
        description='`"drawing"`: the geometry of the drawing, in a controller that was not '
        "touched; what a calibration found stands in the tolerances, as known deviations. "
        '`"calibrated"`: the geometry that a calibration found, which was loaded into it.'
    )
