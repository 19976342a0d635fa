"""The verdict: whether a machine keeps the accuracy asked, one function for every command.

    met         a bound that holds is at most the target, at every pose
    NOT met     a machine inside the set, solved exactly, exceeds it: the witness
    undecided   neither: what is known is between which two numbers

The bound is the linear maximum with its proven remainder (`survey`) or, where that does not decide,
the proof engine's, asked with an effort counted in boxes. At a coverage the number is a quantile
(`coverage`). Before and after compensation are the same set at two commands (`states`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from truepose._kernel import STATUS
from truepose.arrays import Floats, Indices, sorted_union
from truepose.errors import Problem, RequestError
from truepose.language import grouped, say
from truepose.machine import Condition, Machine
from truepose.runs.arguments import checked
from truepose.runs.poses import OK, Progress, reason_text
from truepose.runs.quantities import quantities
from truepose.runs.variables import Variables
from truepose.verdict import engine
from truepose.verdict.answer import MET, NOT_MET, UNDECIDED, Answer, Answers, Number
from truepose.verdict.coverage import MOST_POSES, QUICK, QUICK_DRAWS, QUICK_POSES, coverage
from truepose.verdict.search import farthest
from truepose.verdict.states import STATES, Blocks, Population, State
from truepose.verdict.survey import Survey, survey
from truepose.verdict.witness import Witness

LOOKED_AT = 4
"""Poses at which a witness is searched for, of the worst by the linear maximum."""

ALIKE = 1e-9
"""Of a number: what rounding may make of it. Which of two such poses is named is then the first."""

UNASKED = 8
"""Poses sampled of a quantity that nothing is asked of."""

OPEN = 32
"""Poses that no proof decides at which one is searched for after that."""


@checked
def accuracy(
    machine: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    *,
    states: Sequence[str] = STATES,
    progress: Progress | None = None,
) -> tuple[Answer, ...]:
    """Whether the accuracy asked in the machine file is kept, before and after compensation.

    An `Answer` for each of the `states`, of the position and, where the platform turns, of the
    orientation; also where nothing is asked, for its numbers. `poses` (..., n_commanded), SI,
    default the file's workspace; `condition`, default the file's; `progress` is called with (poses
    done, poses in all).

    Raises as `truepose.budget`, and `RequestError` (unknown-choice) for another state.
    """
    asked = required_states(states)
    population = Population(machine, poses, condition, progress)
    every: list[Answer] = []
    for state in asked:
        every += answers(population, state)
    used = population.used
    left_out = len(population.table) - used
    return Answers(
        replace(a, poses_used=used, poses_left_out=left_out, machine=machine) for a in every
    )


def required_states(states: Sequence[str]) -> tuple[str, ...]:
    """Each state once. A word alone is refused too: its letters are no states."""
    unknown = [states] if isinstance(states, str) else [s for s in states if s not in STATES]
    if not unknown and states:
        return tuple(dict.fromkeys(states))
    raise RequestError(
        Problem(
            "unknown-choice",
            "states: expected states of a machine",
            found=", ".join(repr(state) for state in unknown) or "none",
            expected="some of " + ", ".join(f'"{state}"' for state in STATES),
            hint='a single one is a tuple too: states=("before compensation",)',
        )
    )


def answers(population: Population, state: str) -> list[Answer]:
    """The answers of one state."""
    machine = population.machine
    kinds = quantities(machine.components)
    asked = [
        {"position": machine.accuracy.target, "orientation": machine.accuracy.angle_target}[kind]
        for kind in kinds
    ]
    if machine.accuracy.at is not None:
        return [
            at_coverage(
                population,
                state,
                kind,
                machine.accuracy.at,
                target,
                most_poses=UNASKED if target is None else MOST_POSES,
            )
            for kind, target in zip(kinds, asked, strict=True)
        ]
    surveyed = survey(population.states(state), list(kinds.values()))
    seen: list[Witness] = [
        _witnessed(population, state, surveyed, at, columns)
        for at, columns in enumerate(kinds.values())
    ]
    open_ = [
        target is not None and not _exceeds(witness, target)
        for witness, target in zip(seen, asked, strict=True)
    ]
    proof = _proved(population, state, surveyed, asked, open_)
    for at, (columns, target) in enumerate(zip(kinds.values(), asked, strict=True)):
        if open_[at] and target is not None:
            left = np.flatnonzero(proof.bound[:, at] > target)
            # What no proof reaches may be because there is none.
            worst = left[_largest(surveyed.linear[left, at], OPEN)]
            numbers = surveyed.numbers[worst]
            seen[at] = _farthest(population, state, numbers, at, columns, seen[at]) or seen[at]
    return [
        _answer(population, state, kind, at, asked[at], surveyed, seen[at], proof)
        for at, kind in enumerate(kinds)
    ]


def at_quick_coverage(population: Population, name: str, kind: str) -> Answer:
    """At 95 % of all machines, with the effort of an overview: nothing is asked of it."""
    return at_coverage(
        population, name, kind, QUICK, None, most_poses=QUICK_POSES, most_draws=QUICK_DRAWS
    )


def at_coverage(
    population: Population,
    name: str,
    kind: str,
    probability: float,
    target: float | None,
    *,
    most_poses: int = MOST_POSES,
    most_draws: int | None = None,
) -> Answer:
    """The answer of one quantity in one state at a coverage: the quantile at the worst pose.

    `most_poses` and `most_draws`: effort, as of `coverage`.

    Where the machine cannot be commanded so at some pose, no share of all machines keeps anything.
    """
    lost = [
        state.at(int(np.flatnonzero(state.status != OK)[0]))
        for state in population.states(name)
        if (state.status != OK).any()
    ]
    if lost:
        columns = quantities(population.machine.components)[kind]
        witness = _at_pose(lost[0], kind, columns)
        none = Number(witness.size, witness.number, witness.pose)
        answer = None if target is None else NOT_MET
        return Answer(kind, name, target, answer, none, none, none, _of_witness(witness), witness)
    sampled = coverage(
        population.machine,
        Blocks(population, name),
        kind,
        probability,
        target,
        most_poses=most_poses,
        most_draws=most_draws,
    )
    pose = population.table[sampled.pose]
    estimate, lower, upper = (
        Number(value, sampled.pose, pose)
        for value in (sampled.estimate, sampled.lower, sampled.upper)
    )
    return Answer(
        kind, name, target, sampled.answer, lower, estimate, upper, sampled.rests_on, None, sampled
    )


def _exceeds(witness: Witness, target: float) -> bool:
    return not witness.size <= target


def _witnessed(
    population: Population, name: str, surveyed: Survey, at: int, columns: Indices
) -> Witness:
    """The farthest machine at the poses where the linear one, or its first witness, is farthest."""
    chosen = [
        _largest(surveyed.linear[:, at], LOOKED_AT),
        _largest(surveyed.witness[:, at], 1),
        _largest(surveyed.bound[:, at], 1),
    ]
    numbers = surveyed.numbers[sorted_union(*chosen)]
    best = _farthest(population, name, numbers, at, columns)
    assert best is not None
    return best


def _farthest(
    population: Population,
    name: str,
    numbers: Indices,
    at: int,
    columns: Indices,
    known: Witness | None = None,
) -> Witness | None:
    """The farthest machine at some poses, or the one that is `known` already."""
    kind = list(quantities(population.machine.components))[at]
    best = known
    for state in population.at(name, numbers):
        for pose in range(state.block.indices.size):
            seen = _at_pose(state.at(pose), kind, columns)
            if best is None or seen.size > best.size:
                best = seen
    return best


def _largest(values: Floats, count: int) -> Indices:
    """Indices of the largest `values` (n,), of those equal but for rounding the first ones."""
    left = values.copy()
    chosen = []
    for _ in range(min(count, values.size)):
        top = float(left.max())
        least = top if np.isinf(top) else top - ALIKE * abs(top)
        chosen.append(int(np.flatnonzero(left >= least)[0]))
        left[chosen[-1]] = -np.inf
    return np.array(chosen, np.intp)


def _at_pose(state: State, kind: str, columns: Indices) -> Witness:
    """The farthest machine of a state at one pose."""
    number = int(state.block.indices[0])
    word = STATUS[int(state.status[0])]
    t, error, size = np.zeros(len(state.variables.names)), None, np.inf
    if state.status[0] == OK:
        reached = farthest(state, columns)
        t, size = reached.t, reached.size
        word = STATUS[reached.status]
        error = reached.error if reached.status == OK else None
    return Witness(
        state=state.name,
        quantity=kind,
        machine=state.machine.with_condition(state.block.condition),
        pose=state.block.requested[number],
        number=number,
        joints=state.block.joints[0],
        spread=state.variables,
        t=t,
        error=error,
        size=size,
        status=word,
        commanded=bool(state.status[0] == OK),
    )


@dataclass(frozen=True, eq=False)
class _Proof:
    """Bounds (n, q) after the engine was asked, in how many boxes, and why it was not."""

    bound: Floats
    boxes: int
    refused: str


def _proved(
    population: Population,
    name: str,
    surveyed: Survey,
    asked: Sequence[float | None],
    open_: Sequence[bool],
) -> _Proof:
    """The survey's bounds, and the engine's where these do not decide what is open."""
    bound = surveyed.bound.copy()
    limits = np.array([np.inf if target is None else target for target in asked])
    above = np.asarray(open_) & (bound > limits)
    needed = np.flatnonzero(above.any(axis=1))
    share = np.divide(bound, limits, out=np.zeros_like(bound), where=above)
    worst = share.max(axis=1)[needed]
    # Where no remainder is proven the linear maximum says which pose is worst.
    worst = np.where(np.isfinite(worst), worst, (surveyed.linear / limits).max(axis=1)[needed])
    in_order = needed[np.argsort(-worst, kind="stable")]
    left, refused = engine.EFFORT, ""
    for start in range(0, in_order.size, engine.AT_ONCE):
        if left <= 0 or refused:
            break
        rows = np.sort(in_order[start : start + engine.AT_ONCE])
        for state in population.at(name, surveyed.numbers[rows]):
            refused = engine.refused(state)
            boxes = min(engine.EACH, max(1, left // state.block.indices.size))
            proven, used = engine.bounds(state, asked, boxes)
            left -= used
            at = np.searchsorted(surveyed.numbers, state.block.indices)
            bound[at] = np.minimum(bound[at], proven)
    return _Proof(bound, engine.EFFORT - left, refused)


def _answer(
    population: Population,
    name: str,
    kind: str,
    at: int,
    target: float | None,
    surveyed: Survey,
    witness: Witness,
    proof: _Proof,
) -> Answer:
    linear = _number(population, surveyed, surveyed.linear[:, at])
    bound = _number(population, surveyed, proof.bound[:, at])
    seen = Number(witness.size, witness.number, witness.pose)
    # An enclosure holds what rounding may do; what was found is not above it for that reason.
    answer, rests_on = None, say("the linear maximum")
    if target is not None:
        if _exceeds(witness, target):
            answer, rests_on = NOT_MET, _of_witness(witness)
        elif bound.value <= target:
            by_engine = bool((surveyed.bound[:, at] > target).any())
            answer = MET
            rests_on = say("the linear maximum and its proven remainder")
            if by_engine:
                rests_on = say(
                    "the linear maximum and its proven remainder, the proof engine ({boxes} boxes)",
                    boxes=grouped(proof.boxes),
                )
        else:
            answer, rests_on = UNDECIDED, _why_open(bound, proof)
    rests_on += _ends_taken(witness.spread)
    return Answer(kind, name, target, answer, seen, linear, bound, rests_on, witness)


def _ends_taken(variables: Variables) -> str:
    """Where distributions without ends are taken to end; empty where all have ends."""
    endless = dict.fromkeys(
        str(distribution) for distribution in variables.distributions if not distribution.bounded
    )
    if not endless:
        return ""
    return "; " + say("taken to end there: {ends}", ends="; ".join(endless))


def _number(population: Population, surveyed: Survey, values: Floats) -> Number:
    row = int(_largest(values, 1)[0])
    number = int(surveyed.numbers[row])
    return Number(float(values.max()), number, population.table[number])


def _of_witness(witness: Witness) -> str:
    if witness.status == "ok":
        return say("one machine inside the bands, solved exactly")
    why = reason_text(witness.status)
    if witness.commanded:
        return say("one machine inside the bands that cannot be assembled ({why})", why=why)
    return say("a command that the machine cannot follow ({why})", why=why)


def _why_open(bound: Number, proof: _Proof) -> str:
    if proof.refused:
        return say("no proof: {why}", why=proof.refused)
    if np.isinf(bound.value):
        return say("no proof within {boxes} boxes", boxes=grouped(proof.boxes))
    return say("what is found and what is proven, within {boxes} boxes", boxes=grouped(proof.boxes))


__all__ = ["accuracy", "answers", "at_coverage", "at_quick_coverage", "required_states"]
