"""Spoilt files are read or refused: no traceback, no panic, soon and in little memory."""

from __future__ import annotations

import pytest

from mutations.__main__ import failures, main, mutation
from mutations.inputs import KINDS
from sweeps import long_member, sweep

pytestmark = pytest.mark.timeout(1800)
"""Each file has a limit of its own, of the processor's time."""

QUICK = 300
"""Of each kind; 2000 in the whole suite, of which these are the first."""


@pytest.mark.parametrize("count", [QUICK, long_member(2000)])
@pytest.mark.parametrize("kind", list(KINDS))
def test_in_this_process(kind: str, count: int) -> None:
    answers = [answer for _, answer, _ in failures(kind, count, seed=1)]
    assert [answer for answer in answers if answer not in ("read", "refused")] == []
    assert len(answers) == count
    # Neither is all of it refused at the first token, nor does nothing come of the mutations.
    assert 0 < answers.count("read") <= KINDS[kind].most_read * count


@sweep
@pytest.mark.parametrize("count", [6, long_member(40)])
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "lines"])
def test_through_the_command(kind: str, count: int) -> None:
    answers = [answer for _, answer, _ in failures(kind, count, seed=2, in_command=True)]
    assert [answer for answer in answers if answer not in ("read", "refused")] == []


def test_a_mutation_is_its_numbers_alone() -> None:
    kind = KINDS["poses"]
    texts = [mutation(kind, "poses", 1, number) for number in range(50)]
    assert texts == [mutation(kind, "poses", 1, number) for number in range(50)]
    assert len(set(texts)) > 45
    assert texts != [mutation(kind, "poses", 2, number) for number in range(50)]


def test_a_failure_is_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError("made for this test")

    monkeypatch.setattr("mutations.inputs.read_measurements", fail)
    assert main(["--count", "3", "--kind", "measurements"]) == 1
    assert capsys.readouterr().out.count("ZeroDivisionError: made for this test") == 3
    assert main(["--count", "3", "--kind", "poses"]) == 0
