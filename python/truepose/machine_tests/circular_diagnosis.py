"""Who is to blame for what a circular test shows: causes ranked, and steps where drives turn round.

A cause is what one source says of one kind of parameter of one part. What it does is its share of
the radial deviation F of both paths (mean square, after the centre is taken out):

    known       its own shift alone, exact; of the whole the projection, which can be negative
    uncertain   variance of one variable, to first order; shares add up to 1
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.machine_tests.circle_path import CirclePath
from truepose.machine_tests.circular_quantities import DIRECTIONS
from truepose.machine_tests.seen import Seen
from truepose.runs.displacement import displacement, sum_deviations
from truepose.sources import PoseBlock, Source
from truepose.workpiece.states import PartState, in_space

DRAWN = 256
"""Machines from which the variance of a variable is taken that varies along the path."""

_KINDS = {
    "base": "position of the base joint",
    "platform": "position of the platform joint",
    "length": "length",
    "origin": "position",
    "axis": "tilt",
    "scale": "scale",
    "offset": "offset",
}
"""Name of a parameter within its part -> what it is of the part."""

_OF_SOURCE = {("backlash", "offset"): "play"}
"""The same where the source says it better."""

MOSTLY = 0.6
"""Share of a pattern from which on it has the name of one shape."""

LOBES = {2: "ellipse", 3: "three lobes", 4: "four lobes", 5: "five lobes", 6: "six lobes"}


@dataclass(frozen=True)
class RadialCause:
    """`form`: width of its ring alone, m; of a variable, rms standard uncertainty of F without D.

    `radius`: what it adds to D, m (standard uncertainty of it). `share` of the whole. `shape`: what
    its pattern looks like, empty where that cannot be said.
    """

    name: str
    source: str
    form: float
    radius: float
    share: float
    shape: str = ""


@dataclass(frozen=True)
class TurnStep:
    """A drive that turns round at `angle`, rad, on one of the paths.

    `size`: what F does there by all that is known, m, outwards.
    """

    drive: str
    direction: int
    angle: float
    size: float


def kind_of(parameter: str, source: str = "") -> tuple[str, str]:
    """Part of a parameter (`strut.1`) and what it is of it (`length`)."""
    part, _, rest = parameter.partition(".")
    name, _, attribute = rest.partition(".")
    if not attribute:
        return part, _KINDS.get(name, name)
    first = attribute.split(".")[0]
    return f"{part} {name}", _OF_SOURCE.get((source, first), _KINDS.get(first, first))


def known_causes(seen: Seen, state: PartState, sources: Sequence[Source]) -> list[RadialCause]:
    """What each known cause does alone, the largest share first."""
    total = seen.deviations.reshape(-1)
    size = float(total @ total)
    causes = []
    for source, moved in zip(sources, state.variables.alone, strict=True):
        for label, chosen in _groups(state, source.name, moved[0]):
            values = moved[1][:, chosen]
            if not values.any():
                continue
            error, _ = displacement(
                state.machine,
                state.block.joints,
                state.block.placements,
                (moved[0][chosen], np.ascontiguousarray(values)),
            )
            alone = seen.evaluated(in_space(state.machine, error)[np.newaxis])
            pattern = alone.deviations[0]
            radius = seen.radius_of(alone)[0]
            causes.append(
                RadialCause(
                    f"{source.name}: {label}",
                    source.name,
                    float(seen.quantity(alone, "G_b")[0]),
                    float(radius),
                    float(pattern.reshape(-1) @ total) / size if size > 0.0 else 0.0,
                    shape_of(seen.path.angles, pattern),
                )
            )
    return sorted(causes, key=lambda cause: -abs(cause.share))


def _groups(state: PartState, source: str, parameters: Indices) -> Iterator[tuple[str, Indices]]:
    """Columns of a source's deviation by part and kind of parameter, and what they are called."""
    kinds: dict[str, list[int]] = {}
    for column, parameter in enumerate(parameters.tolist()):
        part, kind = kind_of(state.machine.parameters[parameter], source)
        kinds.setdefault(f"{part}, {kind}", []).append(column)
    for label, columns in kinds.items():
        yield label, np.array(columns, np.intp)


def uncertain_causes(seen: Seen, state: PartState, seed: int) -> list[RadialCause]:
    """What each variable contributes to the variance of F, the largest first."""
    variables = state.variables
    if not variables.names:
        return []
    patterns = seen.patterns(state.effects)  # (v, 2 n)
    deviations = patterns / np.array([one.sigmas for one in variables.distributions])[:, np.newaxis]
    varying = state.varying(seed)
    other = deviations
    if variables.correlation is not None:
        other = variables.correlation @ deviations
    variance = np.einsum("vn,vn->v", deviations, other) / deviations.shape[1]
    radius = np.abs(deviations.mean(axis=1))
    form = np.sqrt(np.square(deviations - deviations.mean(axis=1, keepdims=True)).mean(axis=1))
    if not varying.constant:
        values = varying.along(varying.rows(0, DRAWN), 0)  # (s, 2 n, n_varying)
        for place, at in enumerate(varying.varying.tolist()):
            drawn = values[:, :, place, np.newaxis] * state.effects[:, :, at]
            drawn_patterns = seen.patterns(np.moveaxis(drawn, 0, 2))
            drawn_patterns = drawn_patterns - drawn_patterns.mean(axis=0)
            means = drawn_patterns.mean(axis=1)
            variance[at] = np.square(drawn_patterns).mean()
            radius[at] = np.sqrt(np.square(means).mean())
            form[at] = np.sqrt(np.square(drawn_patterns - means[:, np.newaxis]).mean())
    total = float(variance.sum())
    causes = [
        RadialCause(
            name,
            variables.sources[at],
            float(form[at]),
            float(radius[at]),
            float(variance[at]) / total if total > 0.0 else 0.0,
        )
        for at, name in enumerate(variables.names)
    ]
    return sorted(causes, key=lambda cause: -cause.share)


def shape_of(angles: Floats, pattern: Floats) -> str:
    """What a pattern (2, n) of F looks like, by the share of its sum of squares, in words."""
    total = float(np.square(pattern).sum())
    if total <= 0.0:
        return ""
    mean, apart = pattern.mean(axis=0), 0.5 * (pattern[0] - pattern[1])
    if 2.0 * float(np.square(apart).sum()) > MOSTLY * total:
        return "steps, other one way than the other"
    if 2.0 * len(angles) * float(mean.mean()) ** 2 > MOSTLY * total:
        return "another radius"
    for lobes, name in LOBES.items():
        cos = 2.0 * float((mean * np.cos(lobes * angles)).mean())
        sin = 2.0 * float((mean * np.sin(lobes * angles)).mean())
        if len(angles) * (cos**2 + sin**2) > MOSTLY * total:
            if lobes > 2:
                return name
            along = round(float(np.degrees(0.5 * np.arctan2(sin, cos)))) % 180
            return f"{name}, long at {along} deg"
    return "mixed"


def steps_of(path: CirclePath, state: PartState, sources: Sequence[Source]) -> list[TurnStep]:
    """Where each drive turns round, either way, in the order of drives and angles.

    The step is what all sources' known deviation does when the drive's flank alone is changed from
    that before to that after, at the angle where it turns.
    """
    steps = []
    for joint, drive in enumerate(path.machine.drives):
        for angle, direction_after in _turns(path, joint):
            for way in range(len(DIRECTIONS)):
                flank = direction_after if way == 0 else -direction_after
                size = _step(path, state, sources, joint, angle, flank)
                steps.append(TurnStep(drive.name, way, angle, size))
    return steps


def _turns(path: CirclePath, joint: int) -> Iterator[tuple[float, float]]:
    """Angles, rad, at which a joint turns round, and its direction after it, counter-clockwise.

    By a parabola through three points about the highest, or the lowest.
    """
    at = path.joints[:, joint]
    before, after = at - np.roll(at, 1), np.roll(at, -1) - at
    still = 1e-12 * np.ptp(at)
    width = 2.0 * np.pi / path.count
    for number in np.flatnonzero((before * after < 0.0) & (np.abs(before) > still)):
        bent = before[number] - after[number]
        offset = 0.5 * (before[number] + after[number]) / bent
        yield (
            float((path.angles[number] + offset * width) % (2.0 * np.pi)),
            float(np.sign(after[number])),
        )
    # Two points alike on top: it turns between them.
    for number in np.flatnonzero(np.abs(after) <= still):
        yield (
            float((path.angles[number] + 0.5 * width) % (2.0 * np.pi)),
            float(-np.sign(before[number])),
        )


def _step(
    path: CirclePath,
    state: PartState,
    sources: Sequence[Source],
    joint: int,
    angle: float,
    flank: float,
) -> float:
    """What the radius jumps by, m, where a drive at an angle comes to move in direction `flank`."""
    nearest = round(angle / (2.0 * np.pi) * path.count) % path.count
    pose = path.poses[nearest : nearest + 1]
    joints, placements, _ = path.machine.kernel.place(pose)
    outwards = placements[0, :3] - path.middle
    outwards = outwards / np.linalg.norm(outwards)
    radial = []
    for side in (-flank, flank):
        travel = np.zeros((1, joints.shape[1]))
        travel[0] = path.travel[0][nearest]
        travel[0, joint] = side
        block = PoseBlock(
            path.machine,
            state.block.condition,
            pose,
            np.zeros(1, np.intp),
            joints,
            placements,
            travel,
        )
        deviations = [one.deviation(path.machine, state.block.condition, block) for one in sources]
        moved = sum_deviations((one.parameters, one.shift) for one in deviations)
        error, _ = displacement(path.machine, joints, placements, moved)
        radial.append(float(in_space(path.machine, error)[0] @ outwards))
    return radial[1] - radial[0]
