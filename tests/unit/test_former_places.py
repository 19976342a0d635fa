"""Paths that the documentation of an earlier version showed lead on, with a warning."""

from __future__ import annotations

import importlib
import sys

import pytest

FORMER = {
    "truepose.calibration.suspicions": ("truepose.calibration.data_checks", "suspicions"),
    "truepose.sources.joint_normal": ("truepose.probability.joint_normal", "normal_correlation"),
}


@pytest.mark.parametrize("path", FORMER)
def test_a_former_place_warns_and_leads_on(path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    place, name = FORMER[path]
    monkeypatch.delitem(sys.modules, path, raising=False)
    with pytest.warns(DeprecationWarning, match=place):
        former = importlib.import_module(path)
    assert getattr(former, name) is getattr(importlib.import_module(place), name)
