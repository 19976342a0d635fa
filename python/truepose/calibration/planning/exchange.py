"""Which of many possible measurements to make: exact optimal designs by exchange, on plain arrays.

A candidate is a block of k readings, the rows of d(reading)/d(unknown) divided by their standard
uncertainty. What is known after some of them were made is the information matrix
M = prior + sum of B^T B, and the covariance of the unknowns is C = M^-1. Two criteria:

    tool         mean over the rows' groups of trace(S C S^T), least: the variance where it matters
    determinant  log det M, largest: the volume of the ellipsoid of the unknowns, least

A start, greedy or at random, is bettered by exchanging one of its candidates for another until no
exchange helps, then by excursions, which add several before they drop as many. Removing and adding
a block changes C by k columns, so that all candidates are assessed for one removal by matrices of k
rows: with C' = C + s U U^T,

    B C' B^T = B C B^T + s P P^T,                  P = B U
    B C' W C' B^T = B C W C B^T + s (P Q^T + Q P^T) + P (U^T W U) P^T,    Q = B C W U

    V. V. Fedorov, Theory of Optimal Experiments (1972).
    T. J. Mitchell, An algorithm for the construction of "D-optimal" experimental designs,
    Technometrics 16 (1974) 203-210 (DETMAX).
    R. D. Cook and C. J. Nachtsheim, A comparison of algorithms for constructing exact D-optimal
    designs, Technometrics 22 (1980) 315-324: one candidate at a time exchanged for the best other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats, Indices

Criterion = Literal["tool", "determinant"]
CRITERIA: tuple[Criterion, ...] = get_args(Criterion)

Progress = Callable[[int, int], None]

STARTS = 4
"""Random starts beside the greedy one."""

GAIN = 1e-9
"""An exchange that betters the criterion by a smaller share is rounding."""

WIDE = 1e-12
"""An unknown without a prior gets this share of the information that all candidates have of it:
too little to be seen in a result, enough for the first steps of a greedy start."""

MOST_PASSES = 100
"""Passes over a design; five do, the rest is safety."""

LONGEST = 6
"""Candidates that an excursion adds before it drops as many: Mitchell's own."""

LEAST = 1e-10
"""Share of the information along a block that is taken to remain when the block is removed, at
least: what only this block determines is lost all the same, and below this rounding begins."""


RESET = 1e-4
"""After an exchange that took away all but so much of something, all is worked out anew."""


@dataclass(frozen=True, eq=False)
class Design:
    """A chosen set of candidates.

    `chosen` (count,): their numbers; each in its turn is the one that betters the criterion most
    after those before it. `value`: the criterion, a mean variance for "tool", log det M for
    "determinant". `reached` (n,): the value from each start, the greedy one first; all 1 + starts,
    or those that were done when Ctrl-C ended the search (`interrupted`).
    """

    chosen: Indices
    value: float
    reached: Floats
    interrupted: bool


class Candidates:
    """Blocks, what they are wanted for, and what is known before, checked and scaled.

    `blocks` (n_candidate, k, n), rows divided by their uncertainty. `tool` (n_pose, n_component, n)
    or (n_row, n): what the unknowns do where it matters. `prior` (n, n): information before,
    symmetric, a row of zeros for an unknown of which nothing is known; None: of none of them.
    `open` (n,): those unknowns.

    Raises `ValueError` for shapes that contradict each other and numbers that are not finite.
    """

    def __init__(self, blocks: ArrayLike, tool: ArrayLike, prior: ArrayLike | None = None) -> None:
        self.blocks = np.ascontiguousarray(blocks, np.float64)
        if self.blocks.ndim != 3 or 0 in self.blocks.shape:
            raise ValueError(f"blocks have shape {self.blocks.shape}, expected (n_candidate, k, n)")
        self.count, self.readings, size = self.blocks.shape
        tool_effects = np.asarray(tool, np.float64)
        if (
            tool_effects.ndim not in (2, 3)
            or tool_effects.shape[-1] != size
            or 0 in tool_effects.shape
        ):
            raise ValueError(
                f"tool has shape {tool_effects.shape}, expected (n_pose, n_component, {size})"
            )
        known = np.zeros((size, size)) if prior is None else np.array(prior, np.float64)
        if known.shape != (size, size):
            raise ValueError(f"prior has shape {known.shape}, expected ({size}, {size})")
        for name, values in (("blocks", self.blocks), ("tool", tool_effects), ("prior", known)):
            if not np.isfinite(values).all():
                raise ValueError(f"{name} has a value that is not finite")
        rows = self.blocks.reshape(-1, size)
        own = np.diagonal(known)
        self.open: Flags = own == 0.0
        # Unknowns in units of what is known of them before, or else from all candidates together.
        seen = np.where(self.open, np.einsum("ij,ij->j", rows, rows), own)
        self.scale = 1.0 / np.sqrt(np.where(seen > 0.0, seen, 1.0))
        self.blocks = self.blocks * self.scale
        self.rows = self.blocks.reshape(-1, size)
        self.prior = known * np.outer(self.scale, self.scale)
        self.prior[np.diag_indices(size)] += np.where(self.open, WIDE, 0.0)
        tool_rows = tool_effects.reshape(-1, size) * self.scale
        self.weight: Floats = tool_rows.T @ tool_rows / len(tool_effects)

    def information(self, chosen: ArrayLike) -> Floats:
        """(n, n) information of the prior and the candidates `chosen` (m,), scaled."""
        rows = self.blocks[np.asarray(chosen, np.intp)].reshape(-1, self.prior.shape[0])
        return self.prior + rows.T @ rows

    def covariance(self, chosen: ArrayLike) -> Floats:
        """(n, n) covariance of the unknowns after the candidates `chosen` (m,)."""
        return _inverse(self.information(chosen)) * np.outer(self.scale, self.scale)

    def value(self, chosen: ArrayLike, criterion: Criterion = "tool") -> float:
        """The criterion after the candidates `chosen` (m,)."""
        return float(self.values(np.asarray(chosen, np.intp)[np.newaxis], criterion)[0])

    def values(self, sets: ArrayLike, criterion: Criterion = "tool") -> Floats:
        """(n_set,) the criterion of each set of candidates `sets` (n_set, m)."""
        numbers = np.asarray(sets, np.intp)
        values = np.empty(len(numbers))
        for index, chosen in enumerate(numbers):
            lower = np.linalg.cholesky(self.information(chosen))
            if criterion == "determinant":
                values[index] = 2.0 * np.log(np.diagonal(lower) / self.scale).sum()
            else:
                half = np.linalg.inv(lower)
                values[index] = np.einsum("ij,jk,ik->", half, self.weight, half, optimize=True)
        return values


def best(
    candidates: Candidates,
    count: int,
    *,
    criterion: Criterion = "tool",
    starts: int = STARTS,
    seed: int = 0,
    repeats: bool | None = None,
    excursions: bool = True,
    progress: Progress | None = None,
) -> Design:
    """The best `count` candidates that exchanges find, from a greedy and `starts` random starts.

    `repeats`: whether a candidate may be taken more than once; default: only where there are fewer
    than `count`. `excursions`: without them a plan takes a fraction of the time, and is a little
    worse. `progress(starts done, starts)`. The search ends in a set in which no single exchange
    helps; several starts make it likely, not certain, that it is the best of all. Ctrl-C, once
    there is one, gives the best so far.

    Raises `ValueError` for a criterion that is none, a count below one, or more than there are
    candidates where none may be repeated.
    """
    if criterion not in CRITERIA:
        raise ValueError(f"the criterion is {criterion!r}, expected one of {', '.join(CRITERIA)}")
    if count < 1 or starts < 0:
        raise ValueError(f"{count} of the candidates and {starts} starts were asked for")
    again = count > candidates.count if repeats is None else repeats
    if count > candidates.count and not again:
        raise ValueError(f"{count} of {candidates.count} candidates were asked for")
    generator = np.random.default_rng(seed)
    attempts: list[tuple[float, list[int]]] = []
    interrupted = False
    try:
        for start in range(1 + starts):
            if start == 0:
                state = _greedy(candidates, criterion, count, again)
            else:
                drawn = generator.choice(candidates.count, count, replace=again)
                state = ExchangeState(candidates, criterion, drawn.tolist())
            _exchange(state, criterion, again)
            if excursions:
                state = _excursions(state, criterion, again)
            attempts.append((state.loss(), state.chosen))
            if progress is not None:
                progress(start + 1, 1 + starts)
    except KeyboardInterrupt:
        if not attempts:
            raise
        interrupted = True
    chosen = ordered(candidates, min(attempts, key=lambda attempt: attempt[0])[1], criterion)
    reached = np.array([candidates.value(selection, criterion) for _, selection in attempts])
    return Design(chosen, candidates.value(chosen, criterion), reached, interrupted)


def ordered(candidates: Candidates, chosen: ArrayLike, criterion: Criterion = "tool") -> Indices:
    """The same candidates (m,), each the one that helps most after those before it."""
    left = [int(number) for number in np.asarray(chosen, np.intp)]
    state = ExchangeState(candidates, criterion, [])
    while left:
        gains = state.gains(state.seen, state.spread)[left]
        state.add(left.pop(int(np.argmax(gains))))
    return np.array(state.chosen, np.intp)


def greedy(
    candidates: Candidates, count: int, criterion: Criterion = "tool", *, repeats: bool = False
) -> Indices:
    """(count,) candidates taken one after the other, each the one that helps most."""
    return np.array(_greedy(candidates, criterion, count, repeats).chosen, np.intp)


class ExchangeState:
    """A set of candidates, and for all candidates what adding each would do.

    `seen` (n_candidate, k, k): B C B^T. `spread` (n_candidate, k, k): B C W C B^T.
    """

    def __init__(self, candidates: Candidates, criterion: Criterion, chosen: list[int]) -> None:
        self._all = candidates
        self._tool = criterion == "tool"
        self._criterion = criterion
        self.chosen = list(chosen)
        self.refresh()

    def refresh(self) -> None:
        """Work everything out anew from the set itself, so that rounding does not add up."""
        self.covariance = _inverse(self._all.information(self.chosen))
        shape = self._all.blocks.shape
        turned: Floats = (self._all.rows @ self.covariance).reshape(shape)
        self.seen: Floats = turned @ self._all.blocks.swapaxes(1, 2)
        self.spread: Floats = np.zeros((shape[0], 0, 0))
        if self._tool:
            weighed = (turned.reshape(-1, shape[2]) @ self._all.weight).reshape(shape)
            self.spread = weighed @ turned.swapaxes(1, 2)

    def loss(self) -> float:
        """What is to become least."""
        value = self._all.value(self.chosen, self._criterion)
        return value if self._tool else -value

    def loss_with(self, place: int, number: int) -> float:
        """The same with a candidate in a place of the set."""
        chosen = [*self.chosen[:place], number, *self.chosen[place + 1 :]]
        value = self._all.value(chosen, self._criterion)
        return value if self._tool else -value

    def gains(self, seen: Floats, spread: Floats) -> Floats:
        """(n_candidate,) by how much adding each lowers the loss."""
        grown = seen + np.eye(seen.shape[-1])
        if not self._tool:
            return np.asarray(np.linalg.slogdet(grown)[1], np.float64)
        if grown.shape[-1] == 1:
            return np.asarray(spread[:, 0, 0] / grown[:, 0, 0], np.float64)
        solved = np.linalg.solve(grown, spread)
        return np.asarray(np.trace(solved, axis1=1, axis2=2), np.float64)

    def losses(self) -> Floats:
        """(m,) by how much dropping each of the set raises the loss."""
        kept = np.eye(self._all.readings) - self.seen[self.chosen]
        share, axes = np.linalg.eigh(kept)
        share = np.maximum(share, LEAST)
        if not self._tool:
            return np.asarray(-np.log(share).sum(axis=1), np.float64)
        spread = axes.swapaxes(1, 2) @ self.spread[self.chosen] @ axes
        return np.asarray((np.diagonal(spread, axis1=1, axis2=2) / share).sum(axis=1), np.float64)

    def copy(self) -> ExchangeState:
        """Another one that starts where this stands."""
        return ExchangeState(self._all, self._criterion, self.chosen)

    def add(self, number: int) -> None:
        """Add a candidate to the set."""
        self.chosen.append(number)
        self.refresh()

    def drop(self, place: int) -> None:
        """Drop the candidate at a place of the set."""
        del self.chosen[place]
        self.refresh()

    def without(self, place: int) -> _Change:
        """What removing the candidate at a place of the set would do."""
        number = self.chosen[place]
        block = self._all.blocks[number]
        share, axes = np.linalg.eigh(np.eye(self._all.readings) - self.seen[number])
        share = np.maximum(share, LEAST)
        columns: Floats = (self.covariance @ block.T) @ (axes / np.sqrt(share))
        lost = -float(np.log(share).sum())
        if self._tool:
            lost = float(np.einsum("ij,ik,kj->", columns, self._all.weight, columns, optimize=True))
        change = self._change(columns, 1.0, self.covariance, self.seen, self.spread, lost)
        return replace(change, share=float(share.min()))

    def exchange(self, place: int, change: _Change, number: int) -> None:
        """Take a candidate for the one that `change` removed from a place of the set."""
        share, axes = np.linalg.eigh(np.eye(self._all.readings) + change.seen[number])
        block = self._all.blocks[number]
        columns = (change.covariance @ block.T) @ (axes / np.sqrt(share))
        end = self._change(columns, -1.0, change.covariance, change.seen, change.spread, 0.0)
        self.covariance, self.seen, self.spread = end.covariance, end.seen, end.spread
        self.chosen[place] = number
        if change.share < RESET:
            self.refresh()

    def _change(
        self,
        columns: Floats,
        sign: float,
        before: Floats,
        seen: Floats,
        spread: Floats,
        lost: float,
    ) -> _Change:
        """The state with the covariance `before` + sign * columns columns^T."""
        shape = (*self._all.blocks.shape[:2], columns.shape[1])
        along: Floats = (self._all.rows @ columns).reshape(shape)
        covariance = before + sign * (columns @ columns.T)
        next_seen = seen + sign * (along @ along.swapaxes(1, 2))
        if not self._tool:
            return _Change(covariance, next_seen, spread, lost)
        weighed = self._all.weight @ columns
        across: Floats = (self._all.rows @ (before @ weighed)).reshape(shape)
        # P (s Q + P R / 2)^T and its transpose make up all three terms.
        half = sign * across + 0.5 * (along @ (columns.T @ weighed))
        product = along @ half.swapaxes(1, 2)
        next_spread = spread + product + product.swapaxes(1, 2)
        return _Change(covariance, next_seen, next_spread, lost)


@dataclass(frozen=True, eq=False)
class _Change:
    """A state after a removal or an addition.

    `lost`: by how much a removal raises the loss; `share`: of the information along the block that
    is left after it, at least.
    """

    covariance: Floats
    seen: Floats
    spread: Floats
    lost: float
    share: float = 1.0


def _greedy(
    candidates: Candidates, criterion: Criterion, count: int, repeats: bool
) -> ExchangeState:
    state = ExchangeState(candidates, criterion, [])
    for _ in range(count):
        gains = state.gains(state.seen, state.spread)
        if not repeats:
            gains[state.chosen] = -np.inf
        state.add(int(np.argmax(gains)))
    return state


def _exchange(state: ExchangeState, criterion: Criterion, repeats: bool) -> None:
    """Exchange candidates of a set for better ones until no single exchange helps."""
    for _ in range(MOST_PASSES):
        helped = False
        state.refresh()
        reached = state.loss()
        least = GAIN * (abs(reached) if criterion == "tool" else 1.0)
        for place in range(len(state.chosen)):
            change = state.without(place)
            gains = state.gains(change.seen, change.spread)
            own = state.chosen[place]
            if not repeats:
                gains[state.chosen] = -np.inf
            number = int(np.argmax(gains))
            # Taking it again would restore exactly what removing it lost.
            if number == own or gains[number] - change.lost <= least:
                continue
            # Differences of large losses are rounding: the set itself has the last word.
            loss = state.loss_with(place, number)
            if reached - loss > least:
                state.exchange(place, change, number)
                reached, helped = loss, True
        if not helped:
            return


def _excursions(state: ExchangeState, criterion: Criterion, repeats: bool) -> ExchangeState:
    """Better sets by adding several candidates before as many are dropped, exchanged in between.

    A set in which no single exchange helps may be a poor one (Mitchell's excursions).
    """
    length = 2
    while length <= LONGEST:
        tried = state.copy()
        for _ in range(length):
            gains = state.gains(tried.seen, tried.spread)
            if not repeats:
                gains[tried.chosen] = -np.inf
            if not np.isfinite(gains.max()):
                return state
            tried.add(int(np.argmax(gains)))
        for _ in range(length):
            tried.drop(int(np.argmin(tried.losses())))
        least = GAIN * (abs(state.loss()) if criterion == "tool" else 1.0)
        if sorted(tried.chosen) != sorted(state.chosen):
            _exchange(tried, criterion, repeats)
        if state.loss() - tried.loss() > least:
            state, length = tried, 2
        else:
            length += 1
    return state


def _inverse(information: Floats) -> Floats:
    """The inverse of a positive definite matrix, symmetric."""
    half = np.linalg.inv(np.linalg.cholesky(information))
    return half.T @ half
