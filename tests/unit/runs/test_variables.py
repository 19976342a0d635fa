"""Spread: the variables of all sources, their names and identities, and what they move."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from machine_texts import PLANAR, edited, load_text
from made_source import MadeSource, with_sources
from truepose.machine import Machine
from truepose.machine.loader import load
from truepose.runs.poses import PoseRun, required_sources
from truepose.runs.variables import Variables, stream_of, variables_at
from truepose.sources import (
    OWN_GROUP,
    REGISTRY,
    TRIANGULAR,
    UNIFORM,
    Deviation,
    PoseBlock,
)
from truepose.uncertainty_analysis.random_points import Drawing
from truepose.uncertainty_analysis.sampler import Random

MACHINE = tp.load(Path(__file__).parents[3] / "machines" / "planar_two_slider.toml")


def block_of(machine: Machine) -> PoseBlock:
    (block,) = PoseRun(machine, machine.poses(), machine.condition)
    return block


def made(*given: Deviation, names: tuple[str, ...] = ("first", "second")) -> Variables:
    sources = [MadeSource(name, each) for name, each in zip(names, given, strict=False)]
    machine = with_sources(MACHINE, *sources)
    return variables_at(machine, block_of(machine), sources)


def with_all_sources(tmp_path: Path) -> Machine:
    """Tolerance in groups and correlated, drives with everything that may swing."""
    of_drive = (
        'working_mode = "+"\nbacklash = { play = 0.02 }\n'
        'actuator = { periodic = { amplitude = "3 um", period = 5 } }\n'
        'sensor = { resolution = "1 um" }\n'
    )
    tolerance = (
        "[tolerance]\n"
        '"drive.d1.offset" = 0.01\n'
        '"strut.*.base.x" = { band = 0.1, group = "one set-up" }\n'
        '"tool.?" = 0.2\n'
        '[[correlation]]\nbetween = ["tool.x", "tool.y", "one set-up"]\ncoefficient = 0.4\n'
    )
    text = PLANAR.replace('working_mode = "+"\n', of_drive)
    return load_text(tmp_path, edited(text, ("[workspace]", tolerance + "[workspace]")))


def test_variables_are_those_that_have_a_band(tmp_path: Path) -> None:
    found = made(
        Deviation.of([0, 1, 2], shift=[1e-4, 0.0, 0.0], half=[0.0, 1e-4, 2e-4]),
        Deviation.of([3, 1], half=[0.0, 3e-4], distribution=TRIANGULAR),
    )
    one, two = MACHINE.parameters[1], MACHINE.parameters[2]
    assert found.names == (f"first: {one}", two, f"second: {one}")
    assert found.sources == ("first", "first", "second")
    assert found.columns.tolist() == [1, 2, 1]
    assert found.variable_of.tolist() == [0, 1, 2]
    assert found.numbers.tolist() == [1, 2, 1]
    assert found.distributions == (UNIFORM, UNIFORM, TRIANGULAR)
    assert found.correlation is None
    parameters, shift = found.shift
    assert parameters.tolist() == [0, 1, 2, 3]
    assert shift.tolist() == [[1e-4, 0.0, 0.0, 0.0]]


def test_names_are_told_apart() -> None:
    both = Deviation.of([1, 1, 2, 3], half=1e-4, groups=[OWN_GROUP, OWN_GROUP, 5, 5])
    found = made(both, both)
    one, two = MACHINE.parameters[1], MACHINE.parameters[2]
    assert found.names == (
        f"first: {two} and others",
        f"first: {one}",
        f"first: {one} (2)",
        f"second: {two} and others",
        f"second: {one}",
        f"second: {one} (2)",
    )
    named = Deviation.of([1, 2], half=1e-4, groups=3, group_names={3: "batch"})
    assert made(named).names == ("batch",)
    assert made(named, named).names == ("first: batch", "second: batch")
    # A group of which one member alone has a band is that parameter.
    alone = Deviation.of([1, 2], half=[0.0, 1e-4], groups=3, group_names={3: "batch"})
    assert made(alone).names == (two,)


def test_the_machine_s_own_sources(tmp_path: Path) -> None:
    machine = with_all_sources(tmp_path)
    sources = required_sources(machine, machine.condition)
    found = variables_at(machine, block_of(machine), sources)
    assert len(set(found.names)) == len(found.names)
    assert "one set-up" in found.names
    assert "tolerance: drive.d1.offset" in found.names
    assert found.streams.tolist() == list(map(stream_of, found.sources))
    assert found.correlation is not None
    linked = [found.names.index(name) for name in ("one set-up", "tool.x", "tool.y")]
    off = found.correlation - np.eye(len(found.names))
    assert np.flatnonzero(off.any(axis=0)).tolist() == sorted(linked)
    assert (off[np.ix_(linked, linked)] == 0.4 * (1.0 - np.eye(3))).all()


def test_identities_do_not_hang_on_what_else_acts(tmp_path: Path) -> None:
    machine = with_all_sources(tmp_path)
    block = block_of(machine)
    sources = required_sources(machine, machine.condition)
    whole = variables_at(machine, block, sources)
    identity = dict(
        zip(
            zip(whole.sources, whole.columns[_firsts(whole)].tolist(), strict=True),
            zip(whole.streams.tolist(), whole.numbers.tolist(), strict=True),
            strict=True,
        )
    )
    assert len(set(identity.values())) == len(whole.names)
    for source in sources:
        alone = variables_at(machine, block, [source])
        keys = zip(alone.sources, alone.columns[_firsts(alone)].tolist(), strict=True)
        values = zip(alone.streams.tolist(), alone.numbers.tolist(), strict=True)
        for key, value in zip(keys, values, strict=True):
            assert identity[key] == value


def _firsts(found: Variables) -> list[int]:
    """The first column of each variable."""
    return [found.variable_of.tolist().index(number) for number in range(len(found.names))]


def test_a_pose_of_it_moves_the_parameters_as_the_deviations_say(tmp_path: Path) -> None:
    machine = with_all_sources(tmp_path)
    block = block_of(machine)
    sources = required_sources(machine, machine.condition)
    found = variables_at(machine, block, sources)
    assert len(found.half_width) == len(found.shift[1]) == block.indices.size
    t = np.random.default_rng(1).uniform(-1.0, 1.0, (4, len(found.names)))
    at = dict(zip(zip(found.sources, found.numbers.tolist(), strict=True), t.T, strict=True))
    for pose in (0, 7):
        expected = np.zeros((4, len(machine.parameters)))
        for source in sources:
            deviation = source.deviation(machine, machine.condition, block)
            shift, swing = (
                table[pose if len(table) > 1 else 0]
                for table in (deviation.shift, deviation.signed_half)
            )
            for column, parameter in enumerate(deviation.parameters):
                key = (source.name, int(deviation.variables[column]))
                moved = swing[column] * at.get(key, np.zeros(4))
                expected[:, parameter] += shift[column] + moved
        parameters, values = found.at(pose).parameters_moved(t)
        assert len(set(parameters.tolist())) == parameters.size
        whole = np.zeros_like(expected)
        whole[:, parameters] = values
        assert np.allclose(whole, expected, rtol=1e-12, atol=1e-18)


def test_all_poses_at_once_have_no_one_deviation(tmp_path: Path) -> None:
    machine = with_all_sources(tmp_path)
    found = variables_at(machine, block_of(machine), required_sources(machine, machine.condition))
    with pytest.raises(ValueError, match="several poses"):
        found.parameters_moved(np.zeros((1, len(found.names))))


def test_nothing_that_varies_is_no_variable() -> None:
    found = made(Deviation.of([0], shift=1e-4))
    assert found.names == ()
    assert found.half_width.shape == (1, 0)
    parameters, values = found.parameters_moved(np.zeros((3, 0)))
    assert parameters.tolist() == [0]
    assert values.tolist() == [[1e-4]] * 3
    empty: Any = variables_at(MACHINE, block_of(MACHINE), [])
    assert empty.names == ()


def test_each_registered_source_has_a_stream_of_its_own() -> None:
    # 0 is that of a plain function's arguments.
    assert len({0, *(stream_of(kind.name) for kind in REGISTRY)}) == 1 + len(REGISTRY)
    assert stream_of("tolerance") == 0x41E1E73D


def test_a_source_in_the_middle_of_the_registry_leaves_all_other_samples(tmp_path: Path) -> None:
    class Added(MadeSource):
        """Built for every machine."""

        name = "added"

        @classmethod
        def build(cls, parts: object) -> MadeSource:
            return MadeSource("added", Deviation.of([2, 3], half=1e-4))

    with_all_sources(tmp_path)
    registry = (*REGISTRY[:3], Added, *REGISTRY[3:])
    models = []
    for sources in (REGISTRY, registry):
        machine = load(tmp_path / "machine.toml", registry=sources)
        models.append(
            variables_at(machine, block_of(machine), required_sources(machine, machine.condition))
        )
    before, after = models
    assert "added" in after.sources
    assert after.sources[-1] != "added"
    samples = [Random(model, seed=5).rows(0, 100) for model in models]
    others = np.array([source != "added" for source in after.sources])
    assert np.array_equal(samples[0], samples[1][:, others])
    points = [
        Drawing(
            model.distributions,
            model.correlation,
            model.streams,
            model.numbers,
            model.names,
            5,
            model.directions,
        )
        .points(0)
        .next(100)
        for model in models
    ]
    assert np.array_equal(points[0], points[1][:, others])
    assert before.streams.tolist() == after.streams[others].tolist()
