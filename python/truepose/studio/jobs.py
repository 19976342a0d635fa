"""A question with its text and settings as one job, and the answers of it one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from truepose.errors import TrueposeError
from truepose.language import ENGLISH
from truepose.machine.loader import load_text
from truepose.sources import REGISTRY
from truepose.studio.answers import ANSWERS, DroppedFile, Question, Value
from truepose.studio.settings import Settings
from truepose.studio.tabs import TABS

Problems = list[dict[str, Any]]
KINDS = {kind.name: kind for kind in ANSWERS}


@dataclass(frozen=True)
class AskedTab:
    """A tab that windows show: which, and with what options."""

    name: str
    options: tuple[tuple[str, Any], ...] = ()


Asked = str | AskedTab
"""What is to be answered: an answer by its name, or a tab."""


@dataclass(frozen=True)
class Job:
    """What is to be answered, in this order, of a text as of a file at a path, with settings.

    `language`: the code of that in which it is said.
    """

    number: int
    path: Path
    text: str
    settings: Settings
    asked: tuple[Asked, ...]
    files: Mapping[int, DroppedFile] = field(default_factory=dict)
    language: str = ENGLISH


@dataclass(frozen=True)
class Given:
    """An answer of a job: a value, of which more may come, or problems; or that no more comes."""

    number: int
    asked: Asked
    value: Value | None = None
    problems: Problems | None = None

    @property
    def last(self) -> bool:
        """Whether no more comes of what was asked."""
        return self.value is None


class _SupersededError(Exception):
    """A newer question is there."""


def answer(job: Job, superseded: Callable[[], bool]) -> Iterator[Given]:
    """The answers of a job, each followed by one that says that no more comes.

    Ends early where `superseded` says so: before every answer, and between blocks of poses.
    """

    def progress(done: int, of: int) -> None:
        if superseded():
            raise _SupersededError

    try:
        machine = load_text(job.path, job.text, registry=REGISTRY)
    except TrueposeError as failure:  # a data file of it was changed since
        for asked in job.asked:
            yield Given(job.number, asked, problems=problems_of(failure))
        return
    for asked in job.asked:
        options = dict(asked.options) if isinstance(asked, AskedTab) else {}
        question = Question(machine, job.settings, progress, options, job.files, job.path.parent)
        give = TABS[asked.name].give if isinstance(asked, AskedTab) else KINDS[asked].give
        try:
            progress(0, 0)
            for value in give(question):
                yield Given(job.number, asked, value)
            yield Given(job.number, asked)
        except _SupersededError:
            return
        except TrueposeError as failure:
            yield Given(job.number, asked, problems=problems_of(failure))


def problems_of(failure: TrueposeError) -> Problems:
    """As messages have them."""
    return [problem.to_dict() for problem in failure.problems]


__all__ = ["KINDS", "Asked", "AskedTab", "Given", "Job", "answer", "problems_of"]
