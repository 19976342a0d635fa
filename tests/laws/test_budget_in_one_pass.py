"""The budget in one pass says what each of its numbers is by itself, on every road."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from instruction_sets import SETS, computing_or_skipped
from machine_under_test import OK, MachineUnderTest
from made_source import MadeSource, random_deviation, with_sources
from truepose.error_budget import in_kernel
from truepose.error_budget.largest import lengths
from truepose.machine import Machine
from truepose.probability.distributions import discrete, normal
from truepose.runs.displacement import displacement, sum_deviations
from truepose.runs.quantities import POSITIONS, quantities
from truepose.sources import Deviation, PoseBlock

Array = NDArray[np.float64]

AGREES = 1e-11
"""Relative to the largest number of a table,"""
ROUNDING = 1e-14
"""and what poses are off by, m and rad: some roundings of one of half a metre, which a delta whose
rods stand close to each other makes tens of."""
EACH = ("error", "error_lower", "error_upper", "worst", "reach", "uncertainty")
ALL = ("overall_error", "overall_error_lower", "overall_error_upper")


def allowed(largest: Array, table: str) -> Array:
    """By how much numbers of a table may differ of which the largest is so large."""
    return AGREES * largest + (0.0 if "percent" in table else ROUNDING)


def of_poses(machine: Machine, seed: int, count: int) -> Deviation:
    """A shift and a band that are others at each pose, some of them none."""
    one = random_deviation(machine, seed)
    random = np.random.default_rng(seed)
    half = one.half * random.uniform(size=(count, one.half.shape[1]))
    half[random.uniform(size=half.shape) < 0.2] = 0.0
    shift = one.shift * random.uniform(size=half.shape)
    return Deviation.of(
        one.parameters, shift, half, groups=one.groups, sign=one.sign, edge=one.edge
    )


def sources_of(machine: Machine, seed: int, count: int) -> tuple[MadeSource, ...]:
    """Bands, shifts and both, one for all poses and one a pose, in groups and not symmetric."""
    listed = discrete([-1e-4, 2e-4, 4e-4], [0.5, 0.25, 0.25])
    length = [at for at, name in enumerate(machine.parameters) if name.endswith((".x", ".length"))]
    return (
        MadeSource("band", random_deviation(machine, seed, shift=False), sets_overall_edges=True),
        MadeSource("known", random_deviation(machine, seed + 1, half=False)),
        MadeSource("both", of_poses(machine, seed + 2, count), sets_overall_edges=True),
        MadeSource("nothing", Deviation.of([0])),
        MadeSource(
            "listed",
            Deviation.of(length, 0.0, listed.half, distribution=listed.distribution),
        ),
        MadeSource("alone", Deviation.of([0], 1e-5, 2e-5, distribution=normal(3.0))),
    )


class Pass:
    """One pass over the poses of a machine, and each number by itself."""

    def __init__(self, machine: MachineUnderTest, *, plain: bool = False) -> None:
        joints, placements = machine.placed
        loaded = machine.loaded
        count = len(joints)
        made = sources_of(loaded, machine.seed, count)
        self.sources = [source for source in made if not plain or source.name != "listed"]
        self.machine = with_sources(loaded, *self.sources)
        self.block = PoseBlock(
            self.machine, loaded.condition, machine.poses, np.arange(count), joints, placements
        )
        self.kinds = list(quantities(loaded.components).values())
        self.deviations = [
            source.deviation(self.machine, loaded.condition, self.block) for source in self.sources
        ]

    def fill(self, block: PoseBlock | None = None) -> tuple[dict[str, Array], in_kernel.Filled]:
        block = self.block if block is None else block
        count, width = len(block.joints), len(self.machine.components)
        n_source, n_kind = len(self.sources), len(self.kinds)
        tables = {
            name: np.full(
                (count, n_kind)
                if name == "linear_maximum"
                else (count, n_source, n_kind)
                if name == "largest"
                else (count, width)
                if name.startswith("overall")
                else (count, n_source, width),
                7e7,
            )
            for name in in_kernel.TABLES
        }
        filled = in_kernel.fill(
            self.machine, block, self.sources, self.deviations, self.kinds, tables
        )
        return tables, filled

    def alone(self, moved: tuple[np.ndarray, Array]) -> tuple[Array, np.ndarray]:
        """Error and status of the machine that is moved so."""
        if not moved[1].any():
            shape = (len(self.block.joints), len(self.machine.components))
            return np.zeros(shape), np.full(shape[0], OK, np.uint8)
        return displacement(self.machine, self.block.joints, self.block.placements, moved)

    def expected(self) -> tuple[dict[str, Array], np.ndarray]:
        """The same numbers one by one, and where all of them are right (n,)."""
        count, width = len(self.block.joints), len(self.machine.components)
        each = {name: np.zeros((count, len(self.sources), width)) for name in EACH}
        far = np.zeros((count, len(self.sources), len(self.kinds)))
        fine = np.ones(count, np.bool_)
        for at, deviation in enumerate(self.deviations):
            moved = sum_deviations([(deviation.parameters, deviation.shift)])
            for name, values in (
                ("error", deviation.shift),
                ("error_lower", deviation.at_edge(-1.0)),
                ("error_upper", deviation.at_edge(+1.0)),
            ):
                each[name][:, at], status = self.alone(
                    sum_deviations([(deviation.parameters, values)])
                )
                fine &= status == OK
            error = np.ascontiguousarray(each["error"][:, at])
            each["worst"][:, at], far[:, at] = np.abs(error), lengths(error, self.kinds)
            if deviation.banded.size and in_kernel.is_plain(deviation):
                reach, uncertain, far[:, at], status = self.band([deviation], moved, error)
                fine &= status == OK
                each["reach"][:, at], each["uncertainty"][:, at] = reach, uncertain
                each["worst"][:, at] = np.maximum(np.abs(error - reach), np.abs(error + reach))
        both = {}
        pairs = list(zip(self.sources, self.deviations, strict=True))
        for name, side in zip(ALL, (0.0, -1.0, 1.0), strict=True):
            moved = sum_deviations(
                [
                    (d.parameters, d.at_edge(side) if side and s.sets_overall_edges else d.shift)
                    for s, d in pairs
                ]
            )
            both[name], status = self.alone(moved)
            fine &= status == OK
        centre = sum_deviations([(d.parameters, d.shift) for d in self.deviations])
        error = both["overall_error"]
        if in_kernel.in_boxes(self.deviations):
            *_, together, status = self.band(self.deviations, centre, error)
            fine &= status == OK
        else:
            together = lengths(error, self.kinds)
        return {**each, **both, "largest": far, "linear_maximum": together}, fine

    def band(
        self, deviations: list[Deviation], moved: tuple[np.ndarray, Array], error: Array
    ) -> tuple[Array, Array, Array, np.ndarray]:
        """Reach, uncertainty, largest lengths and status of bands about an error."""
        count = len(self.block.joints)
        variables: list[int] = []
        sigmas: list[float] = []
        for deviation in deviations:
            place = deviation.banded_variables[1]
            variables += (place + len(sigmas)).tolist()
            of_variable = dict(zip(place.tolist(), deviation.banded.tolist(), strict=True))
            sigmas += [deviation.distribution[of_variable[k]].sigmas for k in sorted(of_variable)]
        halves = [d.signed_half[:, d.banded] for d in deviations]
        half = np.concatenate([np.broadcast_to(h, (count, h.shape[1])) for h in halves], axis=1)
        parameters, shift = moved
        if not shift.any():
            parameters, shift = parameters[:0], shift[:, :0]
        numbers, status = self.machine.kernel.band_at(
            self.block.joints,
            self.block.placements,
            error,
            parameters,
            np.ascontiguousarray(shift),
            np.concatenate([d.parameters[d.banded] for d in deviations]),
            variables,
            half,
            sigmas,
            [kind.tolist() for kind in self.kinds],
        )
        width = error.shape[1]
        return numbers[:, :width], numbers[:, width : 2 * width], numbers[:, 2 * width :], status

    def check(self) -> None:
        found, filled = self.fill()
        expected, fine = self.expected()
        passed = (filled.shifts == OK) & (filled.bands == OK) & (filled.edges == OK)
        assert (passed == fine).all()
        assert fine.sum() > 0.8 * fine.size
        for name, numbers in expected.items():
            largest = np.abs(numbers[fine]).max(axis=tuple(range(numbers.ndim - 1)))
            off = np.abs(found[name] - numbers)[fine]
            assert (off <= allowed(largest, name)).all(), (name, (off / largest).max())
        self.check_percents(found, fine)
        for name, highest in filled.highest.items():
            sizes = np.abs(found[name][fine])
            assert np.array_equal(highest, np.fmax.reduce(sizes, axis=0).ravel(), equal_nan=True)
        assert set(filled.highest) == {
            f"{of}{what}_{side}"
            for of in ("", "overall_")
            for what in ("error", "percent")
            for side in ("lower", "upper")
        }

    def check_percents(self, found: dict[str, Array], fine: np.ndarray) -> None:
        components = self.machine.components
        for name in [name for name in found if "percent" in name]:
            error = found[name.replace("percent", "error")]
            for at, component in enumerate(components):
                if component not in POSITIONS:
                    assert np.isnan(found[name][..., at]).all()
                    continue
                size = np.abs(self.block.placements[:, POSITIONS.index(component)])
                meant = size >= 1e-6 * self.machine.characteristic_length
                assert np.isnan(found[name][~meant, ..., at]).all()
                one = (fine & meant).nonzero()[0]
                of_size = size[one] if error.ndim == 2 else size[one, np.newaxis]
                percent = 100.0 * np.abs(error[one, ..., at]) / of_size
                assert np.allclose(found[name][one, ..., at], percent, rtol=1e-14, atol=0.0)


@pytest.mark.parametrize("plain", [True, False], ids=["plain", "listed"])
def test_one_pass_says_what_each_number_is_by_itself(
    machine: MachineUnderTest, plain: bool
) -> None:
    Pass(machine, plain=plain).check()


@pytest.mark.parametrize("name", SETS)
def test_instruction_sets_agree(shipped: MachineUnderTest, name: str) -> None:
    one = Pass(shipped, plain=True)
    best, _ = one.fill()
    with computing_or_skipped(name):
        found, filled = one.fill()
    assert (filled.shifts == OK).all()
    assert (filled.bands == OK).all()
    for table in in_kernel.TABLES:
        missing = np.isnan(best[table])
        assert (np.isnan(found[table]) == missing).all()
        largest = np.nanmax(np.abs(best[table]), initial=0.0)
        assert np.nanmax(np.abs(found[table] - best[table]), initial=0.0) <= allowed(largest, table)


def test_what_is_no_number_leaves_its_neighbours_alone(shipped: MachineUnderTest) -> None:
    one = Pass(shipped, plain=True)
    expected, _ = one.fill()
    spoilt = one.block.joints.copy()
    spoilt[::2] = np.nan
    block = PoseBlock(
        one.machine,
        one.block.condition,
        one.block.requested,
        one.block.indices,
        spoilt,
        one.block.placements,
    )
    found, filled = one.fill(block)
    assert (filled.shifts[::2] != OK).all()
    assert (filled.shifts[1::2] == OK).all()
    for table in in_kernel.TABLES:
        good, other = expected[table][1::2], found[table][1::2]
        largest = np.nanmax(np.abs(good), initial=0.0)
        assert np.nanmax(np.abs(other - good), initial=0.0) <= allowed(largest, table), table
    for name, highest in filled.highest.items():
        sizes = np.fmax.reduce(np.abs(found[name][1::2]), axis=0).ravel()
        assert np.array_equal(highest, sizes, equal_nan=True)


def test_machines_that_cannot_follow_have_a_status(shipped: MachineUnderTest) -> None:
    one = Pass(shipped, plain=True)
    names = list(one.machine.parameters)
    length = names.index(next(n for n in names if n.endswith((".length", ".offset"))))
    # Beyond all reach at every other pose; at its shift, or only at the edges of its band.
    size = 40.0 * one.machine.characteristic_length
    shift = np.zeros((len(one.block.joints), 1))
    shift[::2] = size
    for deviation, which in (
        (Deviation.of([length], shift), "shifts"),
        (Deviation.of([length], 0.0, shift), "edges"),
    ):
        one.deviations[3] = deviation
        found, filled = one.fill()
        _, fine = one.expected()
        status = getattr(filled, which)
        assert (status[::2] != OK).all()
        assert (status[1::2] == OK).all()
        passed = (filled.shifts == OK) & (filled.bands == OK) & (filled.edges == OK)
        assert (passed == fine).all()
        assert np.isfinite(found["overall_error"][fine]).all()


def test_a_budget_is_that_of_its_poses_one_by_one(shipped: MachineUnderTest) -> None:
    sources = [s for s in sources_of(shipped.loaded, shipped.seed, 1) if s.name != "both"]
    machine = with_sources(shipped.loaded, *sources)
    together = tp.budget(machine, shipped.poses)
    for pose in (0, 16, 36):
        one = tp.budget(machine, shipped.poses[pose])
        for name, values in one.data_vars.items():
            if "pose" not in values.dims or values.dtype.kind != "f":
                continue
            rows, row = together[name].values, values.values[0]
            largest = np.nanmax(np.abs(rows), initial=0.0)
            assert np.nanmax(np.abs(rows[pose] - row), initial=0.0) <= allowed(largest, name), name
