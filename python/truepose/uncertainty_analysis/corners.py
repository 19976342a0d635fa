"""The exact worst case: the corner of the box of variables where something is largest.

Every variable lies between its ends. What is sought at the corners is each component of the error,
both ways, and the size (norm) of each quantity. Few variables: every corner is evaluated. Many: a
directed search, which starts where the linear worst case lies and takes what single variables, and
all patterns of the weakest ones, still gain; where it ends far from the linear worst case it also
starts elsewhere. A direction that is not known has a sphere for its corners: it is turned to where
a linear function through points about it is largest, again and again. It proves nothing: a
proven bound does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.probability.domain import Domain, unit
from truepose.runs.poses import OK

EVERY_VERTEX = 12
"""Variables up to which every corner of their box is evaluated: 4096 of them."""

WEAKEST = 6
"""Variables of least effect whose patterns are all tried where a search has come to rest."""

STARTS = 6
"""Corners of the linear model from which the search for the largest norm starts."""

BENT = 0.02
"""Part by which the worst differs from the linear one where searches from elsewhere are due."""

ELSEWHERE = 24
"""Corners, the same ones every time, from which such searches start."""

SETTLED = 64
"""Steps of a direction towards its corner, far beyond what it takes."""

DIRECTIONS = 96
"""Directions in which the corners of the linear model are looked for."""

GAIN = 1e-12
"""Gain, in what is reached, that is rounding."""

AT_ONCE = 1 << 16
"""Corners evaluated at once."""

ALIKE = 3
"""Decimals to which the variables of two starts agree that are one."""

TURN = 0.3
"""Angle, rad, by which a direction is turned to see where it should go."""

Evaluate = Callable[[Indices, Floats], tuple[Floats, np.ndarray]]
"""Outputs (s, m) and kernel status (s,) of poses (s,) of a block where the variables are (s, v)."""


@dataclass(frozen=True)
class Targets:
    """What is sought: 2 m + q numbers of m outputs.

    Each output upwards, each downwards, then the norm of each of the q quantities (columns of it).
    """

    n_output: int
    quantities: Sequence[Indices] = ()

    @property
    def count(self) -> int:
        """2 m + q."""
        return 2 * self.n_output + len(self.quantities)

    def of(self, outputs: Floats) -> Floats:
        """(..., 2 m + q) from outputs (..., m)."""
        norms = [
            np.sqrt(np.square(outputs[..., columns]).sum(axis=-1)) for columns in self.quantities
        ]
        return np.concatenate(
            [outputs, -outputs, *(norm[..., np.newaxis] for norm in norms)], axis=-1
        )


@dataclass
class WorstCorners:
    """The largest of each target over the corners and the centre, for n poses.

    `most` (n, 2 m + q); `evaluated` (n,) corners; `status` (n,) of the first that failed, else ok.
    """

    most: Floats
    evaluated: Indices
    status: np.ndarray
    search: str = field(default="every vertex")

    def update(self, poses: Indices, targets: Floats, status: np.ndarray, evaluations: int) -> None:
        """Results at `each` corners for every one of `poses` (r,): targets (r, 2 m + q)."""
        np.maximum.at(self.most, poses, targets)
        np.add.at(self.evaluated, poses, evaluations)
        failed = status != OK
        self.status[poses[failed]] = status[failed]


def worst_corners(
    evaluate: Evaluate,
    centre: Floats,
    effects: Floats,
    domain: Domain,
    quantities: Sequence[Indices] = (),
) -> WorstCorners:
    """The exact worst case of n poses.

    `centre` (n, m): exact outputs where every variable is 0; `effects` (n, m, v): first-order
    change where each is +1, from which the search sets out; `domain`: where the variables can lie;
    `quantities`: outputs of each norm.
    """
    targets = Targets(centre.shape[1], quantities)
    n_pose, _, n_variable = effects.shape
    worst = WorstCorners(
        targets.of(centre), np.zeros(n_pose, np.intp), np.full(n_pose, OK, np.uint8)
    )
    if n_variable == 0:
        return worst
    if n_variable <= EVERY_VERTEX and not domain.directions:
        _every(evaluate, targets, worst, at_ends(domain, corners(n_variable)))
        return worst
    worst.search = "directed"
    step = max(1, AT_ONCE // (targets.count * len(directions(3))))
    for start in range(0, n_pose, step):
        poses = np.arange(start, min(start + step, n_pose))
        rows, wanted, t, linear = _starts(targets, centre[poses], effects[poses], domain)
        _climb(evaluate, targets, domain, worst, poses[rows], wanted, t)
        short = np.abs(worst.most[poses] - linear) > BENT * np.abs(linear)
        rows, wanted, t = _elsewhere(short, domain)
        _climb(evaluate, targets, domain, worst, poses[rows], wanted, t)
    return worst


def corners(n_variable: int) -> Floats:
    """(2^n_variable, n_variable) every corner of the box, of -1 and +1."""
    bits = np.arange(2**n_variable)[:, np.newaxis] >> np.arange(n_variable)
    return np.where(bits & 1, -1.0, 1.0)


def at_ends(domain: Domain, t: Floats) -> Floats:
    """(..., v) corners `t`, of -1 and +1, at the ends that the variables have."""
    return np.where(t < 0.0, domain.lower, domain.upper)


def _every(evaluate: Evaluate, targets: Targets, corners: WorstCorners, t: Floats) -> None:
    step = max(1, AT_ONCE // len(t))
    for start in range(0, len(corners.most), step):
        poses = np.arange(start, min(start + step, len(corners.most)))
        outputs, status = evaluate(np.repeat(poses, len(t)), np.tile(t, (poses.size, 1)))
        reached = targets.of(outputs).reshape(poses.size, len(t), targets.count)
        corners.update(poses, reached.max(axis=1), _first_bad(status, poses.size), len(t))


def _first_bad(status: np.ndarray, rows: int) -> np.ndarray:
    """(rows,) the first status that is not ok of each row's equal share of `status`, else ok."""
    table = status.reshape(rows, -1)
    at = np.argmax(table != OK, axis=1)
    return np.asarray(table[np.arange(rows), at])


def _starts(
    targets: Targets, centre: Floats, effects: Floats, domain: Domain
) -> tuple[Indices, Indices, Floats, Floats]:
    """Where searches start: pose (r,), target (r,) and corner (r, v) of each.

    And the worst case (n, 2 m + q) of the linear model.
    """
    n_pose, n_output, n_variable = effects.shape
    ends = [domain.most_along(effects), domain.most_along(-effects)]
    t = [np.concatenate(ends, axis=1).reshape(-1, n_variable)]
    rows = [np.repeat(np.arange(n_pose), 2 * n_output)]
    wanted = [np.tile(np.arange(2 * n_output), n_pose)]
    down, up = domain.reach(effects)
    linear = [centre + up, down - centre]
    for number, columns in enumerate(targets.quantities):
        norms, patterns = linear_norms(centre[:, columns], effects[:, columns], domain)
        linear.append(norms.max(axis=1, keepdims=True))
        for pose in range(n_pose):
            chosen = _distinct(norms[pose], patterns[pose])
            t.append(patterns[pose][chosen])
            rows.append(np.full(chosen.size, pose))
            wanted.append(np.full(chosen.size, 2 * n_output + number))
    return (
        np.concatenate(rows),
        np.concatenate(wanted),
        np.concatenate(t),
        np.concatenate(linear, axis=1),
    )


def _elsewhere(short: Flags, domain: Domain) -> tuple[Indices, Indices, Floats]:
    """Starts as in `_starts` for the poses and targets where `short` (n, 2 m + q)."""
    n_variable = domain.lower.size
    random = np.random.default_rng(n_variable)
    few = at_ends(domain, np.where(random.integers(0, 2, (ELSEWHERE, n_variable)), 1.0, -1.0))
    for members in domain.directions:
        few[:, members] = unit(random.standard_normal((ELSEWHERE, members.size)))
    rows, wanted = np.nonzero(short)
    return (
        np.repeat(rows, ELSEWHERE),
        np.repeat(wanted, ELSEWHERE),
        np.tile(few, (rows.size, 1)),
    )


def _distinct(norms: Floats, patterns: Floats) -> Indices:
    """Up to `STARTS` patterns (d, v) that differ, of the largest `norms` (d,)."""
    chosen: dict[bytes, int] = {}
    rounded = np.round(patterns, ALIKE)
    for at in np.argsort(-norms, kind="stable"):
        chosen.setdefault(rounded[at].tobytes(), int(at))
        if len(chosen) == STARTS:
            break
    return np.array(list(chosen.values()), np.intp)


def linear_norms(centre: Floats, effects: Floats, domain: Domain) -> tuple[Floats, Floats]:
    """Corners where the norm of the linear model is largest, as far as directions find them.

    The linear model maps the box to a zonotope (with directions, a sum of one and of ellipsoids);
    its point furthest along u is that of the corner along u . effects. From each direction on to
    that of the point found, the norm never falls, and it comes to rest where it is largest nearby.

    `centre` (n, k), `effects` (n, k, v) -> norms (n, d) and corners (n, d, v).
    """
    along = np.repeat(directions(centre.shape[1])[np.newaxis], len(centre), axis=0)
    norms = np.full(along.shape[:2], -1.0)
    t = np.ones((*along.shape[:2], effects.shape[2]))
    for _ in range(SETTLED):
        further = domain.most_along(along @ effects)
        points = centre[:, np.newaxis] + further @ effects.transpose(0, 2, 1)
        reached = np.sqrt(np.square(points).sum(axis=2))
        better = reached > norms * (1.0 + GAIN)
        if not better.any():
            break
        norms = np.where(better, reached, norms)
        t = np.where(better[:, :, np.newaxis], further, t)
        along = points / np.where(reached > 0.0, reached, 1.0)[:, :, np.newaxis]
    return norms, t


def directions(n: int) -> Floats:
    """(d, n) unit vectors spread evenly over all directions, the axes among them; n up to 3."""
    axes: Floats = np.concatenate([np.eye(n), -np.eye(n)])
    if n == 1:
        return axes
    if n == 2:
        angle = 2.0 * math.pi * (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
        return np.concatenate([axes, np.stack([np.cos(angle), np.sin(angle)], axis=1)])
    # A spiral of the golden angle.
    height = 1.0 - (2.0 * np.arange(DIRECTIONS) + 1.0) / DIRECTIONS
    turn = math.pi * (3.0 - math.sqrt(5.0)) * np.arange(DIRECTIONS)
    radius = np.sqrt(1.0 - height**2)
    spiral = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    return np.concatenate([axes, spiral])


def _climb(
    evaluate: Evaluate,
    targets: Targets,
    domain: Domain,
    corners: WorstCorners,
    poses: Indices,
    wanted: Indices,
    t: Floats,
) -> None:
    """From corners `t` (r, v), each towards more of its target, until nothing tried gains."""
    step = max(1, AT_ONCE // max(t.shape[1], 2**WEAKEST))
    for start in range(0, len(t), step):
        rows = slice(start, start + step)
        _climb_some(_Tried(evaluate, targets, domain, corners, poses[rows], wanted[rows]), t[rows])


def _climb_some(tried: _Tried, t: Floats) -> None:
    score = tried.scores(t[:, np.newaxis])[:, 0]
    while True:
        fine = tried.found.status[tried.poses] == OK
        tried, t, score = tried.only(fine), t[fine], score[fine]
        if not t.size:
            return
        t, score = _turned(tried, t, score)
        single = np.flatnonzero(tried.domain.single)
        if not single.size:
            return
        gains = tried.scores(_flips(t, tried.domain)) - score[:, np.newaxis]
        improving = gains > GAIN * np.abs(score[:, np.newaxis])
        # All that gain by themselves at once, or the best alone where that gives more.
        other, rows = _other_end(t, tried.domain), np.arange(len(t))
        together, alone = t.copy(), t.copy()
        together[:, single] = np.where(improving, other[:, single], t[:, single])
        best = single[np.argmax(gains, axis=1)]
        alone[rows, best] = other[rows, best]
        better, reached = _best(tried, np.stack([together, alone], axis=1))
        rest: Flags = np.asarray(~improving.any(axis=1))
        if rest.any():
            patterns = _patterns(t[rest], gains[rest], tried.domain)
            better[rest], reached[rest] = _best(tried.only(rest), patterns)
        gained = reached > score + GAIN * np.abs(score)
        tried, t, score = tried.only(gained), better[gained], reached[gained]


def _turned(tried: _Tried, t: Floats, score: Floats) -> tuple[Floats, Floats]:
    """Corners `t` (r, v) and their scores (r,) with every direction turned to where it gains.

    A function that is linear in the direction d has, along each tangent a, f(d cos T + a sin T)
    and f(d cos T - a sin T) from which its gradient follows; d turns to it. What is not quite
    linear takes several turns, and comes to rest where one no longer gains.
    """
    for members in tried.domain.directions:
        going: Flags = np.ones(len(t), np.bool_)
        for _ in range(SETTLED):
            rows = np.flatnonzero(going)
            if not rows.size:
                break
            now, some = t[rows], tried.only(np.asarray(going))
            aside = _tangents(now[:, members])
            tried_t = np.repeat(now[:, np.newaxis], 2 * aside.shape[1], axis=1)
            ahead = math.cos(TURN) * now[:, np.newaxis, members]
            tried_t[:, ::2, members] = ahead + math.sin(TURN) * aside
            tried_t[:, 1::2, members] = ahead - math.sin(TURN) * aside
            around = some.scores(tried_t)
            up, down = around[:, ::2], around[:, 1::2]
            slopes = (up - down) / (2.0 * math.sin(TURN))
            level = 2.0 * score[rows, np.newaxis] - up - down
            along = level.mean(axis=1) / (2.0 * (1.0 - math.cos(TURN)))
            to = along[:, np.newaxis] * now[:, members]
            to = to + (slopes[:, :, np.newaxis] * aside).sum(axis=1)
            now[:, members] = unit(np.where(np.isfinite(to), to, now[:, members]))
            reached = some.scores(now[:, np.newaxis])[:, 0]
            gained = reached > score[rows] + GAIN * np.abs(score[rows])
            going[rows[~gained]] = False
            t[rows[gained]], score[rows[gained]] = now[gained], reached[gained]
    return t, score


def _tangents(directions: Floats) -> Floats:
    """(r, d - 1, d) unit vectors across unit vectors (r, d), d of 2 or 3, and each other."""
    if directions.shape[1] == 2:
        return np.stack([-directions[:, 1], directions[:, 0]], axis=1)[:, np.newaxis]
    least = np.eye(3)[np.argmin(np.abs(directions), axis=1)]
    first = unit(np.cross(directions, least))
    return np.stack([first, np.cross(directions, first)], axis=1)


@dataclass(frozen=True)
class _Tried:
    """Corners evaluated for some searches, each with its pose and the target it wants."""

    evaluate: Evaluate
    targets: Targets
    domain: Domain
    found: WorstCorners
    poses: Indices
    wanted: Indices

    def only(self, rows: Flags) -> _Tried:
        """Some of the searches."""
        return replace(self, poses=self.poses[rows], wanted=self.wanted[rows])

    def scores(self, t: Floats) -> Floats:
        """(r, p) what the wanted target is at the corners `t` (r, p, v); -inf where it fails."""
        rows, count, n_variable = t.shape
        outputs, status = self.evaluate(np.repeat(self.poses, count), t.reshape(-1, n_variable))
        reached = self.targets.of(outputs).reshape(rows, count, self.targets.count)
        self.found.update(self.poses, reached.max(axis=1), _first_bad(status, rows), count)
        lengths = np.take_along_axis(reached, self.wanted[:, np.newaxis, np.newaxis], axis=2)[
            ..., 0
        ]
        scores: Floats = np.where(np.isfinite(lengths), lengths, -np.inf)
        return scores


def _best(tried: _Tried, t: Floats) -> tuple[Floats, Floats]:
    """The best corner of each row of `t` (r, p, v), (r, v), and its score (r,)."""
    scores = tried.scores(t)
    rows, best = np.arange(len(t)), np.argmax(scores, axis=1)
    return t[rows, best], scores[rows, best]


def _other_end(t: Floats, domain: Domain) -> Floats:
    """(r, v) each variable of `t` (r, v) at its other end."""
    other: Floats = np.where(t == domain.lower, domain.upper, domain.lower)
    return other


def _flips(t: Floats, domain: Domain) -> Floats:
    """(r, s, v) the corners beside `t` (r, v): in each another single variable at its other end."""
    single = np.flatnonzero(domain.single)
    beside = np.repeat(t[:, np.newaxis], single.size, axis=1)
    beside[:, np.arange(single.size), single] = _other_end(t, domain)[:, single]
    return beside


def _patterns(t: Floats, gains: Floats, domain: Domain) -> Floats:
    """(r, 2^w, v) corners `t` (r, v) with every pattern of the w single ones of least effect."""
    single = np.flatnonzero(domain.single)
    weakest = single[np.argsort(np.abs(gains), axis=1)[:, :WEAKEST]]
    patterns = corners(weakest.shape[1])
    tried = np.repeat(t[:, np.newaxis, :], len(patterns), axis=1)
    for at in range(weakest.shape[1]):
        ends = np.where(patterns[:, at] < 0.0, *_ends_of(domain, weakest[:, at, np.newaxis]))
        tried[np.arange(len(t)), :, weakest[:, at]] = ends
    return tried


def _ends_of(domain: Domain, variables: Indices) -> tuple[Floats, Floats]:
    return domain.lower[variables], domain.upper[variables]
