"""Plain words for what measurements cannot tell apart, and numbers as people read them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats
from truepose.files.shown_units import METRIC, ShownUnits
from truepose.language import marked, say, say_counted

NAMED = 0.1
"""Of the largest part of a direction: smaller parts are not named."""
MOST_NAMES = 6
"""A longer list is cut."""
MOST_DETAILED = 4
"""In a longer list incomplete families are named as a whole."""
MOST_SENTENCES = 3
ALIKE = 5.0
"""Singular values within this factor are of one cluster."""
_MEMBER = re.compile(r"^(.*\w)[ ,_-]+([A-Za-z]|[A-Za-z]?\d+)$")
_NUMBERED = re.compile(r"^(\w+) (\d+)$")
_OF_PART = re.compile(r"^(.+) of (?:the )?([A-Za-z]+)$")


# --- numbers -------------------------------------------------------------------------------------


def quantity(value: float, unit: str, digits: int = 2, units: ShownUnits = METRIC) -> str:
    """A size in SI with sensible digits and unit: "3.7 mm", "65 µm", "0.13°", "8.0 mdeg".

    From 0.1 mm (0.01 in) and 1 mrad on in the unit of dimensions, below in that of errors.
    """
    if not math.isfinite(value):
        return say("without limit") if value > 0.0 else "–"
    if unit in ("m", "rad"):
        small = abs(value) < (0.999 * units.least_dimension if unit == "m" else 0.999e-3)
        shown = units.small(unit) if small else units.of(unit)
        gap = "" if shown.label == "°" else " "
        text = f"{_digits(value * shown.per_si, digits)}{gap}{shown.label}"
    elif unit == "1":
        text = _digits(value, digits)
    else:
        text = marked(f"{value:.{digits}g} {unit}")
    return text.replace("-", "\N{MINUS SIGN}")


def stated(value: float, unit: str, units: ShownUnits = METRIC) -> str:
    """A size that somebody chose, without zeros at its end: "0.5 mm", "0.02 mm"."""
    if unit == "m" and abs(value) >= 0.0999 * units.least_dimension:
        return _trimmed(f"{_digits(value * units.length.per_si, 2)} {units.length.label}")
    return _trimmed(quantity(value, unit, units=units))


def _trimmed(text: str) -> str:
    """A number with what follows it, without zeros behind its point."""
    return re.sub(r"^(\D?\d+)(?:[.,]0+|([.,]\d*?)0+)(?!\d)", r"\1\2", text)


def times(ratio: float, digits: int = 2) -> str:
    """A ratio with two digits: "37", "1.2", "410"."""
    return _digits(ratio, digits)


def _digits(value: float, digits: int) -> str:
    """`value` with so many significant digits, without an exponent where it is of usual size."""
    if value == 0.0:
        return "0"
    value = float(f"{value:.{digits - 1}e}")  # what is rounded up to 10 has a digit less behind
    places = digits - 1 - math.floor(math.log10(abs(value)))
    if places > 8:
        return marked(f"{value:.{digits - 1}e}")
    return marked(f"{value:.{max(places, 0)}f}")


def listed(parts: Sequence[str], most: int = MOST_NAMES) -> str:
    """As "a, b and c"; a longer list is cut: "a, b and 7 more"."""
    if len(parts) > most:
        parts = [*parts[: most - 1], say("{count} more", count=len(parts) - most + 1)]
    if len(parts) < 2:
        return "".join(parts)
    return say("{names} and {last}", names=", ".join(parts[:-1]), last=parts[-1])


def sentence(text: str) -> str:
    """`text` with a capital in front."""
    return text[:1].upper() + text[1:]


def by_phrase(phrases: Iterable[str]) -> str:
    """Several instruments' phrases as one: "by heights and distances together"."""
    distinct = list(dict.fromkeys(phrase for phrase in phrases if phrase))
    if len(distinct) < 2:
        return distinct[0] if distinct else say("by these measurements")
    bare = [phrase.removeprefix("by ").removesuffix(" alone") for phrase in distinct]
    return f"by {listed(bare)} together"


# --- names ---------------------------------------------------------------------------------------


def collapsed(labels: Sequence[str], every: Sequence[str]) -> list[str]:
    """`labels` with those that differ only in a last letter or number put together.

    `every`: the labels of all unknowns, from which it is seen whether a family is complete. All
    members, or more than three: "rod length"; fewer: "rod length a and b". Numbered parts are put
    into the plural, and their axes together: "the strut lengths", "the strut base joints in x".
    """
    for fewest in (4, 2):  # a long list is said more roughly
        names = _collapsed(labels, every, fewest)
        if len(names) <= MOST_DETAILED:
            break
    return names


def _collapsed(labels: Sequence[str], every: Sequence[str], fewest: int) -> list[str]:
    """`fewest`: members of an incomplete family that are not named one by one."""
    names: dict[str, None] = {}
    axes: dict[str, list[str]] = {}
    for head, members, of_all in _families(labels, every):
        if head is None:
            names[members[0]] = None
        elif len(members) < min(of_all, fewest):
            names[f"{head} {listed(_suffixes(members))}"] = None
        else:
            plural, axis = _plural(head, of_parts=_are_parts(members))
            names[plural] = None
            if axis:
                axes.setdefault(plural, []).append(axis)
    # What was put together may differ in its last number again: joint 1, joint 2.
    numbers: dict[str, list[str]] = {}
    shown: dict[str, None] = {}
    for name in names:
        part = _NUMBERED.match(name)
        if part is None or name in labels or len(names) <= 1:
            several = axes.get(name, [])
            shown[f"{name} in {listed(sorted(several))}" if 0 < len(several) < 3 else name] = None
        else:
            numbers.setdefault(part[1], []).append(part[2])
            shown[part[1]] = None
    return [
        f"{name}{'s' * (len(numbers[name]) > 1)} {listed(sorted(numbers[name]))}"
        if name in numbers
        else name
        for name in shown
    ]


def family(label: str, every: Sequence[str]) -> tuple[str, list[str]]:
    """The head that `label` shares with others of `every`, and all who share it."""
    head = _head(label)
    if head is None:
        return label, [label]
    return head, [other for other in every if _head(other) == head]


@cache
def _head(label: str) -> str | None:
    match = _MEMBER.match(label)
    return None if match is None else match[1]


def _families(
    labels: Sequence[str], every: Sequence[str]
) -> list[tuple[str | None, list[str], int]]:
    """(head, members among `labels`, how many there are in all), in the order of `labels`."""
    families: dict[str, tuple[str | None, list[str], int]] = {}
    for label in labels:
        head, all_members = family(label, every)
        if len(all_members) < 2:
            families[label] = (None, [label], 1)
            continue
        entry = families.setdefault(f"{head}\0", (head, [], len(all_members)))
        entry[1].append(label)
    return [
        (None, members, count) if len(members) == 1 else (head, members, count)
        for head, members, count in families.values()
    ]


def _suffixes(members: Sequence[str]) -> list[str]:
    """Sorted, numbers by their size."""
    suffixes = [_MEMBER.sub(r"\2", label) for label in members]
    return sorted(suffixes, key=lambda word: (len(word) if word.isdigit() else 0, word))


def _are_parts(members: Sequence[str]) -> bool:
    """Whether their last words name parts, "strut 1", "drive a", and not axes, "origin, x"."""
    return not any("," in label for label in members)


def _plural(head: str, *, of_parts: bool) -> tuple[str, str]:
    """Plural and axis: ("the strut base joints", "x") of "base joint x of strut" 1, 2, ..."""
    match = _OF_PART.match(head)
    if not of_parts or match is None:
        return head, ""
    what, axis = match[1], ""
    if re.fullmatch(r".+ [a-z]", what):
        what, axis = what[:-2], what[-1]
    return f"the {match[2]} {what}{'' if what.endswith('s') else 's'}", axis


def some(label: str, every: Sequence[str], which: str) -> str:
    """`which` ("one", "every") of a label's family: "one rod length", "the length of one strut".

    A label without relatives stays as it is.
    """
    head, relatives = family(label, every)
    if len(relatives) < 2:
        return label
    match = _OF_PART.match(head)
    return f"{which} {head}" if match is None else f"the {match[1]} of {which} {match[2]}"


# --- directions ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Group:
    """Unknowns that cannot be told apart: indices, largest part first, and whether one alone."""

    members: tuple[int, ...]
    n_direction: int


def sparse(directions: ArrayLike) -> Floats:
    """Another basis of the same directions (k, n), each with as few parts as elimination gives.

    Reduced row echelon form with complete pivoting: what is a direct sum of smaller spaces comes
    out as these. The largest part of each is 1. `directions` must be linearly independent and in
    comparable units.
    """
    rows = np.array(directions, np.float64, ndmin=2)
    pivots: list[tuple[int, int]] = []
    free = np.ones(rows.shape, np.bool_)
    for _ in range(rows.shape[0]):
        at = int(np.argmax(np.where(free, np.abs(rows), -1.0)))
        row, column = divmod(at, rows.shape[1])
        if rows[row, column] == 0.0:
            break
        rows[row] /= rows[row, column]
        factor = rows[:, column].copy()
        factor[row] = 0.0
        rows -= np.outer(factor, rows[row])
        free[row], free[:, column] = False, False
        pivots.append((row, column))
    scale = np.abs(rows).max(axis=1, initial=0.0, keepdims=True)
    return rows / np.where(scale > 0.0, scale, 1.0)


def members(direction: ArrayLike) -> tuple[int, ...]:
    """Indices of the unknowns with a part in a direction (n,), the largest first."""
    sizes = np.abs(np.asarray(direction, np.float64))
    named = np.flatnonzero(sizes >= NAMED * sizes.max(initial=0.0))
    return tuple(sorted(map(int, named), key=lambda i: (-round(float(sizes[i]), 6), i)))


def grouped(directions: ArrayLike, labels: Sequence[str]) -> list[Group]:
    """Directions (k, n) put together where the unknowns of one, in words, hold those of another.

    In the order of the directions.
    """
    groups: list[tuple[set[str], dict[int, None], int]] = []
    for row in np.array(directions, np.float64, ndmin=2):
        part = members(row)
        heads = {_family_name(labels[i], labels) for i in part}
        for at, (names, indices, count) in enumerate(groups):
            if heads <= names or names <= heads:
                merged = (
                    indices | dict.fromkeys(part)
                    if heads <= names
                    else (dict.fromkeys(part) | indices)
                )
                groups[at] = (names | heads, merged, count + 1)
                break
        else:
            groups.append((heads, dict.fromkeys(part), 1))
    return [Group(tuple(indices), count) for _, indices, count in groups]


def clustered(directions: ArrayLike, sizes: ArrayLike) -> Floats:
    """Directions (k, n), made sparse among those of like singular values `sizes` (k,).

    The least seen come first; a singular value `ALIKE` times as large begins a new cluster, so that
    what is seen far worse than the rest is not mixed with it.
    """
    rows, of = np.array(directions, np.float64, ndmin=2), np.asarray(sizes, np.float64)
    order = np.argsort(of, kind="stable")
    blocks: list[list[int]] = []
    for at in order:
        if blocks and of[at] <= ALIKE * of[blocks[-1][0]]:
            blocks[-1].append(int(at))
        else:
            blocks.append([int(at)])
    if not blocks:
        return rows
    return np.vstack([sparse(rows[block]) for block in blocks])


def _family_name(label: str, every: Sequence[str]) -> str:
    head, all_members = family(label, every)
    return head if len(all_members) > 1 else label


def undetermined(
    directions: ArrayLike,
    labels: Sequence[str],
    by: str,
    *,
    within_tolerances: bool = False,
) -> list[str]:
    """What the directions (k, n), in comparable units, leave open: clauses without a full stop.

    They should be sparse (`sparse`, `clustered`). `by`: "by heights alone". `within_tolerances`:
    the directions are not wholly unseen, but the data say less of them than the tolerances do.
    """
    if np.size(directions) == 0:
        return []
    by_ending: dict[str, list[str]] = {}
    for group in grouped(directions, labels):
        own = [labels[i] for i in group.members]
        names = collapsed(own, labels)
        if group.n_direction >= len(own):
            if not within_tolerances:
                end = say("{names} cannot be found {by}", names="{names}", by=by)
            elif len(own) == 1:
                end = say(
                    "{names} cannot be found {by} better than its tolerance says",
                    names="{names}",
                    by=by,
                )
            else:
                end = say(
                    "{names} cannot be found {by} better than their tolerances say",
                    names="{names}",
                    by=by,
                )
        else:
            if names == [_head(own[0])]:  # one name for several, which are told apart here
                names = [f"{names[0]} {listed(_suffixes(own))}"]
            if within_tolerances:
                end = say(
                    "{names} cannot be told apart {by} within their tolerances",
                    names="{names}",
                    by=by,
                )
            else:
                end = say("{names} cannot be told apart {by}", names="{names}", by=by)
        by_ending.setdefault(end, []).append(listed(names))
    clauses = []
    for end, groups in by_ending.items():
        shown = list(dict.fromkeys(groups))
        rest = len(shown) - MOST_SENTENCES
        if rest > 0:
            more = say_counted("one more such combination", "{count} more such combinations", rest)
            shown = [*shown[:MOST_SENTENCES], more]
        others = [say("nor can {names}", names=names) for names in shown[1:]]
        clauses.append(", ".join([end.replace("{names}", shown[0]), *others]))
    return clauses
