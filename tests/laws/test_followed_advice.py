"""Who follows the advice of a refused calibration to the letter ends with a yes, or a better no.

The advice is read by `calibration_study.advice`; what it asks for is measured on the machine as it
was built. `python -m calibration_study follow` does so with more sets.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from calibration_study.advice import GOOD_ENDS, follow, parameters_called
from calibration_study.blunders import KINDS
from calibration_study.judge import answer_of
from calibration_study.study import CHANCE, drawn_set, share
from sweeps import sweep

EACH = 6


@pytest.mark.parametrize(
    ("kind", "seeds"),
    [
        ("mirror", (1, 2)),
        *(pytest.param(name, range(EACH), marks=sweep) for name in KINDS),
    ],
    ids=str,
)
def test_who_follows_the_advice_ends_well(kind: str, seeds: Sequence[int], tmp_path: Path) -> None:
    """With a yes, or with a no that is better founded (`advice.GOOD_ENDS`)."""
    found = [follow(drawn_set(kind, seed, tmp_path)) for seed in seeds]
    refused = [each for each in found if each is not None]
    if not refused:
        return
    least = 0.9 - CHANCE * np.sqrt(0.9 * 0.1 / len(refused))
    told = [(each.end, each.steps) for each in refused if each.end not in GOOD_ENDS]
    assert share(each.end in GOOD_ENDS for each in refused) >= least, told


def test_parts_are_found_by_the_words_for_them(tmp_path: Path) -> None:
    """The reader of advice understands what the gate calls a parameter, and a family of them."""
    drawn = drawn_set("none", 2, tmp_path)
    answer = answer_of(drawn.twin, drawn.write(), drawn.judged)
    assert not answer.accepted
    assert parameters_called("base joint x of strut a2", answer) == ["strut.a2.base.x"]
    every = parameters_called("the length of every strut", answer)
    struts = {f"strut.{strut['name']}.length" for strut in drawn.twin.nominal.struts}
    assert set(every) == struts or set(parameters_called("every rod length", answer)) == struts
    assert parameters_called("the length of the moon", answer) == []
