"""The cheapest measurement that would turn the gate's verdict."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.acceptance import sentences
from truepose.calibration.acceptance.assessment import Case, Outcome
from truepose.calibration.acceptance.decision import lacking

if TYPE_CHECKING:
    from truepose.calibration.identification.unknowns import Unknowns


CALIPER: Mapping[str, float] = {"m": 20e-6}
"""Standard uncertainty of measuring one unknown directly, by unit."""
EASY, HARD = 1.0, 3.0
"""Cost of measuring an unknown directly: the length of a part in the hand, or anything else."""
MOST_PAIRED = 8
"""Candidates of which all pairs are tried: those that help most by themselves."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A measurement that could be added: `rows` (k, n) whitened, `cost` in anyone's unit.

    `sentence`: "probe in x and y too". `direct`: one that measures unknowns themselves.
    """

    name: str
    cost: float
    sentence: str
    rows: Floats
    direct: bool = False


@dataclass(frozen=True)
class Remedy:
    """The cheapest candidates with which the answer is yes; none where nothing tried helps.

    `names` of those, `cost` of all together, `sentence` with an alternative of the other sort, if
    any. `position`, `rotation`: the highest uncertainty at the tool with it, m and rad.
    """

    names: tuple[str, ...]
    cost: float
    sentence: str
    position: float = float("nan")
    rotation: float = float("nan")

    @property
    def helps(self) -> bool:
        """Whether something was found."""
        return bool(self.names)


def direct_candidates(unknowns: Unknowns, uncertainty: Mapping[str, float]) -> list[Candidate]:
    """Measuring each unknown of the machine by itself, and each family as a whole.

    `uncertainty`: standard, by unit; unknowns in other units cannot be measured by themselves.
    """
    n = len(unknowns.names)
    labels = unknowns.labels[: unknowns.n_machine]
    single: dict[str, Candidate] = {}
    families: dict[str, list[str]] = {}
    for index, label in enumerate(labels):
        sigma = uncertainty.get(unknowns.units[index])
        if sigma is None:
            continue
        row = np.zeros((1, n))
        row[0, index] = 1.0 / sigma
        to = f"(to {sentences.stated(sigma, unknowns.units[index], unknowns.shown)})"
        cost = EASY if "length" in re.split(r"[ _-]", label) else HARD
        single[label] = Candidate(label, cost, f"measure {label} {to}", row, direct=True)
        families.setdefault(sentences.family(label, labels)[0], []).append(label)
    candidates = list(single.values())
    for members in families.values():
        if len(members) > 1:
            parts = [single[label] for label in members]
            to = parts[0].sentence[parts[0].sentence.rindex("(") :]
            what = sentences.some(members[0], labels, "every")
            rows = np.vstack([part.rows for part in parts])
            candidates.append(
                Candidate(
                    what,
                    sum(part.cost for part in parts),
                    f"measure {what} {to}",
                    rows,
                    direct=True,
                )
            )
    return candidates


def cheapest_remedy(case: Case, candidates: Sequence[Candidate]) -> Remedy:
    """The cheapest candidate with which nothing is left open, else the cheapest pair.

    Among equally cheap ones it is the one that leaves the tool least uncertain.
    """
    if not candidates:
        return Remedy((), 0.0, "no further measurement was tried")
    outcomes = [case.outcome(candidate.rows) for candidate in candidates]
    missing = [len(lacking(case, outcome)) for outcome in outcomes]
    sufficient = [i for i, count in enumerate(missing) if not count]
    if sufficient:
        sufficient.sort(key=lambda i: (candidates[i].cost, outcomes[i].after.position_max, i))
        best = sufficient[0]
        sentence = _named(case, candidates, sufficient, best)
        of_other_sort = [i for i in sufficient if candidates[i].direct != candidates[best].direct]
        if of_other_sort:
            sentence += f", or {_named(case, candidates, sufficient, of_other_sort[0])}"
        return _remedy((candidates[best],), outcomes[best], sentence)
    left = [outcome.after.position_max + outcome.after.rotation_max for outcome in outcomes]
    helpful = sorted(range(len(candidates)), key=lambda i: (missing[i], left[i], i))[:MOST_PAIRED]
    pairs = sorted(
        combinations(sorted(helpful), 2), key=lambda pair: sum(candidates[i].cost for i in pair)
    )
    for pair in pairs:
        parts = tuple(candidates[i] for i in pair)
        outcome = case.outcome(np.vstack([part.rows for part in parts]))
        if not lacking(case, outcome):
            return _remedy(parts, outcome, f"{parts[0].sentence} and {parts[1].sentence}")
    return Remedy((), 0.0, "none of the further measurements that were tried helps")


def _remedy(parts: tuple[Candidate, ...], outcome: Outcome, sentence: str) -> Remedy:
    return Remedy(
        tuple(part.name for part in parts),
        sum(part.cost for part in parts),
        sentence,
        outcome.after.position_max,
        outcome.after.rotation_max,
    )


def _named(case: Case, candidates: Sequence[Candidate], sufficient: Sequence[int], at: int) -> str:
    """The candidate's sentence; "one rod length" where any of the family would do."""
    best = candidates[at]
    if not best.direct or best.name not in case.labels:
        return best.sentence
    _, relatives = sentences.family(best.name, case.labels)
    helping = {candidates[i].name for i in sufficient}
    if len(relatives) > 1 and helping.issuperset(relatives):
        return best.sentence.replace(best.name, sentences.some(best.name, case.labels, "one"), 1)
    return best.sentence
