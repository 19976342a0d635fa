"""Proven bounds at poses: against samples and vertices of the same machines, and where none is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES, hexapod
from machine_texts import HEXAPOD, PLANAR, edited, load_text
from made_source import MadeSource, with_sources
from oracle_cases import case, pose_in_order
from truepose import _kernel
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.runs.poses import PoseRun, required_sources
from truepose.runs.variables import Variables, variables_at
from truepose.sources import Deviation, PoseBlock
from truepose.uncertainty_analysis.bounds import SCHEMA
from truepose.uncertainty_analysis.truncation import Ends

Array = NDArray[np.float64]

SAMPLES = 100_000
"""Samples at a pose that no bound may be left by, half of them inside the box, half at vertices."""

ROUNDING = 1e-13
"""Of the machine's size: by which the error of a sample itself is uncertain."""


def load(name: str) -> Machine:
    return tp.load(MACHINES / f"{name}.toml")


def geometry(machine: Machine) -> list[int]:
    """Every length of the machine's parts: joint centres, lengths, offsets."""
    return [
        at
        for at, (name, unit) in enumerate(zip(machine.parameters, machine.units, strict=True))
        if unit == "m" and not name.startswith("tool.")
    ]


def banded(machine: Machine, half: float) -> Machine:
    """The machine with this band on every length, and no other source."""
    return with_sources(machine, MadeSource("bands", Deviation.of(geometry(machine), half=half)))


@dataclass(frozen=True)
class Boxed:
    """A machine at poses, and the box of its deviations."""

    machine: Machine
    block: PoseBlock
    moves: Variables

    @classmethod
    def of(cls, machine: Machine, poses: Array) -> Boxed:
        (block,) = PoseRun(machine, poses, machine.condition)
        moves = variables_at(machine, block, required_sources(machine, machine.condition))
        return cls(machine, block, Ends(3.0).truncated(moves))

    def sampled(self, kind: str, count: int, seed: int) -> _kernel.Tallies:
        """Tallies of components, then magnitudes, of uniform or two-point variables."""
        shifted, shift = self.moves.shift
        study = _kernel.Study(
            self.machine.kernel,
            self.block.joints,
            self.block.placements,
            shifted,
            shift,
            self.moves.columns,
            self.moves.variable_of.tolist(),
            self.moves.half_width,
        )
        m = len(self.machine.components)
        kinds = len({name in "xyz" for name in self.machine.components})
        table = np.zeros((self.block.indices.size, m + kinds))
        tallies = _kernel.Tallies(table, table + 1e-6, m + kinds, m)
        described = [
            {"kind": kind, "sigmas": 1.0, "stream": 0, "number": number}
            for number in range(len(self.moves.names))
        ]
        study.sample(_kernel.Variables(described), seed, 0, count, tallies)
        return tallies

    def assert_inside(self, found: xr.Dataset, count: int, seed: int = 3) -> None:
        """No sample leaves its bound, and none is without a result, at the poses proven."""
        proven = found.status.values == "proven"
        slack = ROUNDING * self.machine.characteristic_length
        m = len(self.machine.components)
        for kind in ("uniform", "two-point"):
            tallies = self.sampled(kind, count // 2, seed)
            assert (tallies.failed[proven] == 0).all()
            lowest, highest = np.moveaxis(tallies.extremes[proven], 2, 0)
            assert (highest[:, :m] <= found.upper[proven] + slack).all()
            assert (lowest[:, :m] >= found.lower[proven] - slack).all()
            assert (highest[:, m:] <= found.magnitude[proven] + slack).all()

    def at_vertex(self, signs: Array) -> Array:
        """(n, n_component) errors where the variables of each pose are `signs` (n, v)."""
        kernel, (parameters, values) = self.machine.kernel, self.moved(signs)
        found, status = kernel.displacement(
            self.block.joints, self.block.placements, parameters, values
        )
        assert (status == 0).all()
        return found

    def moved(self, signs: Array) -> tuple[NDArray[np.intp], Array]:
        """All parameters and their deviations (n, n_parameter)."""
        every = np.arange(len(self.machine.parameters))
        parameters, shift = self.moves.shift
        values = np.zeros((len(signs), every.size))
        values[:, parameters] = shift
        for column, parameter in enumerate(self.moves.columns):
            swing = self.moves.half_width[:, column]
            values[:, parameter] += swing * signs[:, self.moves.variable_of[column]]
        return every, values

    def worst_vertex(self, direction: Array) -> Array:
        """(n, n_component) at the vertex found farthest along a direction (n_component,).

        The one that the slopes point to; then the one that the slopes there point to, and so on.
        """
        count = len(self.block.indices)
        signs = np.zeros((count, len(self.moves.names)))
        for _ in range(6):
            every, values = self.moved(signs)
            slopes, _ = self.machine.kernel.sensitivity_moved(
                self.block.joints, self.block.placements, self.moves.columns, every, values
            )
            along = np.einsum("c,nck->nk", direction, slopes) * self.moves.half_width
            effects = np.zeros_like(signs)
            for column, variable in enumerate(self.moves.variable_of):
                effects[:, variable] += along[:, column]
            signs = np.where(effects >= 0.0, 1.0, -1.0)
        return self.at_vertex(signs)


def some_poses(machine: Machine, count: int = 2) -> Array:
    """Of the file's workspace, off its middle (where a machine may be symmetric)."""
    poses = machine.poses()
    found: Array = poses[np.linspace(0, len(poses) - 1, count).astype(int)]
    return found


MACHINES_BANDED = {
    "planar_two_slider": 1e-4,
    "hexapod": 1e-4,
    "linear_delta": 2e-5,  # its rods stand 60 mm apart: 0.1 mm turn the platform by 30 mrad
    "3prs": 1e-4,
    "rotary_delta": 2e-5,
    "tricept": 1e-4,
}


@cache
def banded_bounds(name: str) -> tuple[Boxed, xr.Dataset]:
    machine = banded(load(name), MACHINES_BANDED[name])
    poses = some_poses(machine)
    return Boxed.of(machine, poses), tp.bounds(machine, poses)


@pytest.mark.parametrize("name", MACHINES_BANDED)
def test_no_sample_leaves_its_bound(name: str) -> None:
    boxed, found = banded_bounds(name)
    assert (found.status == "proven").all()
    boxed.assert_inside(found, SAMPLES)


@pytest.mark.parametrize("name", MACHINES_BANDED)
def test_the_worst_vertices_are_inside_and_near(name: str) -> None:
    boxed, found = banded_bounds(name)
    m = len(boxed.machine.components)
    slack = ROUNDING * boxed.machine.characteristic_length
    for at in range(m):
        up, down = (boxed.worst_vertex(sign * np.eye(m)[at])[:, at] for sign in (1.0, -1.0))
        assert (up <= found.upper[:, at] + slack).all()
        assert (down >= found.lower[:, at] - slack).all()
        assert (up <= found.reached_upper[:, at] + slack).all()
        assert (down >= found.reached_lower[:, at] - slack).all()
    assert (found.reached_upper <= found.upper + slack).all()
    assert (found.reached_lower >= found.lower - slack).all()
    assert (found.reached_magnitude <= found.magnitude + slack).all()
    assert (found.upper <= 1.2 * found.reached_upper).all()
    assert (found.lower >= 1.2 * found.reached_lower).all()
    assert (found.magnitude <= 1.2 * found.reached_magnitude).all()


@pytest.mark.parametrize("name", [*MACHINES_BANDED, "hexapod_all_sources", "hexaglide", "3rpr"])
def test_the_sources_of_the_files(name: str) -> None:
    machine = load(name)
    poses = some_poses(machine)
    found = tp.bounds(machine, poses, truncate=3)
    assert (found.status == "proven").all()
    boxed = Boxed.of(machine, poses)
    boxed.assert_inside(found, SAMPLES // 10)
    shift = tp.budget(machine, poses).overall_error
    assert ((found.lower <= shift) & (shift <= found.upper)).all()
    linear = tp.uncertainty(machine, poses)
    assert (found.upper >= linear.value).all()
    wide = found.upper - found.lower
    assert (found.magnitude >= found.reached_magnitude).all()
    assert (found.magnitude <= 1.001 * found.reached_magnitude).all()
    assert (found.upper - found.reached_upper <= 0.02 * wide).all()
    assert (found.reached_lower - found.lower <= 0.02 * wide).all()


def test_the_hexapod_of_500_mm_with_a_tenth_on_every_length() -> None:
    """All 42: no more than a hair above the worst vertex, in every component."""
    machine = banded(load("hexapod"), 1e-4)
    home = machine.kernel.home[np.newaxis]
    assert len(geometry(machine)) == 42
    found = tp.bounds(machine, home).isel(pose=0)
    boxed = Boxed.of(machine, home)
    for at in range(6):
        up = boxed.worst_vertex(np.eye(6)[at])[0, at]
        down = boxed.worst_vertex(-np.eye(6)[at])[0, at]
        assert up <= float(found.upper[at]) <= 1.001 * up
        assert 1.001 * down <= float(found.lower[at]) <= down
    sizes = found.reached_magnitude.values
    assert (sizes <= found.magnitude).all()
    assert (found.magnitude <= 1.001 * sizes).all()
    # Random machines stay far inside: that is no fault of the bound.
    largest = boxed.sampled("uniform", 10_000, 1).extremes[0, :6, 1]
    assert (largest < 0.7 * found.upper).all()


@pytest.mark.parametrize("name", ["planar_two_slider", "hexapod", "rotary_delta"])
def test_bounds_shrink_with_the_bands_to_the_linear_worst_case(name: str) -> None:
    machine = load(name)
    poses = some_poses(machine)
    last: xr.Dataset | None = None
    for half in (2e-5, 1e-5, 1e-6, 1e-7):
        found = tp.bounds(banded(machine, half), poses)
        assert (found.status == "proven").all()
        # Second order: half a millimetre of error in a metre, squared, and some.
        excess = np.abs(np.stack([found.upper, -found.lower]) / found.linear.values - 1.0)
        assert excess.max() < 2e3 * half
        if last is not None:
            assert (found.upper < last.upper).all()
            assert (found.lower > last.lower).all()
            assert (found.magnitude < last.magnitude).all()
        last = found


def test_without_bands_the_bound_is_the_error(tmp_path: Path) -> None:
    """The warm machine under its force: all is known, and the interval is rounding."""
    text = edited(PLANAR, ("length_tolerance = [-0.3, 0.3]\n", ""))
    machine = load_text(tmp_path, text)
    found, budget = tp.bounds(machine), tp.budget(machine)
    assert (found.status == "proven").all()
    assert np.abs(found.upper - budget.overall_error).max() < 1e-12
    assert (found.upper - found.lower).max() < 1e-12
    assert (found.upper >= found.lower).all()
    # A bound of something known to the last digit holds it to the last digit but one.
    assert (budget.overall_error <= found.upper + 1e-15).all()
    assert (budget.overall_error >= found.lower - 1e-15).all()


def test_two_lengths_in_closed_form(tmp_path: Path) -> None:
    """The crossing of two circles: its extremes are at the corners, where bounds are sharp."""
    text = edited(
        PLANAR,
        ("length = 500\nsection", "length = 500\nlength_tolerance = 0.2\nsection"),
        ("temperature = 35\nforce", "force"),
        ("x = 1200, y = -1500", "x = 0"),
    )
    machine = load_text(tmp_path, text)
    found, exact = tp.bounds(machine), tp.worst_case(machine)
    assert (found.upper >= exact.exact_upper - 1e-15).all()
    assert np.allclose(found.upper, exact.exact_upper, rtol=1e-6)
    assert np.allclose(found.lower, exact.exact_lower, rtol=1e-6)
    assert np.allclose(found.magnitude, exact.magnitude_exact, rtol=3e-4)


def bounds_or_nothing(machine: tp.Machine, poses: np.ndarray) -> xr.Dataset | None:
    """The bounds, or None where every pose had to be left out."""
    try:
        return tp.bounds(machine, poses)
    except RequestError as refusal:
        if refusal.problems[0].code != "no-pose-left":
            raise
    return None


@pytest.mark.parametrize("name", ["five_bar", "3rpr", "planar_collinear", "pentapod", "hexapod"])
@pytest.mark.parametrize("half", [1e-5, 3e-4, 3e-3])
def test_no_status_is_false(name: str, half: float) -> None:
    """Anywhere, next to singular poses too, with bands of any width: what is proven holds."""
    machine = banded(load(name), half)
    box = machine.poses()
    random = np.random.default_rng(11)
    turn = np.array([each in "abc" for each in machine.commanded])
    reach = np.where(turn, 1.2, 0.5)
    poses = box.mean(axis=0) + reach * random.uniform(-1.0, 1.0, (3000, box.shape[1]))
    conditioning, status = machine.kernel.conditioning(poses, status=True)
    good = np.flatnonzero(status == 0)
    nearest = good[np.argsort(np.abs(conditioning[good]))]
    chosen = poses[np.concatenate([nearest[:6], nearest[-2:]])]
    found = bounds_or_nothing(machine, chosen)
    if found is None:
        return  # at none of the poses all vertices have a result, and nothing is claimed
    proven = found.status.values == "proven"
    for variable in (found.lower, found.upper, found.magnitude):
        assert np.isnan(variable[~proven]).all()
        assert np.isfinite(variable[proven]).all()
    boxed = Boxed.of(machine, chosen[found.pose.values])
    boxed.assert_inside(found, 4000)


def test_a_pose_that_is_singular_has_a_status_and_no_number() -> None:
    """The Griffis-Duffy platform, singular at every pose."""
    stated = case("d02_griffis_duffy")
    kernel = _kernel.Machine(hexapod(stated["base_points"], stated["platform_points"]))
    sample = stated["computed_reference"]["sample_pose"]
    pose = pose_in_order("xyz", sample["p"], sample["euler_RxRyRz_rad"])
    joints, placements, _ = kernel.place(pose[np.newaxis])
    for swing in (1e-12, 1e-6, 1e-2):
        lower, upper, magnitude, status, boxes = kernel.bounds_at(
            joints,
            placements,
            [],
            np.empty((1, 0)),
            kernel.length_parameters,
            list(range(6)),
            np.full((1, 6), swing),
        )
        assert (status, boxes) == (["near_singular"], [1])
        for values in (lower, upper, magnitude):
            assert np.isnan(np.asarray(values)).all()


def test_absurdly_wide_bands_have_a_status_and_no_number() -> None:
    machine = banded(load("hexapod"), 0.01)
    found = tp.bounds(machine, machine.kernel.home)
    assert found.status.values.tolist() == ["box_too_wide"]
    for name in ("lower", "upper", "magnitude"):
        assert np.isnan(found[name]).all()
    # What is reached is a fact all the same.
    assert np.isfinite(found.reached_upper).all()


def test_the_schema_is_what_there_is() -> None:
    _, found = banded_bounds("hexapod")
    assert list(found.data_vars) == list(SCHEMA)
    for name, variable in SCHEMA.items():
        assert found[name].dims == variable.dims
    assert found.upper.attrs["units"] == "m, rad"
    assert found["quantity"].values.tolist() == ["position", "orientation"]
    assert found.status.dtype.kind == "U"
    assert found.attrs["truncate"] == "none"


def test_poses_in_parts_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = load("3rpr")
    poses = machine.poses()[:7]
    whole = tp.bounds(machine, poses)
    monkeypatch.setattr("truepose.runs.poses.BLOCK", 4)
    monkeypatch.setattr("truepose.uncertainty_analysis.bounds.POSES", 3)
    xr.testing.assert_allclose(tp.bounds(machine, poses), whole, rtol=1e-13)


def test_progress_and_poses_left_out() -> None:
    machine = load("planar_two_slider")
    seen: list[tuple[int, int]] = []
    poses = np.concatenate([machine.poses()[:20], [[9.0, 9.0]]])
    found = tp.bounds(machine, poses, progress=lambda *each: seen.append(each))
    assert seen[-1][1] == 21
    assert [done for done, _ in seen] == [16, 20]
    assert found.left_out_index.values.tolist() == [20]


NORMAL = edited(PLANAR, ("[-0.3, 0.3]", '{ band = 0.3, distribution = "normal", sigmas = 2 }'))


def test_a_distribution_without_ends_is_cut_where_it_is_said(tmp_path: Path) -> None:
    machine = load_text(tmp_path, NORMAL)
    stated, banded = tp.bounds(machine), tp.bounds(load_text(tmp_path, PLANAR))
    assert stated.attrs["truncate"] == "as stated"
    assert stated.attrs["unbounded"] == "normal, 2 sigma: strut.1.length"
    assert (banded.attrs["truncate"], banded.attrs["unbounded"]) == ("none", "none")
    for name in ("lower", "upper", "magnitude", "reached_magnitude", "linear"):
        assert (stated[name].values == banded[name].values).all()
    cut = tp.bounds(machine, truncate=4)
    # At 4 of standard deviations of 0.15 mm.
    wide = tp.bounds(load_text(tmp_path, edited(PLANAR, ("[-0.3, 0.3]", "[-0.6, 0.6]"))))
    assert cut.attrs["truncate"] == 4.0
    assert cut.attrs["unbounded"] == "normal, 2 sigma: strut.1.length"
    assert np.allclose(cut.upper, wide.upper, rtol=1e-13)
    assert np.allclose(cut.magnitude, wide.magnitude, rtol=1e-13)
    student = NORMAL.replace('"normal"', '"student-t", dof = 5')
    found = tp.bounds(load_text(tmp_path, student))
    assert found.attrs["unbounded"] == "student-t, 5 degrees of freedom, 2 sigma: strut.1.length"
    assert (found.upper.values == banded.upper.values).all()
    assert np.allclose(tp.bounds(load_text(tmp_path, student), truncate=4).upper, wide.upper)


def test_all_endless_distributions_are_named(tmp_path: Path) -> None:
    text = f'{HEXAPOD}\n[tolerance]\n"strut.*.base.?" = {{ band = 0.1, distribution = "normal" }}\n'
    machine = load_text(tmp_path, text)
    assert tp.bounds(machine).attrs["unbounded"] == tp.worst_case(machine).attrs["unbounded"]


def refusal(call: Callable[..., Any], *arguments: Any, **named: Any) -> RequestError:
    with pytest.raises(RequestError) as caught:
        call(*arguments, **named)
    return caught.value


def test_bad_requests(tmp_path: Path) -> None:
    machine = load("planar_two_slider")

    def code_of(*arguments: Any, **named: Any) -> str:
        return refusal(tp.bounds, *arguments, **named).problems[0].code

    for truncate in (0.0, -1.0, float("nan"), float("inf"), "3", True):
        assert code_of(machine, truncate=truncate) == "bad-truncation"
    assert code_of(machine, [[1.0]]) == "bad-poses"
    assert code_of(machine, [[9.0, 9.0]]) == "no-pose-left"
    assert code_of(load_text(tmp_path, HEXAPOD)) == "no-source"
    assert code_of(load("overconstrained")) == "no-proof"
    assert code_of(machine, [[0.3, 0.2]], region={"x": (0.2, 0.3)}) == "bad-region"
