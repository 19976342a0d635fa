"""Dimensions that make the spread, those alike in one: which is first among equals says nothing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Indices
from truepose.language import say, say_counted
from truepose.reporting.display import number
from truepose.reporting.table import Table

if TYPE_CHECKING:
    from truepose.reporting.variance_shares import Blame

LEAST = 0.01
"""Share of the variance: what makes less is not worth tightening."""

SAME = 5e-4
"""Shares that differ by no more look the same where they are shown."""


@dataclass(frozen=True)
class Alike:
    """Parameters whose shares cannot be told apart: their places in the `Blame`, names, share.

    `share`: of each, from 0 to 1, the mean; `low` and `high`: ends of what it can be of any.
    """

    at: Indices
    names: tuple[str, ...]
    share: float
    low: float
    high: float

    @property
    def label(self) -> str:
        """The first's name, and how many are like it."""
        if len(self.names) == 1:
            return self.names[0]
        return say_counted(
            "{name} + {count} alike",
            "{name} + {count} alike",
            len(self.names) - 1,
            name=self.names[0],
        )

    @property
    def percent(self) -> str:
        """The share in percent."""
        return number(100.0 * self.share, 1)


def alike(who: Blame, least: float = LEAST) -> list[Alike]:
    """Those that make `least` or more each, the largest first.

    With the first of a group are all whose share is the same as its, or whose interval, 95 %,
    overlaps with that of its.
    """
    kind = "shapley" if "shapley" in who.kinds else "total"
    shares = who.kinds[kind]
    half = who.confidence.get(kind, np.zeros(len(shares)))
    groups: list[list[int]] = []
    for at in np.flatnonzero(shares >= least).tolist():
        first = groups[-1][0] if groups else at
        if groups and shares[first] - shares[at] <= max(half[first] + half[at], SAME):
            groups[-1].append(at)
        else:
            groups.append([at])
    return [
        Alike(
            np.array(group, np.intp),
            tuple(who.names[at] for at in group),
            float(shares[group].mean()),
            float((shares[group] - half[group]).min()),
            float((shares[group] + half[group]).max()),
        )
        for group in groups
    ]


def rest_text(who: Blame, least: float = LEAST) -> str:
    """What those make that are not worth tightening; empty where there are none."""
    shares = who.kinds["shapley" if "shapley" in who.kinds else "total"]
    small = shares[shares < least]
    if not small.size:
        return ""
    return say_counted(
        "{count} other makes less than {least} %.",
        "{count} others make less than {least} % each, {sum} % together.",
        int(small.size),
        least=number(100.0 * least, 0),
        sum=number(100.0 * float(small.sum()), 1),
    )


def first_text(who: Blame, part: str, pose: str) -> str:
    """What to tighten first at a pose, as a sentence: one, or several that are alike."""
    groups = alike(who)
    if not groups:
        return say(
            "No dimension makes as much as {least} % of the variance at {pose}.",
            least=number(100.0 * LEAST, 0),
            pose=pose,
        )
    first = groups[0]
    said = {"name": first.names[0], "share": first.percent, "pose": pose}
    others = len(first.names) - 1
    if others and part == "position":
        text = say_counted(
            "{name} and {count} other, which are alike, make the largest share of the position's "
            "variance, {share} % each, at {pose}.",
            "{name} and {count} others, which are alike, make the largest share of the position's "
            "variance, {share} % each, at {pose}.",
            others,
            **said,
        )
    elif others:
        text = say_counted(
            "{name} and {count} other, which are alike, make the largest share of the "
            "orientation's variance, {share} % each, at {pose}.",
            "{name} and {count} others, which are alike, make the largest share of the "
            "orientation's variance, {share} % each, at {pose}.",
            others,
            **said,
        )
    elif part == "position":
        text = say(
            "{name} makes the largest share of the position's variance, {share} %, at {pose}.",
            **said,
        )
    else:
        text = say(
            "{name} makes the largest share of the orientation's variance, {share} %, at {pose}.",
            **said,
        )
    return " ".join([text, *_of_kind(who, first)])


def _of_kind(who: Blame, first: Alike) -> list[str]:
    """What all parameters of a kind make, such as the lengths of all struts, where they are more.

    A tolerance of all struts is tightened as easily as that of one; and at a pose that lies as far
    to the other side another of them is first.
    """
    kind = _kind(first.names[0])
    like = [at for at, name in enumerate(who.names) if _kind(name) == kind]
    if len(like) <= len(first.names):
        return []
    shares = who.kinds["shapley" if "shapley" in who.kinds else "total"]
    together = number(100.0 * float(shares[like].sum()), 1)
    return [
        say(
            "All {count} of this kind, {kind}, make {share} % together.",
            count=len(like),
            kind=".".join(kind),
            share=together,
        )
    ]


def _kind(name: str) -> tuple[str, ...]:
    """The name of a parameter without which of its like it is: strut.*.length."""
    parts = name.split(".")
    return (parts[0], "*", *parts[2:]) if len(parts) > 2 else (name,)


def worth_tightening(who: Blame) -> int:
    """How many of the names, which go by their shares, have a row: the largest at least."""
    return max(sum(len(group.names) for group in alike(who)), 1)


def with_ties(table: Table, who: Blame, part: str, pose: str) -> Table:
    """The table of the shares of parameters, which says which rows are alike."""
    groups = alike(who)
    ties = "; ".join(", ".join(group.names) for group in groups if len(group.names) > 1)
    notes = [table.note]
    if ties:
        notes.append(say("Alike, so that none of them is before the others: {ties}.", ties=ties))
    notes += [text for text in (rest_text(who),) if text]
    first = len(groups[0].names) if groups else 0
    # After first and total each their confidence stands; Shapley shares are last.
    share = len(table.header) - 1 if "shapley" in who.kinds else 3
    return replace(
        table,
        note=" ".join(notes),
        says=first_text(who, part, pose),
        largest=frozenset((row, share) for row in range(min(first, len(table.rows)))),
    )


__all__ = ["Alike", "alike", "first_text", "rest_text", "with_ties", "worth_tightening"]
