"""What a report of a change says: names that are gone and new, and ratios."""

from __future__ import annotations

import pytest

from benchmarks.works import WORKS
from release.change_report import MOST, SHORT, names_section, speed_section

BEFORE = "function load(path)\nfunction budget(machine)\ncode bad-name\n"


def test_nothing_changed() -> None:
    assert names_section(BEFORE, BEFORE) == "## Public names\n\nNone is gone, none is new.\n"


def test_a_changed_signature_is_gone_and_new() -> None:
    after = BEFORE.replace("budget(machine)", "budget(machine, poses)")
    text = names_section(BEFORE, after)
    gone, new = text.split("1 new:")
    assert "1 gone" in gone
    assert "* `function budget(machine)`" in gone
    assert "* `function budget(machine, poses)`" in new
    assert "load" not in text


def test_a_long_list_is_cut() -> None:
    after = "".join(f"code c{number}\n" for number in range(MOST + 7))
    text = names_section("", after)
    assert f"{MOST + 7} new" in text
    assert "* and 7 more" in text
    assert text.count("* `") == MOST


@pytest.mark.parametrize(
    ("ratio", "shown"), [("1.05 x", "1.05 x"), ("0.8 x", "**0.8 x**"), ("1.3 x", "**1.3 x**")]
)
def test_a_ratio_beyond_the_noise_is_marked(ratio: str, shown: str) -> None:
    text = speed_section([("work", "1 s", "2 s", ratio, "", "", "equal to 0.0e+00")])
    assert f"| work | 1 s | 2 s | {shown} | equal to 0.0e+00 |" in text


def test_a_work_that_one_side_does_not_have_has_no_ratio() -> None:
    row = ("work", "", "2 s", "", "", "", "not there before: AttributeError: x")
    assert "| work |  | 2 s |  | not there before: AttributeError: x |" in speed_section([row])


def test_the_short_works_are_there() -> None:
    assert set(SHORT) <= set(WORKS)
