"""How many of all machines keep what is asked, at the worst pose: one number for all who say it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from truepose.language import say
from truepose.reporting.accuracy import BEFORE
from truepose.reporting.display import number
from truepose.reporting.study import Study


@dataclass(frozen=True)
class Within:
    """One quantity in one state: `share` of the `draws` machines drawn, from 0 to 1, keep it.

    `asked`: m or rad.
    """

    quantity: str
    state: str
    asked: float
    share: float
    draws: int

    @property
    def percent(self) -> str:
        """The share rounded down, or where all keep it what that says of it, without its sign."""
        if self.share == 1.0:
            # None of n drawn: with 95 % confidence fewer than 3 / n of all (the rule of three).
            return number(math.floor(1e4 * (1.0 - 3.0 / self.draws)) / 100.0, 2)
        percent = 100.0 * self.share
        decimals = 2 if percent >= 99.0 else 1
        return number(math.floor(percent * 10.0**decimals + 1e-9) / 10.0**decimals, decimals)

    @property
    def text(self) -> str:
        """The share in a sentence."""
        if self.share == 1.0:
            return say("more than {percent} %", percent=self.percent)
        return f"{self.percent} %"

    @property
    def short(self) -> str:
        """The share in a figure."""
        return f"> {self.percent} %" if self.share == 1.0 else f"{self.percent} %"


def shares_within(study: Study) -> list[Within]:
    """Of every quantity of which something is asked, in both states, as far as they are sampled."""
    accuracy = study.machine.accuracy
    asked = {"position": accuracy.target, "orientation": accuracy.angle_target}
    kept = []
    for answer in study.drawn:
        limit, sampled = asked[answer.quantity], answer.coverage
        if limit is None or sampled is None:
            continue
        share = sampled.share_within(limit)
        kept.append(Within(answer.quantity, answer.state, limit, share, sampled.draws))
    return kept


def within_note(study: Study) -> str:
    """The same in sentences; nothing where nothing is asked."""
    return " ".join(_sentence(study, kept) for kept in shares_within(study))


def _sentence(study: Study, kept: Within) -> str:
    asked = study.machine.accuracy.said(kept.quantity)
    if kept.state == BEFORE:
        return say(
            "Before compensation {share} of all machines keep the {asked} asked at the worst pose.",
            share=kept.text,
            asked=asked,
        )
    return say(
        "After compensation {share} of all machines keep the {asked} asked at the worst pose.",
        share=kept.text,
        asked=asked,
    )


__all__ = ["Within", "shares_within", "within_note"]
