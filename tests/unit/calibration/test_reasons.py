"""One decision: suspicions count in it, and a reason is data until somebody reads its sentence."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from height_only_delta import HEIGHTS, P02, POSITIONS, codes, verdict
from truepose.calibration.acceptance.reasons import SENTENCES
from truepose.calibration.data_checks import Suspicion
from truepose.files.shown_units import INCHES, MICROINCHES, ShownUnits


def test_measurements_that_look_wrong_are_refused_first() -> None:
    wrong = Suspicion("swapped-columns", "camera: it looks as if x and y were exchanged")
    harmless = Suspicion("rounded", "camera: the readings look rounded", refuses=False)
    looks_wrong = f"No: the measurements look wrong. {wrong.sentence}."
    gate = verdict(POSITIONS, suspicions=[harmless, wrong])
    assert not gate.accepted
    assert gate.words == gate.answer == looks_wrong
    both = verdict(HEIGHTS, suspicions=[wrong])
    alone = verdict(HEIGHTS)
    assert codes(both) == {"data-look-wrong", *codes(alone)}
    as_they_are = alone.answer.removeprefix("No: ")
    assert both.words == both.answer == f"{looks_wrong} As they are: {as_they_are}"
    assert verdict(POSITIONS, suspicions=[harmless]).accepted


def test_a_reason_is_a_code_with_values_in_si() -> None:
    (loose,) = [each for each in verdict(HEIGHTS).reasons if each.code == "less-than-tolerance"]
    assert loose.values["label"] == "rod length a"
    expected = P02["outputs"]["height_only"]["standard_uncertainty"]
    largest = max(value for name, value in expected.items() if "rod" in name) * 1e-3
    assert loose.values["uncertainty"] == pytest.approx(largest, rel=1e-3)
    assert loose.values["half"] == 0.5e-3
    # The sentence is made of the values when it is asked for, in the units that are shown.
    inches = replace(loose, shown=ShownUnits(INCHES, small_length=MICROINCHES))
    assert "only to 0.15 in, its tolerance is 0.02 in" in inches.sentence
    assert "only to 3.7 mm, its tolerance is 0.5 mm" in loose.sentence


def test_a_machine_that_reaches_no_pose_is_refused() -> None:
    gate = verdict(POSITIONS, tool=np.zeros((0, 3, 9)), positions=np.zeros((0, 3)))
    assert codes(gate) == {"out-of-reach"}
    assert gate.answer == (
        "No: the calibrated machine reaches none of the poses of the workspace: it cannot be "
        "assembled there."
    )


def test_the_page_has_every_code() -> None:
    page = (Path(__file__).parents[3] / "docs" / "calibration_gate.md").read_text(encoding="utf-8")
    section = page.split("## Reasons against it")[1].split("## What to measure")[0]
    named = set(re.findall(r"`([a-z]+(?:-[a-z]+)+|gauge)`", section))
    assert set(SENTENCES) <= named
