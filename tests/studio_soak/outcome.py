"""What a soak found, and what it holds the studio to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from studio_soak.memory import Reading, growth

LARGEST_GROWTH = 20.0
"""MB that server and page may grow by, from a sixth of the time to its end."""
WARMING = 1.0 / 6.0
"""Of the time: ten minutes of an hour, in which memory comes to what the work takes."""


@dataclass(frozen=True)
class Outcome:
    """Figures of a soak: readings of memory; counts of what was done; messages and their size.

    `messages`, `largest`: to windows by the socket, `page_messages`, `page_largest`: to the page;
    how many, and bytes of the largest. `faults`: messages that are none of the schema or too
    large, requests that should have got nothing, an end by itself.
    `complaints`: of the page's console. `said`: what the server said on stderr. `wrong`: numbers at
    the end that are not the commands'.
    """

    minutes: float
    readings: list[Reading]
    done: Mapping[str, int]
    messages: int
    largest: int
    page_messages: int
    page_largest: int
    faults: list[str]
    complaints: list[str]
    said: str
    wrong: list[str]

    @property
    def growth(self) -> dict[str, float]:
        """MB by which each grew when it was warm."""
        return growth(self.readings, WARMING * self.minutes)

    def __str__(self) -> str:
        kinds = ", ".join(f"{kind} {count}" for kind, count in sorted(self.done.items()))
        grew = ", ".join(f"{name} {by:+.1f} MB" for name, by in self.growth.items())
        return (
            f"{self.minutes:.1f} minutes, {Counter(self.done).total()} actions: {kinds}\n"
            f"{self.messages} messages to windows, the largest {self.largest} bytes; "
            f"{self.page_messages} to the page, {self.page_largest} bytes\n"
            f"after minute {WARMING * self.minutes:.1f}: {grew}"
        )


def broken(outcome: Outcome) -> list[str]:
    """What the studio does not keep, in words; memory apart."""
    kinds = (
        ("the server says", [outcome.said] if outcome.said else []),
        ("the page complains", outcome.complaints),
        ("messages", outcome.faults),
        ("not the command's numbers", outcome.wrong),
    )
    return [f"{kind}: {one[:2000]}" for kind, found in kinds for one in found[:5]]


def grown(outcome: Outcome) -> dict[str, float]:
    """MB of what grew by more than it may; in a soak of minutes that is warming up, no fault."""
    return {name: by for name, by in outcome.growth.items() if not by < LARGEST_GROWTH}
