"""A force of known size and unknown direction, on the planar two-slider and a hexapod by hand.

The tool moves by C F d under the force F d, C its compliance, worked out here from the struts'
directions alone. Over all directions d a component c is at most F |C[c]|, and the length at most F
times the largest singular value of C.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import truepose as tp
from machine_texts import HEXAPOD, PLANAR, edited, load_text
from truepose.errors import RequestError
from truepose.machine import Envelope, Machine
from two_slider import LENGTH, directions

Floats = NDArray[np.float64]

FORCE = 400.0
AREA, MODULUS = 28e-6, 210e9
IN_PLANE = Envelope(FORCE, (0.0, 0.0, 1.0))
IN_SPACE = Envelope(FORCE)


@pytest.fixture
def planar(tmp_path: Path) -> Machine:
    """Both struts alike, nothing else that acts: no heat, no tolerance, no known force."""
    text = edited(
        PLANAR,
        ("length_tolerance = [-0.3, 0.3]\n", ""),
        ("temperature = 35\nforce = { x = 1200, y = -1500 }\n", ""),
        ('material = "steel"', 'modulus = "210 GPa"'),
    )
    return load_text(tmp_path, text)


def flexible(machine: Machine) -> Floats:
    """(n, 2, 2) displacement of the tool by a unit force, m/N, of the two-slider."""
    along = directions(machine, machine.poses())
    inverse = np.linalg.inv(along)
    return np.asarray(LENGTH / (MODULUS * AREA) * inverse @ np.swapaxes(inverse, 1, 2))


def pushed(machine: Machine, envelope: Envelope) -> Machine:
    return machine.with_condition(machine.condition.replace(envelope=envelope))


def position(result: xr.DataArray) -> Floats:
    return np.asarray(result.sel(quantity="position"))


@pytest.mark.parametrize("envelope", [IN_PLANE, IN_SPACE], ids=["circle", "sphere"])
def test_the_worst_is_that_of_the_worst_direction(planar: Machine, envelope: Envelope) -> None:
    machine, compliance = pushed(planar, envelope), flexible(planar)
    along = FORCE * np.linalg.norm(compliance, axis=2)
    longest = FORCE * np.linalg.svd(compliance, compute_uv=False)[:, 0]

    budget = tp.budget(machine)
    assert np.allclose(budget.worst.sel(source="loads"), along, rtol=1e-9)
    worst = tp.worst_case(machine)
    assert np.allclose(worst.linear, along, rtol=1e-9)
    assert np.allclose(position(worst.magnitude_linear), longest, rtol=1e-6)
    # Deflections of 1e-4 of the struts: the exact worst differs by as little.
    assert np.allclose(worst.exact, along, rtol=1e-3)
    assert np.allclose(position(worst.magnitude_exact), longest, rtol=1e-3)
    assert (tp.compensate(machine).bound >= along * (1.0 - 1e-9)).all()
    assert np.allclose(tp.compensate(machine).bound, along, rtol=1e-9)


def exact_over(machine: Machine) -> Floats:
    """(3, 180, 2) exact errors as the force goes round, each as a known force."""
    angles = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
    errors = [
        tp.budget(
            machine.with_condition(
                machine.condition.replace(force=(FORCE * np.cos(a), FORCE * np.sin(a), 0.0))
            ),
            machine.poses()[:3],
        ).overall_error.values
        for a in angles
    ]
    return np.stack(errors, axis=1)


def test_what_is_reached_is_what_a_known_force_all_round_reaches(planar: Machine) -> None:
    machine = pushed(planar, IN_PLANE)
    errors = exact_over(planar)
    worst = tp.worst_case(machine, planar.poses()[:3])
    # 180 directions, 2 degrees apart: a maximum is missed by less than 1 - cos 1 degree.
    most = errors.max(axis=1)
    assert (worst.exact_upper >= most * (1.0 - 1e-12)).all()
    assert (worst.exact_upper <= most / np.cos(np.radians(1.01))).all()
    assert (worst.exact_lower <= errors.min(axis=1) * (1.0 - 1e-12)).all()
    size = np.linalg.norm(errors, axis=2).max(axis=1)
    assert (position(worst.magnitude_exact) >= size * (1.0 - 1e-12)).all()
    assert (position(worst.magnitude_exact) <= size / np.cos(np.radians(1.01))).all()
    assert (worst.search == "directed").all()


@pytest.mark.parametrize("envelope", [IN_PLANE, IN_SPACE], ids=["circle", "sphere"])
def test_bounds_close_on_what_is_reached(planar: Machine, envelope: Envelope) -> None:
    machine = pushed(planar, envelope)
    found = tp.bounds(machine)
    assert (found.status == "proven").all()
    assert (found.upper >= found.reached_upper).all()
    assert (found.lower <= found.reached_lower).all()
    # Of a box it would be as much as 1.41 times too large. What is over is of second order: in the
    # enclosure of the slopes the components are left in their box. The size is the largest over
    # directions that are a little apart, for which a per cent is added.
    assert (found.upper <= found.reached_upper * 1.0005).all()
    assert (position(found.magnitude) <= position(found.reached_magnitude) * 1.01).all()
    assert (position(found.magnitude) >= position(found.reached_magnitude)).all()


def test_samples_are_of_directions_all_round(planar: Machine) -> None:
    poses = planar.poses()[:2]
    compliance = flexible(planar)[:2]
    for envelope, dimensions in ((IN_PLANE, 2), (IN_SPACE, 3)):
        machine = pushed(planar, envelope)
        found = tp.monte_carlo(machine, poses, samples=400_000, seed=4)
        covariance = FORCE**2 / dimensions * compliance @ np.swapaxes(compliance, 1, 2)
        # Of 4e5 samples a variance is known to 0.2 %; the error bends by 1e-4.
        assert np.allclose(found.covariance, covariance, rtol=0.02)
        longest = FORCE * np.linalg.svd(compliance, compute_uv=False)[:, 0]
        assert (position(found.magnitude_maximum) <= longest * 1.001).all()
        assert (position(found.magnitude_maximum) >= longest * 0.99).all()
        sobol = tp.monte_carlo(machine, poses, samples=2**16, sampling="sobol")
        assert np.allclose(sobol.covariance, covariance, rtol=0.02)
        assert (position(sobol.magnitude_maximum) <= longest * 1.001).all()
    # On the circle no sample is short: the least length is the smaller singular value.
    in_plane = tp.monte_carlo(pushed(planar, IN_PLANE), poses, samples=400_000, seed=4)
    shortest = FORCE * np.linalg.svd(compliance, compute_uv=False)[:, -1]
    lowest = in_plane.magnitude_quantile.sel(quantity="position").isel(level=0)
    assert np.allclose(lowest, shortest, rtol=0.02)


def test_a_direction_is_one_variable_of_the_shares(planar: Machine) -> None:
    machine = pushed(planar, IN_SPACE)
    found = tp.shares(machine, planar.poses()[:1], samples=64)
    assert found.parameter.values.tolist() == ["loads: force of unknown direction"]
    assert np.allclose(found.linear, 1.0)
    assert np.allclose(found.first, 1.0, atol=0.02)
    assert np.allclose(found.total, 1.0, atol=0.02)


def test_beside_a_tolerance_it_has_its_share_of_the_variance(tmp_path: Path) -> None:
    text = edited(
        PLANAR,
        ("temperature = 35\nforce = { x = 1200, y = -1500 }\n", ""),
        ('material = "steel"', 'modulus = "210 GPa"'),
        ("[-0.3, 0.3]", "[-0.05, 0.05]"),
    )
    machine = pushed(load_text(tmp_path, text), IN_SPACE)
    compliance, pose = flexible(machine)[0], machine.poses()[:1]
    of_force = FORCE**2 / 3.0 * (compliance**2).sum(axis=1)
    slopes = np.linalg.inv(directions(machine, machine.poses())[0])[:, 0]
    of_length = (0.05e-3) ** 2 / 3.0 * slopes**2
    found = tp.shares(machine, pose, samples=256)
    share = of_force / (of_force + of_length)
    of_loads = found.sel(parameter="loads: force of unknown direction")
    assert np.allclose(of_loads.linear[0], share, rtol=1e-6)
    assert np.allclose(of_loads.total[0], share, atol=0.01)
    assert np.allclose(found.source_linear.sel(source="loads")[0], share, rtol=1e-6)


def soft_hexapod(folder: Path) -> Machine:
    stiffness = 'section_area = "100 mm^2"\nmodulus = "200 GPa"\n'
    return load_text(folder, HEXAPOD.replace("platform = [", f"{stiffness}platform = ["))


def test_in_space_the_worst_is_the_length_of_three_effects(tmp_path: Path) -> None:
    machine = soft_hexapod(tmp_path)
    poses = machine.poses()[:4]
    compliances = []
    for pose in poses:
        centres = machine.kernel.joint_centres(*machine.kernel.place(pose[np.newaxis])[:2])[0]
        along = centres[:, 1] - centres[:, 0]
        length = np.linalg.norm(along, axis=1)
        unit = along / length[:, np.newaxis]
        jacobian = np.hstack([unit, np.cross(centres[:, 1] - pose[:3], unit)])
        stiffness = jacobian.T @ np.diag(100e-6 * 200e9 / length) @ jacobian
        compliances.append(np.linalg.inv(stiffness)[:, :3])
    compliance = np.stack(compliances)
    # A hundredth of the force, so that what is of second order is no matter.
    small = FORCE / 100.0
    pushed_machine = pushed(machine, Envelope(small))
    expected = small * np.linalg.norm(compliance, axis=2)
    found = tp.worst_case(pushed_machine, poses)
    assert np.allclose(found.linear, expected, rtol=1e-8)
    assert np.allclose(found.exact, expected, rtol=1e-4)
    sizes = small * np.linalg.svd(compliance[:, :3], compute_uv=False)[:, 0]
    assert np.allclose(position(found.magnitude_linear), sizes, rtol=1e-6)
    proven = tp.bounds(pushed_machine, poses)
    assert (proven.upper >= expected * 0.9999).all()
    assert (proven.upper <= expected * 1.001).all()
    assert (position(proven.magnitude) >= sizes * 0.9999).all()
    assert (position(proven.magnitude) <= sizes * 1.012).all()


def test_bounds_over_a_region_refuse_it_by_name(planar: Machine) -> None:
    with pytest.raises(RequestError) as caught:
        tp.bounds(pushed(planar, IN_SPACE), region={"x": (0.2, 0.21), "y": (0.2, 0.21)})
    (problem,) = caught.value.problems
    assert problem.code == "no-proof"
    assert "unknown direction" in problem.found
