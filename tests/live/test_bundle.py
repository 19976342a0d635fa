"""The bundle of a machine against its sources: what a page evaluates is what the library says.

The bundle's laws are read here a second time, with numpy; the page's own reading, in Rust, is held
against the library in tests/web.
"""

from __future__ import annotations

import gzip
import json
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES
from sweeps import thinned
from truepose.errors import TrueposeError
from truepose.live import bundle
from truepose.live.laws import at_rest
from truepose.machine import Condition, Machine
from truepose.runs.displacement import sum_deviations
from truepose.runs.poses import PoseRun
from truepose.runs.variables import variables_at
from truepose.sources import Deviation, PoseBlock

EVERY = sorted(path.stem for path in MACHINES.glob("*.toml"))
QUICK = {"planar_two_slider", "tricept", "hexapod_all_sources"}
POSES = 300
NEVER_LIVE = {
    "screw_coupling": "follows from the pose",
    "guideway": "follows from the pose",
}


def made(name: str) -> tuple[Machine, dict[str, Any]]:
    """The machine and its bundle, as it comes out of a file."""
    machine = tp.load(MACHINES / f"{name}.toml")
    return machine, json.loads(json.dumps(bundle(machine), allow_nan=False))


def other_poses(machine: Machine, seed: int) -> np.ndarray:
    """Poses of the workspace's box that are none of those at which the laws were found."""
    poses = machine.poses()
    low, high = poses.min(axis=0), poses.max(axis=0)
    return low + (high - low) * np.random.default_rng(seed).random((POSES, len(low)))


def other_condition(machine: Machine, of: dict[str, Any], seed: int) -> Condition:
    """Every part at a temperature of its own, and a force (where something gives way)."""
    random = np.random.default_rng(seed)
    reference = of["reference_temperature"]
    parts = [part["part"] for part in of["parts"]]
    yields = bool(of["compliance"]["own"]) or of["compliance"]["limbs"]
    return machine.condition.replace(
        temperature={part: reference + random.uniform(-10.0, 30.0) for part in parts} or reference,
        force=random.uniform(-300.0, 300.0, 3) * yields,
        moment=random.uniform(-10.0, 10.0, 3) * yields,
    )


def block_at(machine: Machine, poses: np.ndarray, condition: Condition) -> PoseBlock:
    (block,) = PoseRun(machine, poses, condition)
    return block


def law(terms: list[list[Any]], lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Parameters and their values (n, k) at lengths (n, n_strut)."""
    columns = np.array([term[0] for term in terms], np.intp)
    values = np.zeros((len(lengths), len(terms)))
    for at, (_, constant, slope, strut) in enumerate(terms):
        values[:, at] = constant + (0.0 if strut is None else slope * lengths[:, strut])
    return columns, values


def known(of: dict[str, Any], source: dict[str, Any], block: PoseBlock) -> list[Any]:
    """The known deviations of one live source at a block, from the bundle alone."""
    lengths, condition = block.lengths, block.condition
    moved = [law(source["at_reference"], lengths)]
    for part, terms in source["per_kelvin"].items():
        columns, values = law(terms, lengths)
        moved.append((columns, values * condition.temperature_rise(part)))
    if source["under_wrench"]:
        moved += given_way(of["compliance"], block)
    return moved


def given_way(compliance: dict[str, Any], block: PoseBlock) -> list[Any]:
    """Compliance times load, the loads by the kernel."""
    kernel = block.machine.kernel
    columns, own = law(compliance["own"], block.lengths)
    pairs = [(one, other, np.full(len(own), value)) for one, other, value in compliance["shared"]]
    if compliance["limbs"]:
        matrix = kernel.limb_compliances_at(block.joints, block.placements)
        pairs += [(*pair, matrix[:, at]) for at, pair in enumerate(kernel.limb_pairs)]
    every = sorted({*columns.tolist(), *(c for one, other, _ in pairs for c in (one, other))})
    wrench = block.condition.wrench[np.newaxis]
    loads = kernel.loads_at(block.joints, block.placements, wrench, np.array(every, np.intp))[0]
    load = {column: loads[:, at] for at, column in enumerate(every)}
    moved = [
        (np.array([c]), own[:, [at]] * load[c][:, np.newaxis])
        for at, c in enumerate(columns.tolist())
    ]
    for one, other, value in pairs:
        moved.append((np.array([one]), (value * load[other])[:, np.newaxis]))
        if one != other:
            moved.append((np.array([other]), (value * load[one])[:, np.newaxis]))
    return moved


@pytest.mark.parametrize("name", thinned(EVERY, QUICK))
def test_known_shifts_and_errors_are_those_of_the_library(name: str) -> None:
    machine, of = made(name)
    condition = other_condition(machine, of, seed=1)
    block = block_at(machine, other_poses(machine, seed=2), condition)
    live = {source["name"]: source for source in of["sources"] if source["live"]}
    unsaid = {source.name for source in machine.sources} - {one["name"] for one in of["sources"]}
    assert not [one for one in machine.sources if one.name in unsaid and one.acts(condition)]
    result = tp.budget(machine, block.requested, condition)
    poses = result["pose"].values
    block = block.select(np.isin(block.indices, poses))
    for source in machine.sources:
        if source.name not in live or not source.acts(condition):
            continue
        if live[source.name]["under_weight"] or hasattr(source, "dead_zones"):
            continue  # What is read of them is held against the library in tests/web.
        deviation = source.deviation(machine, condition, block)
        columns, wanted = sum_deviations([(deviation.parameters, deviation.shift)])
        own_columns, values = sum_deviations(known(of, live[source.name], block))
        every = np.union1d(columns, own_columns)
        shifts = np.zeros((2, len(poses), every.size))
        shifts[0][:, np.searchsorted(every, columns)] = wanted
        shifts[1][:, np.searchsorted(every, own_columns)] = values
        assert np.abs(shifts[1] - shifts[0]).max(initial=0.0) < 1e-15 + 1e-9 * np.abs(
            shifts[0]
        ).max(initial=0.0)
        error, _ = machine.kernel.displacement(
            block.joints, block.placements, own_columns, np.ascontiguousarray(values)
        )
        np.testing.assert_allclose(
            error, result["error"].sel(source=source.name).values, rtol=0.0, atol=1e-12
        )


@pytest.mark.parametrize("name", thinned(EVERY, QUICK))
def test_variables_are_those_of_the_library(name: str) -> None:
    machine, of = made(name)
    condition = other_condition(machine, of, seed=3)
    block = at_rest(block_at(machine, other_poses(machine, seed=4), condition))
    live = {source["name"] for source in of["sources"] if source["live"]}
    sources = [s for s in machine.sources if s.name in live and s.acts(block.condition)]
    every = variables_at(machine, block, sources)
    told = of["variables"]
    assert [one["name"] for one in told] == list(every.names)
    assert [one["stream"] for one in told] == every.streams.tolist()
    assert [one["number"] for one in told] == every.numbers.tolist()
    assert [one["parameter"] for one in of["columns"]] == every.columns.tolist()
    assert [one["variable"] for one in of["columns"]] == every.variable_of.tolist()
    _, half = law([[0, *one["half"]] for one in of["columns"]], block.lengths)
    np.testing.assert_allclose(
        half, np.broadcast_to(every.half_width, half.shape), rtol=1e-9, atol=0.0
    )
    assert of["directions"] == [members.tolist() for members in every.directions]


def test_every_source_of_the_library_machines_is_live_but_these() -> None:
    for name in EVERY:
        _, of = made(name)
        not_live = {s["name"]: s["why"] for s in of["sources"] if not s["live"]}
        assert not_live == (NEVER_LIVE if name == "hexapod_all_sources" else {})


def test_what_is_not_live_is_named_with_its_size() -> None:
    machine, of = made("hexapod_all_sources")
    result = tp.budget(machine)
    for source in of["sources"]:
        if not source["live"]:
            errors = result["error"].sel(source=source["name"], component=["x", "y", "z"]).values
            largest = np.linalg.norm(errors, axis=1).max()
            assert source["largest"]["position"] == pytest.approx(largest, rel=1e-9, abs=1e-15)


class Quadratic:
    """A source whose shift follows from the pose by no law of a strut's length."""

    name: ClassVar[str] = "quadratic"
    doc: ClassVar[str] = "a shift that grows with the square of a length"

    def acts(self, condition: Condition) -> bool:
        return True

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        column = machine.kernel.length_parameters[0]
        return Deviation.of([column], 1e-4 * np.square(block.lengths[:, :1]))


class WideWhenWarm(Quadratic):
    """A band that follows from the temperature, which a slider changes."""

    name: ClassVar[str] = "wide"

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        column = machine.kernel.length_parameters[0]
        rise = float(condition.temperature_rise("strut.1"))
        return Deviation.of([column], 0.0, 1e-6 * (1.0 + abs(rise)))


@pytest.mark.parametrize(
    ("source", "why"),
    [
        (Quadratic(), "follows from the pose"),
        (WideWhenWarm(), "has bands that follow from the temperature or the wrench"),
    ],
)
def test_a_source_without_a_law_is_named_and_the_others_stay_live(source: Any, why: str) -> None:
    machine = tp.load(MACHINES / "hexapod.toml")
    of = bundle(replace(machine, sources=(*machine.sources, source)))
    names = {one["name"]: one for one in of["sources"]}
    assert names[source.name]["live"] is False
    assert names[source.name]["why"] == why
    assert all(one["live"] for name, one in names.items() if name != source.name)
    assert all(one["source"] != source.name for one in of["variables"])


def test_no_pose_to_ask_at_is_a_refusal() -> None:
    machine = tp.load(MACHINES / "hexapod.toml", settings={"workspace.grid.z": "[900, 950, 3]"})
    with pytest.raises(TrueposeError) as caught:
        bundle(machine)
    assert [problem.code for problem in caught.value.problems] == ["not-live"]


def test_nothing_in_a_bundle_is_large() -> None:
    """A page has it twice, for itself and for its worker."""
    texts = {name: json.dumps(made(name)[1], separators=(",", ":")) for name in EVERY}
    assert max(map(len, texts.values())) < 30_000
    assert max(len(gzip.compress(text.encode())) for text in texts.values()) < 5_000
