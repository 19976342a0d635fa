"""What a record is made of: cases, each with its input files and the commands run on them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
INPUTS = Path(__file__).resolve().parent / "inputs"
MACHINES = REPOSITORY / "machines"
EXAMPLES = REPOSITORY / "examples"

Step = tuple[str, ...]
"""The arguments of `truepose`, or `python FILE ...` for a script."""
Files = dict[str, str | bytes]


@dataclass(frozen=True)
class Case:
    """Commands run one after the other in one new folder that holds `files`.

    `weight` is about how many seconds it takes; the longest are begun first.
    """

    name: str
    steps: tuple[Step, ...]
    files: Files = field(default_factory=dict)
    weight: float = 0.0


def machine_text(name: str) -> str:
    """The text of a machine of the library, or of one of the inputs."""
    for folder in (MACHINES, INPUTS):
        path = folder / f"{name}.toml"
        if path.exists():
            return path.read_text(encoding="utf-8")
    raise FileNotFoundError(name)


def changed(text: str, *edits: tuple[str, str]) -> str:
    """The text with the first of each `old` replaced; it must be there."""
    for old, new in edits:
        if old not in text:
            raise ValueError(f"{old!r} is not in the text")
        text = text.replace(old, new, 1)
    return text


def recorded_cases() -> list[Case]:
    """Every case, each under a name of its own."""
    from house import cases_bad, cases_calibration, cases_library, cases_programs, cases_requests

    sources: tuple[Callable[[], Iterator[Case]], ...] = (
        cases_library.cases,
        cases_calibration.cases,
        cases_requests.cases,
        cases_programs.cases,
        cases_bad.cases,
    )
    cases = [case for source in sources for case in source()]
    names = [case.name for case in cases]
    doubled = {name for name in names if names.count(name) > 1}
    if doubled:
        raise ValueError(f"cases of one name: {doubled}")
    return cases
