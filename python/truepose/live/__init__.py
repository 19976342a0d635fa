"""A machine as a page evaluates it: its bundle, plain JSON values of a few kilobytes."""

from __future__ import annotations

from truepose.live.bundle import SCHEMA, bundle

__all__ = ["SCHEMA", "bundle"]
