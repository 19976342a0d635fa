"""Compensation on the planar machine, where every term is known in closed form."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from made_source import MadeSource, with_sources
from truepose.sources import Deviation

POSE = [0.3, 0.2]  # both struts at the same slope: 300 across, 400 up
TAKEN = 1e-4
HALF = 3e-4


@pytest.fixture(scope="module")
def machine() -> tp.Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")


def lengths(machine: tp.Machine, **values: object) -> MadeSource:
    return MadeSource("lengths", Deviation.of(machine.kernel.length_parameters, **values))  # type: ignore[arg-type]


def test_an_asymmetric_band_is_half_of_it_correctable(machine: tp.Machine) -> None:
    found = tp.compensate(with_sources(machine, lengths(machine, shift=TAKEN, half=HALF)), POSE)
    # Longer struts: the carriages go up by what the slope asks for.
    height = np.sqrt((0.5 + TAKEN) ** 2 - 0.3**2)
    assert np.allclose(found["joint_corrected"], 0.2 + height, rtol=0, atol=1e-15)
    assert np.allclose(found.joint_nominal, 0.6, rtol=0, atol=1e-15)
    for name, length in (("lower", 0.5 + TAKEN - HALF), ("upper", 0.5 + TAKEN + HALF)):
        expected = height - np.sqrt(length**2 - 0.3**2)
        assert np.allclose(found[f"residual_{name}"], [[0.0, expected]], rtol=0, atol=1e-15)
    assert np.allclose(found.residual_middle, 0.0, atol=1e-15)
    # A strut moves the tool by 1 / (2 cos) across and 1 / (2 sin) up, at its slope as it is.
    across, up = 0.3 / (0.5 + TAKEN), height / (0.5 + TAKEN)
    assert np.allclose(found.bound, [[HALF / across, HALF / up]], rtol=1e-12)


def test_the_second_order_by_hand(machine: tp.Machine) -> None:
    found = tp.compensate(with_sources(machine, lengths(machine, shift=TAKEN, half=HALF)), POSE)
    # Struts as long as they are known to be, from the carriages down to the tool.
    length = 0.5 + TAKEN
    cosine = 0.3 / length
    sine = np.sqrt(1.0 - cosine**2)
    struts = np.array([[cosine, -sine], [-cosine, -sine]])
    influence = np.linalg.inv(struts)
    moves = influence * HALF  # column: of the strut that is longer
    form = np.zeros((2, 2, 2))
    for strut, along in enumerate(struts):
        across = np.array([-along[1], along[0]]) @ moves
        form += influence[:, strut, None, None] * np.outer(across, across) / (2.0 * length)
    expected = np.abs(form).sum(axis=(1, 2))
    # What is added is of third order: smaller by the deviation over the length.
    assert np.allclose(found.second_order, expected, rtol=5e-3)
    assert (found.second_order.values >= expected).all()
    assert found.proven.all()


def test_a_group_that_moves_both_struts_alike_has_a_smaller_bound(machine: tp.Machine) -> None:
    alike = tp.compensate(with_sources(machine, lengths(machine, half=HALF, groups=0)), POSE)
    assert np.allclose(alike.bound, [[0.0, HALF / 0.8]], atol=1e-15)
    opposed = lengths(machine, half=HALF, groups=0, sign=[1.0, -1.0])
    found = tp.compensate(with_sources(machine, opposed), POSE)
    assert np.allclose(found.bound, [[HALF / 0.6, 0.0]], atol=1e-15)
    # The edges are those of the common variable: one strut long, the other short.
    assert abs(found.residual_upper[0, 0]) > 0.99 * HALF / 0.6
    assert abs(found.residual_upper[0, 1]) <= found.second_order[0, 1]


def test_sources_add_in_shift_and_bound(machine: tp.Machine) -> None:
    one = lengths(machine, shift=TAKEN, half=HALF)
    two = MadeSource("two", Deviation.of([machine.parameters.index("drive.d1.offset")], 2e-4, 5e-5))
    both = tp.compensate(with_sources(machine, one, two))
    apart = [tp.compensate(with_sources(machine, source)) for source in (one, two)]
    # Each at its own shift: the slopes of the struts differ by a part in a thousand.
    assert np.allclose(both.bound, apart[0].bound + apart[1].bound, rtol=1e-3)
    moved = [found["joint_corrected"] - found.joint_nominal for found in (both, *apart)]
    assert np.allclose(moved[0], moved[1] + moved[2], atol=1e-9)
    # d1 goes back by what its scale is out, exactly.
    assert np.allclose(moved[2], [-2e-4, 0.0], atol=1e-15)


def test_the_law_over_the_whole_box_of_the_file(machine: tp.Machine) -> None:
    found = tp.compensate(machine)
    shift = found["joint_corrected"].values
    columns = machine.kernel.length_parameters
    errors = tp.budget(machine)
    sensitivity = machine.sensitivity(machine.poses())[:, :, columns]
    known = np.linalg.solve(
        sensitivity,
        errors.error.sel(source=["thermal", "elastic"]).sum("source").values[..., np.newaxis],
    )[..., 0]
    for corner in product([-3e-4, 0.0, 3e-4], repeat=2):
        _, placements, _ = machine.kernel.place(machine.poses())
        residual, _ = machine.kernel.displacement(shift, placements, columns, known + corner)
        # `known` is the stretch to first order only: its second order is below a tenth of a um.
        assert (np.abs(residual) <= found.bound + found.second_order + 1e-7).all()


def test_of_a_band_wider_than_the_struts_nothing_is_proven(machine: tp.Machine) -> None:
    wide = with_sources(machine, lengths(machine, half=0.5, edge=False))
    found = tp.compensate(wide, POSE)
    assert not found.proven.any()
    assert np.isnan(found.second_order).all()
    assert np.isfinite(found.bound).all()
    assert np.abs(found.residual_middle).max() < 1e-15
