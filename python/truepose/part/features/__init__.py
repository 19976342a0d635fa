"""Kinds of features, a file each: what a feature's points are held against, and in which numbers."""

from __future__ import annotations

from truepose.part.features._base import Feature

REGISTRY: tuple[type[Feature], ...] = ()
"""All kinds, in the order of the documentation."""

__all__ = ["REGISTRY", "Feature"]
