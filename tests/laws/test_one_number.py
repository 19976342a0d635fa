"""One number: what is found of a machine, its linear maximum and its bound are of one set.

Over the machines shipped and 200 random ones. The set of a pose is what `truepose.verdict` says:
bands at their ends, normal variables at their stated sigmas, correlations narrowing nothing.
"""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import truepose as tp
from drawn_sweeps import spread
from drive_kinds import has_majorant
from instruction_sets import SETS, computing_or_skipped
from machine_file import File, loaded
from machine_under_test import MachineUnderTest
from one_number import ROUNDING, Known, asking, drawn_inside, has_ends
from random_machines import DRAWN, MORE, DrawnMachine
from truepose import _kernel
from truepose.error_budget.largest import largest
from truepose.machine import Machine
from truepose.runs.first_order import first_order
from truepose.verdict.search import farthest
from truepose.verdict.states import AFTER, BEFORE, STATES

Array = NDArray[np.float64]

SAMPLES = 2000
SAME = 1e-12
ROUNDED = 1e-14
"""m and rad: what coordinates of about a metre are rounded to, on another way through."""
ELLIPSOID = 5e-4
"""By how much a linear maximum may be too large, where a force's direction is not known."""


@pytest.fixture(params=spread([*DRAWN, *MORE]), ids=lambda machine: f"drawn-{machine.name}")
def drawn_of_200(request: pytest.FixtureRequest) -> DrawnMachine:
    """One of 200 random machines, of which the CI takes some 25."""
    found: DrawnMachine = request.param
    return found


@cache
def known_of(shipped: MachineUnderTest) -> Known:
    """At the poses of its file."""
    return Known(shipped.loaded)


@cache
def known_at_poses(shipped: MachineUnderTest) -> Known:
    """At those of the tests."""
    return Known(shipped.loaded, shipped.poses)


# --- witness <= linear maximum + remainder <= bound; samples likewise


def what_is_found_is_within_what_is_proven(known: Known) -> None:
    machine = known.machine
    for name in STATES:
        found = known.surveys[name]
        proven = np.isfinite(found.bound)
        assert (found.witness[proven] <= found.bound[proven] * (1 + ROUNDING)).all()
        assert (found.linear <= found.bound).all()
        assert proven.all() or not has_majorant(machine)
        for at, (kind, row, state) in enumerate(known.worst(name)):
            columns, bound = known.kinds[kind], found.bound[row, at] * (1 + ROUNDING)
            sizes = drawn_inside(state, columns, SAMPLES)
            reached = farthest(state, columns)
            assert sizes.max() <= bound
            assert found.witness[row, at] <= reached.size * (1 + ROUNDING) <= bound * (1 + ROUNDING)
            if name == BEFORE and has_ends(state):
                pose = state.block.requested[state.block.indices]
                sampled = tp.monte_carlo(machine, pose, SAMPLES)["magnitude_maximum"].values[0, at]
                assert sampled == pytest.approx(sizes.max(), rel=ROUNDING)
    for answer in tp.accuracy(asking(machine)):
        found = known.surveys[answer.state]
        at = list(known.kinds).index(answer.quantity)
        assert answer.answer is None
        assert answer.linear.value == found.linear[:, at].max()
        assert answer.bound.value == found.bound[:, at].max()
        assert answer.witness.value >= found.witness[:, at].max() * (1 - ROUNDING)
        assert answer.witness.value <= answer.bound.value * (1 + ROUNDING)


def test_what_is_found_is_proven_of_machines_shipped(shipped: MachineUnderTest) -> None:
    what_is_found_is_within_what_is_proven(known_of(shipped))


def test_what_is_found_is_proven_of_machines_drawn(drawn_of_200: DrawnMachine) -> None:
    what_is_found_is_within_what_is_proven(Known(drawn_of_200.loaded))


# --- one number in all results


def linear_maxima(found: xr.Dataset, name: str) -> dict[int, Array]:
    """Pose -> (n_quantity,), of the poses that are not left out."""
    return dict(zip(found["pose"].values.tolist(), found[name].values, strict=True))


def it_has_one_number_in_all_results(known: Known, poses: Array) -> None:
    machine = known.machine
    surveyed = {
        name: dict(zip(found.numbers.tolist(), found.linear, strict=True))
        for name, found in known.surveys.items()
    }
    for name, numbers in (
        (BEFORE, linear_maxima(tp.budget(machine, poses), "linear_maximum")),
        (BEFORE, linear_maxima(tp.worst_case(machine, poses), "magnitude_linear")),
        (AFTER, linear_maxima(tp.compensate(machine, poses), "linear_maximum")),
    ):
        assert numbers
        assert set(numbers) <= set(surveyed[name])
        for pose, number in numbers.items():
            assert number == pytest.approx(surveyed[name][pose], rel=SAME)


def test_a_pose_has_one_number_in_all_results_of_machines_shipped(
    shipped: MachineUnderTest,
) -> None:
    it_has_one_number_in_all_results(known_at_poses(shipped), shipped.poses)


def test_a_pose_has_one_number_in_all_results_of_machines_drawn(drawn_of_200: DrawnMachine) -> None:
    it_has_one_number_in_all_results(
        Known(drawn_of_200.loaded, drawn_of_200.three_poses), drawn_of_200.three_poses
    )


def surveyed(known: Known) -> Array:
    """(n, state, quantity, 3) linear maximum, bound and witness, inf for none."""
    found = known.surveys
    return np.stack(
        [np.stack([each.linear, each.bound, each.witness], axis=-1) for each in found.values()],
        axis=1,
    )


def test_a_pose_alone_is_the_same_as_among_others(shipped: MachineUnderTest) -> None:
    together = surveyed(known_at_poses(shipped))
    for row in (0, 16, 36):
        alone = surveyed(Known(shipped.loaded, shipped.poses[row]))
        assert alone[0] == pytest.approx(together[row], rel=SAME, abs=ROUNDED)
        (first, *_) = tp.accuracy(asking(shipped.loaded), shipped.poses[row])
        assert first.linear.value == alone[0, 0, 0, 0]


@pytest.fixture
def restored() -> Iterator[None]:
    """Whatever a test chose, the threads of before come back."""
    threads = _kernel.threads()
    yield
    _kernel.threads(threads)


@pytest.mark.usefixtures("restored")
def test_one_thread_and_two_give_the_same(shipped: MachineUnderTest) -> None:
    found = []
    for threads in (1, 2):
        _kernel.threads(threads)
        found.append(surveyed(Known(shipped.loaded, np.tile(shipped.poses, (10, 1)))))
    assert np.array_equal(*found)


@pytest.mark.parametrize("name", SETS)
def test_instruction_sets_give_the_same(shipped: MachineUnderTest, name: str) -> None:
    best = surveyed(known_at_poses(shipped))
    with computing_or_skipped(name):
        found = surveyed(Known(shipped.loaded, shipped.poses))
    assert found == pytest.approx(best, rel=SAME, abs=ROUNDED)


# --- before and after are the same set


def after_is_no_more_than_before(known: Known) -> None:
    """On commanded freedoms, for sets symmetric about what is compensated.

    There the errors are v + E t before and E' t after, t in the same set, which has -t with every
    t: compensation takes v away and moves the machine from where v took it, which changes its
    sensitivities. Of two errors v + E t and v - E t one is at least as long as the root of
    |v|^2 + |E t|^2 (parallelogram law), so, with the largest length h of E t

        h^2 <= before^2 - |v|^2   and   after <= h + largest length of (E' - E) t

    The last term is of the order of |v| h, what it adds to `before` of that of h^3, where |v| is
    as small as h^2: less than the remainder, h^2, which compensation states.
    """
    machine = known.machine
    before, after = (known.surveys[name] for name in STATES)
    assert np.array_equal(before.numbers, after.numbers)
    states = zip(known.population.states(BEFORE), known.population.states(AFTER), strict=True)
    changes, values, symmetric = [], [], True
    for one, other in states:
        symmetric &= one.variables.domain.symmetric and other.variables.domain.symmetric
        if not symmetric or one.variables.names != other.variables.names:
            return
        value, effects, _ = first_order(machine, one.block, one.variables)
        left, moved, _ = first_order(machine, other.block, other.variables)
        kinds = list(known.kinds.values())
        change = largest(np.zeros_like(value), moved - effects, one.variables.domain, kinds)
        changes.append(change.length)
        values.append([[np.linalg.norm(e[c]) for c in kinds] for e in value])
        for kind, columns in known.kinds.items():
            if known.all_commanded(kind):
                unit = machine.characteristic_length if kind == "position" else 1.0
                assert np.abs(left[:, columns]).max() <= 1e-12 * unit
    change, value = np.concatenate(changes), np.concatenate(values)
    wider = 1.0 + (ELLIPSOID if machine.condition.envelope is not None else SAME)
    for at, kind in enumerate(known.kinds):
        if known.all_commanded(kind):
            most = np.sqrt(np.maximum(before.linear[:, at] ** 2 - value[:, at] ** 2, 0.0))
            assert (after.linear[:, at] <= (most + change[:, at]) * wider).all()
            added = after.bound[:, at] - after.linear[:, at]
            assert (after.linear[:, at] <= before.linear[:, at] * wider + added).all()


def test_compensation_adds_no_more_than_it_says_to_machines_shipped(
    shipped: MachineUnderTest,
) -> None:
    after_is_no_more_than_before(known_of(shipped))


def test_compensation_adds_no_more_than_it_says_to_machines_drawn(
    drawn_of_200: DrawnMachine,
) -> None:
    """Without listed values, which are not symmetric."""
    after_is_no_more_than_before(Known(loaded(without_lists(drawn_of_200.file))))


def without_lists(file: File) -> File:
    """The file without tolerances of listed values, and what they are correlated with."""
    found = copy.deepcopy(file)
    found.pop("correlation", None)
    for row in [*found["strut"], found.get("tolerance", {})]:
        for key, band in list(row.items()):
            if isinstance(band, dict) and "values" in band:
                del row[key]
    return found


# --- one source alone, and shares


def the_ranking_is_of_the_same_number(machine: Machine) -> None:
    found = tp.budget(machine)
    shares = found["share"].values
    assert (shares >= 0.0).all()
    assert math.fsum(shares) == pytest.approx(1.0, rel=SAME)
    highest = found["highest"].values
    assert shares == pytest.approx(highest[:, 0] / highest[:, 0].sum(), rel=SAME)
    ranks = found["rank"].values
    assert (np.diff(shares[np.argsort(ranks)]) <= 0.0).all()
    for at, source in enumerate(found["source"].values.tolist()):
        (own,) = [each for each in machine.sources if each.name == source]
        one = tp.budget(dataclasses.replace(machine, sources=(own,)))
        if np.array_equal(one["pose"].values, found["pose"].values):
            overall = one["linear_maximum"].values.max(axis=0)
            assert one["highest"].values[0] == pytest.approx(overall, rel=SAME)
            assert highest[at] == pytest.approx(overall, rel=SAME)


def test_sources_of_machines_shipped_are_ranked_by_it(shipped: MachineUnderTest) -> None:
    the_ranking_is_of_the_same_number(shipped.loaded)


def test_sources_of_machines_drawn_are_ranked_by_it(drawn_of_200: DrawnMachine) -> None:
    the_ranking_is_of_the_same_number(drawn_of_200.loaded)
