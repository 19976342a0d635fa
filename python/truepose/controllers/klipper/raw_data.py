"""What `delta_calibrate` measured, as SAVE_CONFIG keeps it, as measurements of the machine.

`heightN` is how high the nozzle was over the bed where the probe, or a sheet of paper, told it,
`manual_heightN` one that was entered; `distanceN` a distance between two places of the nozzle. The
positions, `_pos`, `_pos1` and `_pos2`, are steps of the three motors from their endstops. How the
machine was said to be on that day is no part of them; how far a motor goes for a step is, and of
that nothing is kept: microsteps that were changed since make them those of another machine. Facts
from Klipper's page on delta calibration (https://www.klipper3d.org/Delta_Calibrate.html) and from
what its own code keeps.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._delta_file import LIMBS, quoted
from truepose.controllers._reader import ASSUMED, Assumption, Setting
from truepose.controllers.klipper.config import Entry
from truepose.controllers.klipper.geometry import Geometry
from truepose.controllers.klipper.numbers import STEPPERS, Numbers
from truepose.controllers.klipper.steps import counts, step_distances

SECTION = "delta_calibrate"

PROBES = ("probe", "bltouch", "smart_effector", "probe_eddy_current")
"""Sections of what finds the bed by itself; without one of them it is done by hand."""

UNCERTAINTY = {"probe": "0.03 mm", "paper": "0.05 mm", "calliper": "0.05 mm"}
"""Assumed of each instrument, standard."""

WIDE_OFFSET = "0.1 mm"
"""Assumed of where the probe is beside and below the nozzle, standard."""

HEIGHTS, DISTANCES = "heights", "distances"

SETTINGS: Mapping[str, Setting] = {
    f"{group}.microsteps": Setting(f"microsteps of the drives when the {group} were taken", "ratio")
    for group in (HEIGHTS, DISTANCES)
}
"""What of that day is not kept."""

FACTORS = tuple(2.0**power for power in (1, -1, 2, -2, 3, -3, 4, -4))
"""By what microsteps are changed."""

FAR, FAR_BETTER = 0.02, 10.0
"""Off by more than this share of the arms, no machine is so badly built; and how much better."""


@dataclass(frozen=True)
class RawRow:
    """One reading: of which instrument, its name there, mm, and the steps at its pose or two."""

    instrument: str
    name: str
    value: float
    steps: tuple[Floats, ...]
    entry: Entry

    @property
    def group(self) -> str:
        """Of what was taken at once."""
        return DISTANCES if self.instrument == "calliper" else HEIGHTS

    @property
    def is_found(self) -> bool:
        """Whether the bed was found, at a height that is said, and not a height measured."""
        return self.name.startswith("height")

    def off(self, geometry: Geometry, step: Floats) -> float:
        """mm, by how much the machine as the file has it reads otherwise; NaN out of reach."""
        at = [geometry.tool(steps, step) for steps in self.steps]
        read = at[0][2] if len(at) == 1 else float(np.linalg.norm(at[0] - at[1]))
        return float(read) - self.value


def raw_rows(numbers: Numbers) -> list[RawRow]:
    """Every reading that is kept; what is wrong with one is among the problems of `numbers`."""
    rows: list[RawRow] = []
    by_probe = any(section in numbers.config.sections for section in PROBES)
    kinds = (
        ("height", "probe" if by_probe else "paper", ("_pos",)),
        ("manual_height", "paper", ("_pos",)),
        ("distance", "calliper", ("_pos1", "_pos2")),
    )
    for prefix, instrument, ends in kinds:
        number = 0
        # Klipper reads as far as they are counted without a gap.
        while (entry := numbers.config.get(SECTION, f"{prefix}{number}")) is not None:
            name = f"{prefix}{number}"
            above = 0.0 if instrument == "calliper" else -np.inf
            value = numbers.number(SECTION, name, above=above, expected="mm")
            found = [counts(numbers, SECTION, f"{name}{end}")[0] for end in ends]
            rows.append(RawRow(instrument, name, value, tuple(found), entry))
            number += 1
    return rows


def measurements(
    numbers: Numbers, geometry: Geometry, settings: Mapping[str, float | str]
) -> str | None:
    """The text of a file of measurements, None where nothing is kept, or something is wrong."""
    rows = raw_rows(numbers)
    if not rows:
        return None
    steps = {}
    for group in dict.fromkeys(row.group for row in rows):
        given = settings.get(f"{group}.microsteps")
        turning = geometry.unit == "deg"
        steps[group] = step_distances(
            numbers, turning=turning, microsteps=None if given is None else float(given)
        )
    if numbers.problems:
        return None
    for group, step in steps.items():
        _require_steps(numbers, geometry, [row for row in rows if row.group == group], step)
    if numbers.problems:
        return None
    return "\n".join([*_head(numbers, geometry, rows), *_table(geometry, rows, steps), ""])


def _require_steps(
    numbers: Numbers, geometry: Geometry, rows: Sequence[RawRow], step: Floats
) -> None:
    """Refuse positions that were counted with other microsteps, with what says so."""
    size = float(geometry.spheres(geometry.ends)[1].min())

    def off(factor: float) -> float:
        by_row = np.array([row.off(geometry, step * factor) for row in rows])
        return float(np.sqrt(np.mean(by_row**2))) if np.isfinite(by_row).all() else np.inf

    now = off(1.0)
    best = min(FACTORS, key=off)
    if not (now > FAR * size and off(best) < min(now / FAR_BETTER, FAR * size)):
        return
    group = rows[0].group
    entry = numbers.config.get(STEPPERS[0], "microsteps")
    before = None if entry is None else f"{float(entry.text) / best:.10g}"
    what = "the nozzle off the bed" if group == HEIGHTS else "the distances off"
    told = "out of reach" if not np.isfinite(now) else f"{what} by {now:.4g} mm"
    by = f"{best:.10g}" if best > 1.0 else f"1/{1.0 / best:.10g}"
    numbers.refuse(
        rows[0].entry,
        SECTION,
        rows[0].name,
        "import-steps",
        f"the positions of the {len(rows)} {group} were counted in other steps, {by} of those "
        "that the file has now: microsteps were changed since",
        "positions in the steps of now",
        f"--set {group}.microsteps={before or 16}, or calibrate anew with Klipper",
        found=f"with steps as they are now, {told} (rms); with {by} of them by {off(best):.4g} mm",
    )


def _head(numbers: Numbers, geometry: Geometry, rows: Sequence[RawRow]) -> Iterator[str]:
    yield f"#: machine = {quoted(geometry.file.name)}"
    for instrument in dict.fromkeys(row.instrument for row in rows):
        yield f"#: [instrument.{instrument}]"
        if instrument == "calliper":
            yield '#: kind = "separation"'
        else:
            yield '#: kind = "plane"'
            yield '#: frame = "base" # the bed is z = 0, as for the controller'
        touch = _touch(numbers, instrument, rows)
        if any(touch):
            x, y, z = touch
            start = f'["{x!r} mm", "{y!r} mm", "{z!r} mm"]'
            said = f'{{ start = {start}, uncertainty = "{WIDE_OFFSET}" }}'
            yield f"#: target = {said} # what touches the bed; the uncertainty is {ASSUMED}"
        yield f'#: uncertainty = "{UNCERTAINTY[instrument]}" # {ASSUMED}'


def _touch(numbers: Numbers, instrument: str, rows: Sequence[RawRow]) -> tuple[float, ...]:
    """What touches the bed when the probe trips, mm from the nozzle: x, y, z.

    Beside it where the file says so, and below it by the height at which it trips.
    """
    if instrument != "probe":
        return (0.0, 0.0, 0.0)
    beside = []
    for name in ("x_offset", "y_offset"):
        section = next((s for s in PROBES if numbers.has(s, name)), PROBES[0])
        beside.append(numbers.number(section, name, 0.0, expected="mm"))
    height = _one_height(rows, instrument)
    return (*beside, 0.0 if height is None else -height)


def _one_height(rows: Sequence[RawRow], instrument: str) -> float | None:
    """The height at which an instrument found the bed, if it is one for all of its rows."""
    heights = {row.value if row.is_found else None for row in rows if row.instrument == instrument}
    return heights.pop() if len(heights) == 1 else None


def _table(
    geometry: Geometry, rows: Sequence[RawRow], steps: Mapping[str, Floats]
) -> Iterator[str]:
    two = any(len(row.steps) == 2 for row in rows)
    joints = [f"joint.{name} ({geometry.unit})" for name in LIMBS]
    second = [f"to.{name}" for name in joints] if two else []
    yield ", ".join(["instrument", *joints, *second, "distance (mm)", "id"])
    for row in rows:
        at = [geometry.ends - counted * steps[row.group] for counted in row.steps]
        cells = [_cells(joints * geometry.to_unit) for joints in at]
        while len(cells) < 1 + two:
            cells.append([""] * len(LIMBS))
        every = [row.instrument, *(cell for group in cells for cell in group)]
        # A probe touches the bed in every row; paper lies on it at no height.
        height = _one_height(rows, row.instrument)
        touches = height is not None and (row.instrument == "probe" or height == 0.0)
        yield ", ".join([*every, "" if touches else repr(row.value), row.name])


def _cells(joints: Iterable[float]) -> list[str]:
    return [repr(float(joint)) for joint in joints]


def assumptions(text: str) -> tuple[Assumption, ...]:
    """What the measurements say that Klipper did not keep."""
    kept = [name for name in UNCERTAINTY if f"[instrument.{name}]" in text]
    said = ", ".join(f"{name} {UNCERTAINTY[name]}" for name in kept)
    return (Assumption(f"standard uncertainties: {said}", "instrument.*.uncertainty"),)


__all__ = ["SECTION", "SETTINGS", "assumptions", "measurements", "raw_rows"]
