"""Compensation: the command that takes the tool where it should be, and proof of what remains."""

from __future__ import annotations

from truepose.compensation.compensate import SCHEMA, compensate

__all__ = ["SCHEMA", "compensate"]
