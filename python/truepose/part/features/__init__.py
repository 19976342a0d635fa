"""Kinds of features of a part, a file each."""

from __future__ import annotations

from truepose.part.features._base import Feature

REGISTRY: tuple[type[Feature], ...] = ()
"""All kinds, in the order of the documentation."""

__all__ = ["REGISTRY", "Feature"]
