"""Features of the part: what the drawing tolerances, each kind in a file of its own.

A kind is the new file and its line in `REGISTRY`; the reader of features, the documentation's table
and the tests walk the registry. Forms, directions and places are those of the tool's path: the
surface is the path moved by the tool's radius along the drawing's normal, which changes sizes alone
(`EvaluatedFeature.surface`). No filter is applied to the points.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from truepose.workpiece.element import FeatureError
from truepose.workpiece.features._base import Feature, Forms, Method, Quantity
from truepose.workpiece.features.angularity import Angularity
from truepose.workpiece.features.circle import Circle
from truepose.workpiece.features.flatness import Flatness
from truepose.workpiece.features.parallelism import Parallelism
from truepose.workpiece.features.perpendicularity import Perpendicularity
from truepose.workpiece.features.position import Position
from truepose.workpiece.features.profile import ContourProfile
from truepose.workpiece.features.size import Size
from truepose.workpiece.features.straightness import Straightness

REGISTRY: Mapping[str, type[Feature]] = MappingProxyType(
    {
        kind.kind: kind
        for kind in (
            Size,
            Circle,
            Straightness,
            Flatness,
            Parallelism,
            Perpendicularity,
            Angularity,
            Position,
            ContourProfile,
        )
    }
)
"""Every kind of feature by its name."""

__all__ = ["REGISTRY", "Feature", "FeatureError", "Forms", "Method", "Quantity"]
