"""Features of the part: what the drawing tolerances, each kind in a file of its own."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from truepose.part.features._base import Feature

REGISTRY: Mapping[str, type[Feature]] = MappingProxyType({})
"""Every kind of feature by its name."""

__all__ = ["REGISTRY", "Feature"]
