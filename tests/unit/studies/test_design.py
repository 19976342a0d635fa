"""Which variants a design has."""

from __future__ import annotations

import itertools
from collections import Counter

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES
from truepose.errors import RequestError
from truepose.studies.design import MOST_VARIANTS
from truepose.studies.plan import StudyPlan, plan_of
from truepose.studies.varied_keys import read_varied

HEXAPOD = tp.load(MACHINES / "hexapod.toml")
STIFFNESS = "strut.*.stiffness=30:120 N/um"
MATERIAL = "strut.*.material=steel,invar,carbon fibre"
WARM = "condition.temperature=20:40 degC"


def drawn(vary: list[str], design: str, count: int | None = None, seed: int = 0) -> StudyPlan:
    return plan_of(read_varied(vary, HEXAPOD), design, count, seed)


def test_a_full_factorial_is_every_combination_the_first_variable_fastest() -> None:
    plan = drawn(
        ["strut.*.mass=1:3:3 kg", MATERIAL, "condition.temperature=20,30 degC"], "factorial"
    )
    levels = (["20 degC", "30 degC"], ["steel", "invar", "carbon fibre"], ["1 kg", "2 kg", "3 kg"])
    assert plan.settings[:, ::-1].tolist() == [list(row) for row in itertools.product(*levels)]
    assert plan.of_variant(4) == (
        "strut.*.mass=2 kg", "strut.*.material=invar", "condition.temperature=20 degC",
    )  # fmt: skip


@pytest.mark.parametrize("count", [1, 7, 20])
def test_a_latin_hypercube_has_each_stratum_once(count: int) -> None:
    plan = drawn([STIFFNESS, WARM, MATERIAL], "latin-hypercube", count, 3)
    for at, (low, high) in enumerate([(30, 120), (20, 40)]):
        strata = np.floor((plan.values[:, at] - low) / (high - low) * count)
        assert sorted(strata.tolist()) == list(range(count))
    words = Counter(plan.settings[:, 2])
    assert max(words.values()) - min(words.get(w, 0) for w in MATERIAL[17:].split(",")) <= 1


def test_sobol_points_are_balanced() -> None:
    plan = drawn([STIFFNESS, WARM], "sobol", 64, 5)
    for at, (low, high) in enumerate([(30, 120), (20, 40)]):
        strata = np.floor((plan.values[:, at] - low) / (high - low) * 64)
        assert sorted(strata.tolist()) == list(range(64))
    shorter = drawn([STIFFNESS, WARM], "sobol", 40, 5)
    assert shorter.settings.tolist() == plan.settings[:40].tolist()


@pytest.mark.parametrize("design", ["latin-hypercube", "sobol"])
def test_the_seed_says_which(design: str) -> None:
    one, again, other = (drawn([STIFFNESS, MATERIAL], design, 8, seed) for seed in (1, 1, 2))
    assert one.digest == again.digest
    assert one.digest != other.digest
    # Each setting is the value, to the last bit.
    for text, value in zip(one.settings[:, 0], one.values[:, 0], strict=True):
        assert float(text.split()[0]) == value


@pytest.mark.parametrize(
    ("vary", "design", "count", "code"),
    [
        ([STIFFNESS], "factorial", None, "bad-design"),
        ([MATERIAL], "factorial", 5, "bad-design"),
        ([STIFFNESS], "sobol", None, "bad-design"),
        ([STIFFNESS], "sobol", 0, "bad-design"),
        ([STIFFNESS], "latin-hypercube", -1, "bad-design"),
        ([STIFFNESS], "latin-hypercube", MOST_VARIANTS + 1, "study-too-large"),
        ([STIFFNESS], "latin_hypercube", 5, "unknown-choice"),
        (
            ["strut.*.mass=1:2:1000 kg", "strut.*.stiffness=1:2:1000 N/um",
             "condition.temperature=20:40:1000 degC"],
            "factorial", None, "study-too-large",
        ),
        (["each:strut.*.stiffness=1:2:40000 N/um"], "factorial", None, "study-too-large"),
    ],
)  # fmt: skip
def test_what_is_no_design(vary: list[str], design: str, count: int | None, code: str) -> None:
    with pytest.raises(RequestError) as caught:
        drawn(vary, design, count)
    assert [problem.code for problem in caught.value.problems] == [code]


def test_a_thousand_million_variants_are_told_as_such() -> None:
    vary = [f"strut.{n}.mass=1:2:1000 kg" for n in (1, 2, 3)]
    with pytest.raises(RequestError, match=r"1e\+09 variants"):
        drawn(vary, "factorial")


@pytest.mark.parametrize("seed", [-1, 2**64, 1.5])
def test_what_is_no_seed(seed: int) -> None:
    with pytest.raises(RequestError, match="bad-seed"):
        drawn([STIFFNESS], "sobol", 4, seed)
