"""Klipper: linear and rotary deltas, as sections of printer.cfg."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from truepose.controllers._delta import SWITCHES
from truepose.controllers._export import Export, Option
from truepose.controllers._one_file import in_one_file
from truepose.controllers.klipper.linear import KlipperLinear
from truepose.controllers.klipper.rotary import Rotary
from truepose.machine import Machine


class Klipper:
    """The numbers of `kinematics: delta` or `kinematics: rotary_delta`, fitted."""

    name: ClassVar[str] = "klipper"
    doc: ClassVar[str] = "parameters of a linear or rotary delta for Klipper's printer.cfg"
    options: ClassVar[Mapping[str, Option]] = {"switches": SWITCHES}

    @classmethod
    def export(cls, machine: Machine, options: Mapping[str, float | str]) -> Export:
        """The sections to merge into printer.cfg.

        Raises `RequestError`: controller-cannot, bad-option, no-workspace, no-pose-left.
        """
        cranks = all(drive.kind == "crank" for drive in machine.drives)
        model = Rotary(machine, options) if cranks else KlipperLinear(machine, options)
        notes = ["Merge into printer.cfg; mm and degrees."]
        return in_one_file(
            machine, model, "Klipper", ending="klipper.cfg", comment="#", notes=notes
        )


__all__ = ["Klipper"]
