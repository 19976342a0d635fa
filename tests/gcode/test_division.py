"""Division of moves: looked at closely, the actual machine's tool stays on the programmed path.

Moves are made here by hand, so that nothing but the division is tested; what the tool does between
two written ends is computed pose by pose with `truepose.compensation.commands`.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import ArrayLike

import truepose as tp
from build_machine import MACHINES
from made_source import MadeSource, with_sources
from sweeps import thinned
from truepose._kernel import STATUS
from truepose.compensation.commands import ActualMachine, actual_of_joints, actual_poses
from truepose.controllers.gcode import division
from truepose.controllers.gcode._axes import Axes
from truepose.controllers.gcode._singularity_crossings import singularity_crossings
from truepose.controllers.gcode.division import (
    TOO_SHORT,
    CannotCorrect,
    Divided,
    Division,
    Limits,
    Moves,
)
from truepose.machine import Machine
from truepose.sources import Deviation, PoseBlock

TOLERANCE = 5e-6
LEAST = 1e-5
RAPID, LINE, ARC = 0, 1, 2


def hot(name: str) -> Machine:
    machine = tp.load(MACHINES / f"{name}.toml")
    warm = machine.condition.reference_temperature + 25.0
    return machine.with_condition(
        machine.condition.replace(temperature=warm, force=(300.0, 200.0, -150.0))
    )


def points_of(machine: Machine, poses: ArrayLike) -> np.ndarray:
    """(n, 9) points in mm and degrees of poses (n, n_commanded), SI."""
    axes = Axes(machine)
    given = np.atleast_2d(np.asarray(poses, np.float64))
    return axes.with_poses(np.zeros((len(given), 9)), given)


def lines(points: ArrayLike, kind: int | list[int] = LINE) -> Moves:
    """Straight moves through points (n + 1, 9), the first of which is where they begin."""
    through = np.asarray(points, np.float64)
    start, end = through[:-1], through[1:]
    count = len(end)
    return Moves(
        np.arange(1, count + 1),
        np.broadcast_to(np.asarray(kind, np.uint8), count).copy(),
        start,
        end,
        np.sqrt(np.nansum(np.square(end - start)[:, :3], axis=1)),
        lambda index, share: start[index] + (end - start)[index] * share[:, np.newaxis],
        np.ones(count),
        np.zeros(count, np.bool_),
    )


def arc(centre: ArrayLike, radius: float, start: float, sweep: float, rise: float = 0.0) -> Moves:
    """One arc about `centre` (9,) in X and Y, mm and rad, that rises in Z."""
    middle = np.asarray(centre, np.float64)

    def points(_: object, share: np.ndarray) -> np.ndarray:
        angle = start + sweep * share
        found = np.tile(middle, (len(share), 1))
        found[:, 0] += radius * np.cos(angle)
        found[:, 1] += radius * np.sin(angle)
        found[:, 2] += rise * share
        return found

    ends = points(None, np.array([0.0, 1.0]))
    length = math.hypot(radius * sweep, rise)
    return Moves(
        np.array([1]),
        np.array([ARC], np.uint8),
        ends[:1],
        ends[1:],
        np.array([length]),
        points,
        np.ones(1),
        np.zeros(1, np.bool_),
    )


def divided(machine: Machine, moves: Moves, interpolation: str = "either") -> Divided:
    return divided_from(machine, moves, moves.start[0], interpolation)


def divided_from(
    machine: Machine, moves: Moves, start: np.ndarray, interpolation: str = "either"
) -> Divided:
    limits = Limits(TOLERANCE, LEAST, interpolation)  # type: ignore[arg-type]
    whole = Division(ActualMachine(machine), Axes(machine), limits)
    return whole.divide(moves, whole.at_start(start))


def deviations(
    machine: Machine, moves: Moves, found: Divided, joints: bool, count: int = 23
) -> np.ndarray:
    """(n_piece, count) m how far the tool leaves the path between written ends, seen closely.

    An angle counts times the characteristic length. The first piece, which begins uncorrected, is
    left out.
    """
    axes = Axes(machine)
    unit = np.array(
        [1.0 if n in "xyz" else machine.characteristic_length for n in machine.commanded]
    )
    linear = [at for at, name in enumerate(machine.commanded) if name in "xyz"]
    ends = axes.poses(found.points)
    all_joints = machine.inverse(ends)
    off = []
    for piece in range(1, len(ends)):
        if not found.begins_corrected[piece] or moves.kind[found.move[piece]] == RAPID:
            continue
        move = found.move[piece]
        first = found.shares[piece - 1] if found.move[piece - 1] == move else 0.0
        t = np.linspace(0.0, 1.0, count)
        share = first + (found.shares[piece] - first) * t
        wanted = axes.poses(moves.points(np.full(count, move), share))
        if joints:
            way = all_joints[piece - 1] + np.outer(t, all_joints[piece] - all_joints[piece - 1])
            there, status = actual_of_joints(machine, way, near=wanted)
        else:
            way = ends[piece - 1] + np.outer(t, ends[piece] - ends[piece - 1])
            there, status = actual_poses(machine, way)
        assert not status.any()
        error = (there - wanted) * unit
        away = np.abs(error).max(axis=1)
        off.append(np.maximum(away, np.linalg.norm(error[:, linear], axis=1)))
    return np.array(off)


def zigzag(machine: Machine, count: int, seed: int = 4) -> np.ndarray:
    """(count, 9) points anywhere in the workspace."""
    box = machine.poses()
    random = np.random.default_rng(seed)
    at = random.uniform(box.min(0), box.max(0), (count, box.shape[1]))
    return points_of(machine, at)


NAMES = ["planar_two_slider", "hexapod", "linear_delta", "3rrr", "3prs", "hexaglide"]


@pytest.mark.parametrize("interpolation", thinned(["pose", "either"], {"either"}))
@pytest.mark.parametrize("name", NAMES)
def test_the_tool_stays_within_the_tolerance(name: str, interpolation: str) -> None:
    machine = hot(name)
    moves = lines(zigzag(machine, 6))
    found = divided(machine, moves, interpolation)
    assert found.counts.sum() == len(found.points)
    assert deviations(machine, moves, found, joints=False).max() <= TOLERANCE
    by_joints = deviations(machine, moves, found, joints=True)
    if interpolation == "either":
        assert by_joints.max() <= TOLERANCE
    else:
        assert by_joints.max() > TOLERANCE


@pytest.mark.parametrize(
    "name", thinned(["planar_two_slider", "hexapod", "linear_delta"], {"hexapod"})
)
def test_arcs_and_helices_too(name: str) -> None:
    machine = hot(name)
    centre = points_of(machine, machine.poses().mean(axis=0))[0]
    moves = arc(centre, 30.0, 0.3, -1.5 * math.pi, rise=12.0)
    for interpolation in ("pose", "either"):
        found = divided(machine, moves, interpolation)
        assert deviations(machine, moves, found, joints=False).max() <= TOLERANCE
    assert deviations(machine, moves, found, joints=True).max() <= TOLERANCE
    # Chords of a circle of 30 mm: sagitta r theta^2 / 8.
    least = 1.5 * math.pi / math.sqrt(8.0 * TOLERANCE * 1e3 / 30.0)
    assert len(found.points) < 3.0 * least


def test_no_more_pieces_than_it_takes() -> None:
    """Each two neighbours together would be off by more than what cuts aim at allows."""
    machine = hot("hexapod")
    moves = lines(zigzag(machine, 4))
    found = divided(machine, moves)
    worst = deviations(machine, moves, found, joints=True).max(axis=1)
    # Twice as long a piece is off by four times as much: above the tolerance nearly everywhere.
    assert np.median(worst) > 0.3 * TOLERANCE


def test_short_moves_stay_whole_and_end_corrected() -> None:
    machine = hot("hexapod")
    angle = np.linspace(0.0, 2.0 * math.pi, 400)
    centre = machine.poses().mean(axis=0)
    at = np.tile(centre, (400, 1))
    at[:, 0] += 0.03 * np.cos(angle)
    at[:, 1] += 0.03 * np.sin(angle)
    moves = lines(points_of(machine, at))
    found = divided(machine, moves)
    assert (found.counts == 1).all()
    assert (found.shares == 1.0).all()
    there, status = actual_poses(machine, Axes(machine).poses(found.points))
    assert not status.any()
    assert np.abs(there - Axes(machine).poses(moves.end)).max() < 1e-12
    # The orientation is corrected too, though the program only asks for positions.
    assert np.abs(found.points[:, 3:6]).max() > 1e-4


def test_batches_join_seamlessly() -> None:
    machine = hot("hexapod")
    through = zigzag(machine, 7)
    whole = divided(machine, lines(through))
    limits = Limits(TOLERANCE, LEAST, "either")
    parts = Division(ActualMachine(machine), Axes(machine), limits)
    stand = parts.at_start(through[0])
    points = []
    for first in (0, 2, 3):
        last = {0: 2, 2: 3, 3: 6}[first]
        found = parts.divide(lines(through[first : last + 1]), stand)
        stand = found.stand
        points.append(found.points)
        assert found.begins_corrected[0] == (first > 0)
    assert np.allclose(np.concatenate(points), whole.points, rtol=0, atol=1e-12)


def test_an_s_shaped_deviation_is_seen() -> None:
    """It is nil in the middle of the move and at both ends."""
    base = tp.load(MACHINES / "planar_two_slider.toml")

    def wavy(block: PoseBlock) -> Deviation:
        x = block.placements[:, :1]
        wave = 2e-5 * np.sin(2.0 * math.pi * (x - 0.25) / 0.1)
        return Deviation.of(base.kernel.length_parameters, np.hstack([wave, wave]))

    machine = with_sources(base, MadeSource("wavy", of_block=wavy))
    moves = lines(points_of(machine, [[0.2, 0.2], [0.25, 0.2], [0.35, 0.2]]))
    found = divided(machine, moves, "pose")
    assert found.counts[1] > 4
    assert deviations(machine, moves, found, joints=False, count=101).max() <= TOLERANCE


def test_axes_that_are_not_the_machines_go_along() -> None:
    machine = hot("planar_two_slider")
    through = points_of(machine, [[0.25, 0.15], [0.25, 0.16], [0.37, 0.28]])
    through[:, 2] = [5.0, 5.0, -5.0]
    through[:, 3] = [0.0, 0.0, 90.0]
    found = divided(machine, lines(through))
    assert found.counts[1] > 5
    assert np.allclose(found.points[1:, 2], 5.0 - 10.0 * found.shares[1:], rtol=0, atol=1e-12)
    assert np.allclose(found.points[1:, 3], 90.0 * found.shares[1:], rtol=0, atol=1e-12)


def test_what_is_not_known_stays_unknown() -> None:
    machine = hot("planar_two_slider")
    through = points_of(machine, [[0.25, 0.15], [0.37, 0.28]])
    through[:, 2:] = np.nan
    found = divided(machine, lines(through))
    assert np.isnan(found.points[:, 2:]).all()
    assert np.isfinite(found.points[:, :2]).all()


def test_a_rapid_from_nobody_knows_where() -> None:
    machine = hot("hexapod")
    through = zigzag(machine, 4)
    through[0] = np.nan
    moves = lines(through, [RAPID, LINE, LINE])
    found = divided_from(machine, moves, through[1])
    assert found.counts[0] == 1
    assert found.begins_corrected.tolist() == [False] + [True] * (len(found.points) - 1)
    assert deviations(machine, moves, found, joints=True).max() <= TOLERANCE


def test_a_rapid_stays_one_block_and_the_path_after_it_is_corrected() -> None:
    machine = hot("hexapod")
    through = zigzag(machine, 5)
    moves = lines(through, [RAPID, LINE, RAPID, LINE])
    found = divided(machine, moves)
    assert found.counts[[0, 2]].tolist() == [1, 1]
    assert found.begins_corrected.tolist() == [False] + [True] * (len(found.points) - 1)
    assert deviations(machine, moves, found, joints=True).max() <= TOLERANCE


def test_where_the_controller_goes_by_itself_it_is_not_corrected() -> None:
    machine = hot("planar_two_slider")
    first = lines(points_of(machine, [[0.25, 0.15], [0.26, 0.16]]))
    second = lines(points_of(machine, [[0.30, 0.20], [0.30, 0.201], [0.301, 0.201]]))
    starts = np.concatenate([first.start, second.start])
    ends = np.concatenate([first.end, second.end])
    moves = Moves(
        np.array([1, 3, 4]),
        np.full(3, LINE, np.uint8),
        starts,
        ends,
        np.concatenate([first.length, second.length]),
        lambda index, share: ends[index] + (ends - starts)[index] * (share[:, np.newaxis] - 1.0),
        np.ones(3),
        np.zeros(3, np.bool_),
    )
    found = divided(machine, moves, "pose")
    assert found.begins_corrected.tolist() == [False, False, True]


def refused(machine: Machine, moves: Moves) -> CannotCorrect:
    with pytest.raises(CannotCorrect) as failure:
        divided(machine, moves)
    return failure.value


def test_moves_off_reach_travel_and_branch_are_refused() -> None:
    machine = hot("planar_two_slider")
    good = [[0.25, 0.15], [0.26, 0.15]]
    beyond = refused(machine, lines(points_of(machine, [*good, [0.55, 0.2], [0.3, 0.2]])))
    assert (beyond.move, beyond.status, beyond.of_program) == (1, "unreachable", True)
    top = refused(machine, lines(points_of(machine, [*good, [0.3, 0.6]])))
    assert (top.move, top.status, top.of_program) == (1, "out_of_travel", False)
    with pytest.raises(CannotCorrect, match="unreachable"):
        divided(machine, lines(points_of(machine, [[0.55, 0.2], [0.3, 0.2]])))


@pytest.mark.parametrize("kind", [LINE, RAPID])
def test_what_lies_between_two_good_ends_is_asked_too(kind: int) -> None:
    """The first carriage is at the end of its travel where y = 900 - sqrt(500^2 - x^2), mm.

    Straight lines between points just within that curve pass beyond it.
    """
    machine = hot("planar_two_slider")
    ends = [[0.12, 0.41], [0.298, 0.495]]
    for end in ends:
        assert divided(machine, lines(points_of(machine, [[0.25, 0.15], end]), kind)).counts[0] >= 1
    failure = refused(machine, lines(points_of(machine, [[0.25, 0.15], *ends]), kind))
    assert (failure.move, failure.status) == (1, "out_of_travel")
    x, y = failure.pose
    assert y + math.sqrt(0.25 - x * x) > 0.9


@pytest.mark.parametrize("kind", [LINE, RAPID])
def test_a_way_through_a_singularity_is_refused(kind: int) -> None:
    """Turned by 100 degrees, the three cranks' struts meet in a point on the way."""
    machine = hot("3rrr")
    centre = np.append(machine.poses()[:, :2].mean(axis=0), 0.0)
    turns = np.radians(np.arange(0.0, 170.0, 5.0))
    at = np.tile(centre, (len(turns), 1))
    at[:, 2] = turns
    _, status = machine.inverse(at, status=True)
    reach = at[: int(np.argmax(status != 0)) or len(at)]
    signs = np.sign(np.linalg.det(machine.jac_pose_joint(reach)))
    crossed = int(np.argmax(signs != signs[0]))
    assert crossed > 1
    before = divided(machine, lines(points_of(machine, reach[: crossed - 1]), kind))
    assert len(before.points) >= crossed - 2
    if kind == RAPID:
        failure = refused(machine, lines(points_of(machine, reach[[0, 1, crossed + 1]]), kind))
    else:
        failure = refused(machine, lines(points_of(machine, reach[: crossed + 2]), kind))
    assert failure.status == "singular"


def test_a_way_round_a_singularity_is_taken() -> None:
    """Turned by 129.8 degrees the 3-RRR is singular on a curve round x = y = 0, 11 mm away.

    The chord of half a circle of 20 mm crosses it twice, and both of its ends are on one side.
    """
    machine = tp.load(MACHINES / "3rrr.toml")
    centre = points_of(machine, [0.0, 0.0, math.radians(129.8)])[0]
    moves = arc(centre, 20.0, 0.0, math.pi)
    ends = Axes(machine).poses(np.concatenate([moves.start, moves.end]))
    every = np.concatenate([ends, Axes(machine).poses(centre[np.newaxis])])
    signs = np.sign(np.linalg.det(machine.jac_pose_joint(every)))
    assert signs.tolist() == [-1.0, -1.0, 1.0]
    assert divided(machine, moves, "pose").counts[0] > 10
    for kind in (LINE, RAPID):
        chord = lines(np.concatenate([moves.start, moves.start, moves.end]), kind)
        failure = refused(machine, chord)
        assert failure.move == 1
        assert failure.status in ("singular", "branch_lost")


def test_a_singularity_on_the_way_is_found_by_the_sign_of_the_jacobian() -> None:
    """On random straight ways of the 3-RRR, of which some cross once or twice and most do not."""
    machine = hot("3rrr")
    random = np.random.default_rng(11)
    box = [[-0.05, -0.05, math.radians(70.0)], [0.05, 0.05, math.radians(165.0)]]
    share = np.linspace(0.0, 1.0, 400)[:, np.newaxis]
    ways, crossing, worst = [], [], []
    for begin, end in random.uniform(*box, (300, 2, 3)):
        poses = begin + (end - begin) * share
        _, status = machine.inverse(poses, status=True)
        if status.any():
            continue
        signs = np.sign(np.linalg.det(machine.jac_pose_joint(poses)))
        ways.append((begin, end))
        crossing.append(bool((signs != signs[0]).any()))
        worst.append(machine.conditioning(poses).min())
    begins, ends = (np.array([way[at] for way in ways]) for at in (0, 1))
    found = singularity_crossings(ActualMachine(machine), begins, ends)
    assert 10 < sum(crossing) < len(crossing) - 50
    assert set(np.flatnonzero(crossing)) <= set(found.tolist())
    # Beside those only ways that begin or end on the very brink of one.
    beside = np.setdiff1d(found, np.flatnonzero(crossing))
    assert (np.array(worst)[beside] < 1e-3).all()
    assert beside.size < 3


@pytest.mark.parametrize("step", [0.02, 0.001], ids=["long", "short"])
def test_a_jump_cannot_be_divided(step: float) -> None:
    """As of a play whose side changes: however short the piece, it is half the jump off."""
    base = tp.load(MACHINES / "planar_two_slider.toml")

    def jumping(block: PoseBlock) -> Deviation:
        side = np.where(block.placements[:, :1] < 0.3, 2e-5, -2e-5)
        return Deviation.of(base.kernel.length_parameters, np.hstack([side, side]))

    machine = with_sources(base, MadeSource("jumping", of_block=jumping))
    through = points_of(machine, [[0.3 + at * step, 0.2] for at in (-3, -2, -0.4, 0.6)])
    failure = refused(machine, lines(through))
    assert (failure.move, failure.status) == (2, TOO_SHORT)
    assert failure.off > 1e-5
    assert failure.pose[0] == pytest.approx(0.3, abs=1e-4)


def test_what_is_known_in_the_middle_of_short_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    """The mean of their ends' does, where these hardly differ: the real ones give the same."""
    machine = hot("hexapod")
    angle = np.linspace(0.0, 0.5, 60)
    at = np.tile(machine.poses().mean(axis=0), (60, 1))
    at[:, 0] += 0.03 * np.cos(angle)
    at[:, 1] += 0.03 * np.sin(angle)
    moves = lines(points_of(machine, at))
    actual = ActualMachine(machine)
    asked = []
    known = actual.deviations_at

    def counted(poses: np.ndarray, moved: object = None) -> object:
        asked.append(moved is None)
        return known(poses, moved)  # type: ignore[arg-type]

    monkeypatch.setattr(actual, "deviations_at", counted)
    whole = Division(actual, Axes(machine), Limits(TOLERANCE, LEAST, "either"))
    found = whole.divide(moves, whole.at_start(moves.start[0]))
    assert asked == [True, True, False]
    (inside,) = (points for points in found.looked_at if not points.at_ends)
    assert inside.known is not None
    exact = known(inside.poses)
    assert inside.known.moved[0].tolist() == exact.moved[0].tolist()
    assert np.abs(inside.known.moved[1] - exact.moved[1]).max() < 1e-11
    assert np.abs(exact.moved[1] - exact.moved[1][:1]).max() > 1e-7


def test_many_pieces_and_little_memory_of_what_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = hot("planar_two_slider")
    moves = lines(zigzag(machine, 6))
    whole = divided(machine, moves)
    monkeypatch.setattr(division, "KEPT", 10)
    monkeypatch.setattr(division, "BLOCK", 8)
    monkeypatch.setattr(division, "MOST_PARTS", 3)
    again = divided(machine, moves)
    assert any(points.known is None for points in again.looked_at)
    assert all(points.known is not None for points in whole.looked_at)
    assert deviations(machine, moves, again, joints=True).max() <= TOLERANCE
    looked_at = sum(len(points.piece) for points in again.looked_at)
    assert looked_at >= 2 * len(again.points)
    assert sum(points.weight.sum() for points in again.looked_at) == pytest.approx(
        moves.length.sum() * 1e-3, rel=1e-9
    )


def test_statuses_are_the_kernels() -> None:
    assert {"unreachable", "out_of_travel", "singular"} <= set(STATUS)
    assert TOO_SHORT not in STATUS
