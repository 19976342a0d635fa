"""Words that results have for programs, as people read them in their language."""

from __future__ import annotations

from truepose.language import say


def word(of: str) -> str:
    """A quantity, state or verdict of a result for people; any other word as it stands."""
    words = {
        "position": say("position"),
        "orientation": say("orientation"),
        "rotation": say("rotation"),
        "before compensation": say("before compensation"),
        "after compensation": say("after compensation"),
        "met": say("met"),
        "NOT met": say("NOT met"),
        "undecided": say("undecided"),
        "within": say("within"),
        "NOT within": say("NOT within"),
        "dominant": say("dominant"),
        "relevant": say("relevant"),
        "negligible": say("negligible"),
        "fits": say("fits"),
        "absorbed": say("absorbed"),
        "partly": say("partly"),
        "strains": say("strains"),
        "known": say("known"),
        "witness": say("witness"),
        "linear maximum": say("linear maximum"),
        "proven bound": say("proven bound"),
        "counter-clockwise": say("counter-clockwise"),
        "clockwise": say("clockwise"),
    }
    return words.get(of, of)


VERDICTS = ("dominant", "relevant", "negligible")
"""Of a source: the page's style knows them by these names."""


def verdict_of(cell: str) -> str:
    """Which of the `VERDICTS` a cell says, in whatever language; empty where none."""
    return {word(verdict): verdict for verdict in VERDICTS}.get(cell, "")


def ends() -> tuple[str, str]:
    """Where lengths and offsets stand in their tolerance bands: the paper's minimum and maximum."""
    return say("all at lower ends"), say("all at upper ends")


__all__ = ["VERDICTS", "ends", "verdict_of", "word"]
