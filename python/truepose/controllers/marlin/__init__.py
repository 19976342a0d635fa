"""Marlin: linear deltas, as M665 and M666.

    M665 L rod, R radius, H height, X Y Z tower angle trims (degrees, counter-clockwise seen from
         above, from 210, 330 and 90 degrees), A B C rod trims (added to L)
    M666 X Y Z endstop adjustments, zero or less: by how much a carriage is lowered from its endstop
         before the three stand as for the nozzle at x = y = 0, z = H

Two numbers say one thing twice: the mean of A, B and C is made 0; the highest adjustment is
made `least` below 0, since Marlin leaves out one that is shorter than MIN_STEPS_PER_SEGMENT steps.
The radius trims of single towers can be set in Configuration.h only and are taken to be 0. The rod
trims came with pull request 18423 (June 2020), hence with Marlin 2.0.6; in older ones B is the
radius on which G33 probes (1.1; issue 19121) or nothing, and A and C are nothing. With a
bed probe Marlin homes to H less the probe's z offset (M851 Z), which is what the option
`probe_offset` is for. Facts: https://marlinfw.org/docs/gcode/M665.html and M666.html, and the
behaviour of Marlin 2.1.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._delta import SWITCHES, TOWERS, tower_order, wrapped
from truepose.controllers._export import Export, Option
from truepose.controllers._linear_delta import (
    ANGLES,
    ARMS,
    HEIGHTS,
    RADIUS,
    TILT,
    TowerModel,
    endstop,
    heights,
    linear_delta,
    untilted,
)
from truepose.controllers._one_file import in_one_file
from truepose.controllers._small_model import (
    MM,
    Printed,
    fixed,
    in_file_units,
    more_decimals,
)
from truepose.errors import Problem, RequestError
from truepose.machine import Machine

LENGTH_DIGITS, ANGLE_DIGITS = 5, 6
"""Decimals that are written; of lengths more where the characteristic one is below `SMALL`, m."""

SMALL = 0.01

PREMISES = (
    "for Marlin 2.0.6 or newer, whose M503 shows M665 with A, B and C, rod trims: an older one "
    "leaves A and C out, and may take B for the radius on which G33 probes",
    "these must be 0 or off: DELTA_RADIUS_TRIM_TOWER (in Configuration.h), hotend offsets (M218), "
    "skew (M852), bed levelling (M420 S0)",
    "G33 replaces these numbers by its own",
)
"""What the letters, and what else the firmware may do to a position, depend on."""

AXES, TRIMS = "XYZ", "ABC"


class _Model(TowerModel):
    """A `SmallModel` of ten numbers; its towers are counted as Marlin does."""

    def __init__(self, machine: Machine, options: Mapping[str, float | str]) -> None:
        delta = linear_delta(machine, options, "marlin")
        super().__init__(delta.in_order(tower_order(delta.nominal[ANGLES])))
        self._probe = float(options["probe_offset"])
        self._least = float(options["least"])
        self._digits = LENGTH_DIGITS + more_decimals(machine.characteristic_length, SMALL)
        self._check_least()

    def _check_least(self) -> None:
        """Carriages are lowered, and not so far that the tool cannot rise to its workspace."""
        machine = self.delta.machine
        top, highest = float(endstop(self.delta.nominal).min()), float(machine.poses()[:, 2].max())
        if self._least < 0.0:
            found, expected = "below zero, over the endstops", "zero or more"
        elif top - self._least < highest <= top:
            found = (
                f"less than the highest pose, {in_file_units(machine, highest, 'length')}, for H"
            )
            expected = f"zero to {in_file_units(machine, top - highest, 'length')}"
        else:
            return
        raise RequestError(
            Problem(
                "bad-option",
                "option least of marlin lowers the carriages by a wrong length",
                file=machine.file,
                found=f"{in_file_units(machine, self._least, 'length')}: {found}",
                expected=expected,
                hint="least=0 lowers the highest carriage by nothing",
            )
        )

    def format(self, values: Floats) -> Printed:
        """Numbers by command and word, mm and degrees."""
        numbers = untilted(values)
        trips, arms = endstop(numbers), numbers[ARMS]
        height = float(trips.min()) - self._least
        lengths = {"L": float(arms.mean()), "R": float(numbers[RADIUS][0])}
        lengths["H"] = height + self._probe
        lengths |= dict(zip(TRIMS, arms - arms.mean(), strict=True))
        settings = {f"M665 {word}": fixed(v / MM, self._digits) for word, v in lengths.items()}
        turned = np.degrees(wrapped(numbers[ANGLES] - TOWERS))
        settings |= {f"M665 {w}": fixed(v, ANGLE_DIGITS) for w, v in zip(AXES, turned, strict=True)}
        lowered = (height - trips) / MM
        settings |= {
            f"M666 {w}": fixed(v, self._digits) for w, v in zip(AXES, lowered, strict=True)
        }
        return settings

    def parse(self, printed: Printed) -> Floats:
        """(10,) the model's values, SI, of printed numbers."""

        def of(code: str, words: str) -> Floats:
            return np.array([float(printed[f"{code} {word}"]) for word in words])

        radius, rod, height = of("M665", "RLH") * MM
        values = np.empty(TILT.start)
        values[RADIUS], values[ARMS] = radius, rod + of("M665", TRIMS) * MM
        values[ANGLES] = TOWERS + np.radians(of("M665", AXES))
        trips = height - self._probe - of("M666", AXES) * MM
        values[HEIGHTS] = heights(trips, values[ARMS], radius)
        return values

    def block(self, printed: Printed) -> list[str]:
        """The two commands."""

        def line(code: str, words: str) -> str:
            return " ".join([code, *(f"{word}{printed[f'{code} {word}']}" for word in words)])

        probe, least = (
            in_file_units(self.delta.machine, value, "length")
            for value in (self._probe, self._least)
        )
        return [
            f"; towers: {self.delta.towers(AXES)}",
            f"; probe_offset {probe}, least {least}",
            line("M665", f"LRH{AXES}{TRIMS}"),
            line("M666", AXES),
            "; They count from the next homing (G28) on; M500 keeps them.",
        ]


class Marlin:
    """The numbers of M665 and M666, fitted."""

    name: ClassVar[str] = "marlin"
    doc: ClassVar[str] = "M665 and M666 of a linear delta for Marlin"
    options: ClassVar[Mapping[str, Option]] = {
        "switches": SWITCHES,
        "probe_offset": Option(0.0, "z offset of a bed probe, M851 Z; 0 without one", "length"),
        "least": Option(0.0002, "how far every carriage is lowered from its endstop", "length"),
    }

    @classmethod
    def export(cls, machine: Machine, options: Mapping[str, float | str]) -> Export:
        """The commands to send.

        Raises `RequestError`: controller-cannot, bad-option, no-workspace, no-pose-left.
        """
        model = _Model(machine, options)
        return in_one_file(
            machine, model, "Marlin", ending="marlin.gcode", comment=";", premises=PREMISES
        )


__all__ = ["Marlin"]
