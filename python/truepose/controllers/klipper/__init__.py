"""Klipper: linear and rotary deltas, as sections of printer.cfg."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from truepose.controllers._delta import SWITCHES
from truepose.controllers._export import Export, Option
from truepose.controllers._fit import fit, heading
from truepose.controllers._small_model import stem
from truepose.controllers.klipper.linear import Linear
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
        model = Rotary(machine, options) if cranks else Linear(machine, options)
        found = fit(machine, model)
        comment = [f"# {line}" for line in heading(machine, found, "Klipper")]
        comment.append("# Merge into printer.cfg; mm and degrees.")
        text = "\n".join([*comment, *model.block(found.printed), ""])
        return Export({f"{stem(machine)}_klipper.cfg": text}, found.statement(machine))


__all__ = ["Klipper"]
