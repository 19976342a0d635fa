"""`base_joint` and `platform_joint` of a `[[strut]]`: its passive joints."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from truepose.errors import Fault
from truepose.files.file_table import FileTable
from truepose.files.quantity import Direction, NonNegativeLength, PositiveAngle, Stiffness, refuse


class JointTable(FileTable):
    """A passive joint at one end of a strut."""

    kind: Literal["spherical", "universal", "revolute", "flexure"] = Field(
        "spherical", description="What joins the two."
    )
    stiffness: Stiffness | None = Field(
        None, description="Stiffness along the strut. Default: rigid."
    )
    clearance: NonNegativeLength = Field(
        0.0, description="Total play of the pair: the bore's diameter less the pin's or ball's."
    )
    axial_clearance: NonNegativeLength = Field(
        0.0, description="Total play along the axis of a revolute joint."
    )
    axis: Direction | None = Field(
        None,
        description="Axis of a revolute joint; of another, the direction from which `angle_limit` "
        "counts. Axes of the carriage or frame at the base, of the platform at the platform.",
    )
    angle_limit: PositiveAngle | None = Field(
        None, description="Largest angle between the strut and `axis`."
    )

    @model_validator(mode="after")
    def _fits_its_kind(self) -> JointTable:
        if self.kind == "flexure" and (self.clearance or self.axial_clearance):
            refuse(
                Fault(
                    "unwanted-clearance",
                    "a flexure is of one piece and has no play",
                    found="a clearance on a flexure",
                    expected="no clearance, or a joint of another kind",
                )
            )
        if self.axial_clearance and self.kind != "revolute":
            refuse(
                Fault(
                    "unwanted-clearance",
                    f"a {self.kind} joint has no axis along which to have play",
                    found=f"axial_clearance on a {self.kind} joint",
                    expected="clearance, or a revolute joint",
                )
            )
        for wants, given in (
            ("angle_limit", self.angle_limit is not None),
            ("axial_clearance", self.axial_clearance > 0.0),
        ):
            if given and self.axis is None:
                refuse(
                    Fault(
                        "missing-key",
                        f"{wants} without the axis that it is about",
                        found="no axis",
                        expected="axis, three plain numbers such as [0, 0, 1]",
                    )
                )
        return self
