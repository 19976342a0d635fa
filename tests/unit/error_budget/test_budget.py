"""The budget as a whole: what it is given, what it keeps, and how much memory it takes."""

from __future__ import annotations

import json
import tracemalloc

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from made_source import MadeSource, with_sources
from truepose.sources import Deviation, normal


@pytest.fixture(scope="module")
def hexapod() -> tp.Machine:
    return tp.load(MACHINES / "hexapod.toml")


def test_what_was_changed_is_said(hexapod: tp.Machine) -> None:
    name = hexapod.parameters[0]
    changed = hexapod.replace({name: float(hexapod.nominal[0]) + 1e-3})
    hot = changed.condition.replace(temperature={"default": 293.15, "strut.2": 300.0})
    found = tp.budget(changed, hexapod.poses()[:2], condition=hot)
    assert found.attrs["replaced"].startswith(f"{name}=")
    condition = json.loads(found.attrs["condition"])
    assert condition["temperature_K"] == {"default": 293.15, "strut.2": 300.0}
    assert condition["force_N"] == list(hexapod.condition.force)
    assert not np.array_equal(found.error, tp.budget(hexapod, hexapod.poses()[:2]).error)


def test_a_percent_of_about_zero_is_missing_and_flagged(hexapod: tp.Machine) -> None:
    middle = hexapod.home[np.newaxis, :] * [[0, 0, 1, 0, 0, 0]]
    aside = middle + np.array([0.01, 0, 0, 0, 0, 0])
    found = tp.budget(hexapod, np.concatenate([middle, aside]))
    assert found.percent_defined.values.tolist() == [
        [False, False, True, False, False, False],
        [True, False, True, False, False, False],
    ]
    missing = np.isnan(found.overall_percent_upper.values)
    assert np.array_equal(missing, ~found.percent_defined.values)
    # Over poses the highest of what there is.
    assert np.isnan(found.highest_percent_upper.sel(component="y")).all()
    highest = found.highest_percent_upper.sel(component="x")
    assert np.array_equal(highest, found.percent_upper.sel(component="x")[1])


def test_the_distribution_is_said(hexapod: tp.Machine) -> None:
    columns = hexapod.kernel.length_parameters[:3]
    mixed = MadeSource(
        "mixed",
        Deviation.of(
            columns, half=[1e-5, 2e-5, 0.0], distribution=(normal(2.0), normal(2.0), normal(3.0))
        ),
    )
    known = MadeSource("known", Deviation.of(columns, 1e-5))
    found = tp.budget(with_sources(hexapod, mixed, known), hexapod.poses()[:2])
    assert found.distribution.values.tolist() == ["normal, 2 sigma", "none"]
    assert not found.uncertainty.sel(source="known").values.any()


def test_results_are_written_in_place_block_by_block(hexapod: tp.Machine) -> None:
    low, high = hexapod.poses().min(axis=0), hexapod.poses().max(axis=0)
    poses = np.random.default_rng(1).uniform(low, high, (60_000, 6))
    peaks, sizes = [], []
    tp.budget(hexapod, poses[:10])
    for count in (20_000, 60_000):
        tracemalloc.start()
        found = tp.budget(hexapod, poses[:count])
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        sizes.append(found.nbytes)
    # More poses cost what their results take and next to nothing else, in a million as well.
    assert peaks[1] - peaks[0] < 1.1 * (sizes[1] - sizes[0])
    # Of these 1.5 GiB are 61 MiB the largest errors of each source and of all together.
    assert (sizes[1] - sizes[0]) / 40_000 * 1e6 < 1.55 * 2**30
