"""The process that answers: a newer question ends what runs, one that was ended is replaced."""

from __future__ import annotations

import os
import queue
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from command_line import MACHINES, PLANAR
from truepose.studio.evaluation import Evaluator, context
from truepose.studio.jobs import Given, Job
from truepose.studio.rehearsal import rehearse
from truepose.studio.settings import Settings
from truepose.studio.shared_state import EVERY

LIMIT = 120.0
"""s; an evaluation that hangs does so for good."""

SLOW = (MACHINES / "hexapod.toml").read_text("utf-8").replace(
    "x = [-4, 4, 5], y = [-4, 4, 5], z = [18, 22, 3]",
    "x = [-4, 4, 40], y = [-4, 4, 40], z = [18, 22, 40]",
)  # fmt: skip
"""Half a million poses: minutes for all answers."""


class Heard(queue.SimpleQueue[Given]):
    """What was answered."""

    def until(self, number: int, name: str) -> list[Given]:
        """All that is told until an answer of a job is through."""
        told = []
        while True:
            told.append(self.get(timeout=LIMIT))
            if (told[-1].number, told[-1].asked, told[-1].last) == (number, name, True):
                return told


@pytest.fixture
def heard() -> Heard:
    return Heard()


@pytest.fixture
def evaluator(heard: Heard) -> Iterator[Evaluator]:
    running = Evaluator(heard.put)
    yield running
    running.close()


def job(number: int, text: str = PLANAR.read_text("utf-8"), path: Path = PLANAR) -> Job:
    return Job(number, path, text, Settings(), EVERY)


def process(evaluator: Evaluator) -> int:
    until = time.monotonic() + LIMIT
    while evaluator.process is None:
        assert time.monotonic() < until
        time.sleep(0.01)
    return evaluator.process


def test_everything_is_answered_in_order(evaluator: Evaluator, heard: Heard) -> None:
    evaluator.ask(job(1))
    told = heard.until(1, "shares")
    assert [given.asked for given in told if given.last] == list(EVERY)
    assert all(given.problems is None for given in told)
    one = process(evaluator)
    evaluator.ask(job(2))
    heard.until(2, "shares")
    assert process(evaluator) == one, "a process answers more than one job"


def test_the_last_of_many_questions_is_answered(evaluator: Evaluator, heard: Heard) -> None:
    evaluator.ask(job(0, SLOW, MACHINES / "hexapod.toml"))
    process(evaluator)
    for number in range(1, 20):
        evaluator.ask(job(number))
    told = heard.until(19, "shares")
    through = {given.number for given in told if given.asked == "shares" and given.last}
    assert through == {19}
    assert 0 not in {given.number for given in told if given.asked == "verdict"}


def test_a_process_that_is_ended_is_told_and_replaced(evaluator: Evaluator, heard: Heard) -> None:
    evaluator.ask(job(1))
    heard.until(1, "shares")
    evaluator.ask(job(2, SLOW, MACHINES / "hexapod.toml"))
    first = process(evaluator)
    time.sleep(0.2)
    os.kill(first, signal.SIGKILL)
    told = heard.until(2, "shares")
    assert told[-1].problems is not None
    assert told[-1].problems[0]["code"] == "too-large"
    evaluator.ask(job(3))
    assert heard.until(3, "shares")[-1].problems is None
    assert process(evaluator) != first


def test_a_process_that_does_not_start_is_told(
    heard: Heard, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the system gives none: the next question is asked anew."""

    class NoProcess:
        def __init__(self, **_: Any) -> None:
            pass

        def start(self) -> None:
            raise OSError("no more processes")

    running = Evaluator(heard.put)
    heard_before = process(running)
    with monkeypatch.context() as patch:
        patch.setattr(type(context()), "Process", NoProcess)
        os.kill(heard_before, signal.SIGKILL)
        until = time.monotonic() + LIMIT
        while Path(f"/proc/{heard_before}/stat").exists() and time.monotonic() < until:
            if Path(f"/proc/{heard_before}/stat").read_text().split()[2] == "Z":
                break
            time.sleep(0.01)
        running.ask(job(1))
        problems = heard.until(1, "shares")[-1].problems
        assert problems is not None
    running.ask(job(2))
    assert heard.until(2, "shares")[-1].problems is None
    running.close()


def test_rehearsal_answers_everything() -> None:
    assert rehearse() == len(EVERY)


def test_closing_ends_what_runs(heard: Heard) -> None:
    running = Evaluator(heard.put)
    running.ask(job(1, SLOW, MACHINES / "hexapod.toml"))
    number = process(running)
    running.close()
    with pytest.raises(ProcessLookupError):
        os.kill(number, 0)
