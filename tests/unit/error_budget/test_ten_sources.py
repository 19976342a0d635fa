"""All sources in one budget: their linear parts add up, and none reads what another one does.

No plain hexapod has all ten, since a telescopic strut runs on no guideway and a strut on a carriage
has no screw of its own to turn. The machine shipped for it has struts of both kinds; the 6-UPS and
the 6-PUS have the nine each that fit them.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import truepose as tp
from build_machine import MACHINES
from machine_texts import load_text
from made_source import with_sources
from truepose.machine import Machine
from truepose.runs.displacement import ParameterDeviation, displacement, sum_deviations
from truepose.runs.poses import PoseRun
from truepose.sources import REGISTRY, Deviation, PoseBlock

_DRIVES = (
    'each.drive.backlash={ play = "4 um", threshold = "30 N" }',
    'each.drive.sensor={ resolution = "1 um", scale_error = "5 ppm" }',
    'each.drive.actuator={ lead_error = "8 um / 300 mm", periodic = '
    '{ amplitude = "2 um", period = "5 mm", phase = "20 deg" } }',
)
_STRUTS = (
    'each.strut.base_joint={ kind = "universal", clearance = "4 um" }',
    'each.strut.platform_joint={ kind = "universal", clearance = "5 um" }',
    'each.strut.mass="3 kg"',
)
_SCREW = 'each.strut.screw={ lead = "5 mm", base_axis = [1, 0.2, 0], platform_axis = [0.3, 1, 0] }'
_GUIDEWAY = (
    'each.drive.guideway={ squareness = "15 um/m", straightness = [{ direction = [0, 0, 1], '
    'amplitude = "5 um", shape = "bow", known = true }] }'
)

ROUNDING = 4e-15
"""Two roads to one pose, of half a metre and of rotations over half a metre: m and rad."""

MIXED = MACHINES / "hexapod_all_sources.toml"
UPS = MACHINES / "hexapod.toml"
PUS = MACHINES / "hexaglide.toml"
FILES = {MIXED: (), UPS: (*_DRIVES, *_STRUTS, _SCREW), PUS: (*_DRIVES, *_STRUTS, _GUIDEWAY)}
LACKING = {MIXED: None, UPS: "guideway", PUS: "screw_coupling"}

# What the file says of a source that reads keys of its own, as a pattern of lines. The force and
# the masses are not here: backlash and clearance go by them as elastic and loads do.
OWN_LINES = {
    "tolerance": r"^length_tolerance = .*\n|^\[tolerance\]\n(\S.*\n)*",
    "thermal": r"^temperature = \{.*\n",
    "backlash": r"^backlash = .*\n",
    "clearance": r'(?<=, )clearance = "\d um", |^\[clearance\]\n(\S.*\n)*',
    "screw_coupling": r"^screw = .*\n",
    "sensor": r"^sensor = .*\n",
    "actuator": r"^actuator = .*\n",
    "guideway": r"^guideway = .*\n",
}
EVERY = [source.name for source in REGISTRY if source.name in {*OWN_LINES, "elastic", "loads"}]


@cache
def loaded(path: Path) -> Machine:
    return tp.load(path, settings=FILES[path])


@cache
def some_poses(path: Path) -> tuple[tuple[float, ...], ...]:
    """40 poses of the workspace, out of order."""
    poses = loaded(path).poses()
    chosen = np.random.default_rng(11).choice(len(poses), 40, replace=False)
    return tuple(map(tuple, poses[chosen].tolist()))


@cache
def budget_of(path: Path) -> xr.Dataset:
    return tp.budget(loaded(path), some_poses(path))


def at_poses(path: Path) -> tuple[Machine, PoseBlock, dict[str, Deviation]]:
    """The machine, a block of its poses, and what each source does there."""
    machine = loaded(path)
    (block,) = PoseRun(machine, np.array(some_poses(path)), machine.condition)
    return (
        machine,
        block,
        {
            source.name: source.deviation(machine, machine.condition, block)  # type: ignore[attr-defined]
            for source in machine.sources
        },
    )


def linear(machine: Machine, block: PoseBlock, moved: ParameterDeviation) -> np.ndarray:
    """(n, n_component) the error to first order."""
    columns, values = moved
    sensitivity, status = machine.kernel.sensitivity_at(block.joints, block.placements, columns)
    assert not status.any()
    each = np.broadcast_to(values, (len(sensitivity), columns.size))
    return np.asarray(np.einsum("nck,nk->nc", sensitivity, each))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_source_that_fits_the_machine_is_there_and_does_something(path: Path) -> None:
    found = budget_of(path)
    assert found.source.values.tolist() == [each for each in EVERY if each != LACKING[path]]
    assert found.worst.max(["pose", "component"]).min() > 1e-7


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_linear_parts_add_up_to_the_linear_total(path: Path) -> None:
    machine, block, deviations = at_poses(path)
    shifts = {key: (each.parameters, each.shift) for key, each in deviations.items()}
    parts = np.array([linear(machine, block, sum_deviations([moved])) for moved in shifts.values()])
    total = linear(machine, block, sum_deviations(shifts.values()))
    assert np.abs(parts.sum(axis=0) - total).max() < 1e-14 * np.abs(parts).sum(axis=0).max()
    # The same total from the exact error: of a part of all deviations, either way, to third order.
    columns, values = sum_deviations(shifts.values())
    part = 1e-3
    either = [
        displacement(machine, block.joints, block.placements, (columns, sign * part * values))[0]
        for sign in (1.0, -1.0)
    ]
    differences = (either[0] - either[1]) / (2.0 * part)
    assert np.abs(differences - total).max() < 1e-8 * np.abs(total).max()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_what_the_exact_total_has_beyond_the_linear_parts_is_of_second_order(path: Path) -> None:
    machine, block, deviations = at_poses(path)
    columns, values = sum_deviations(
        [(each.parameters, each.shift) for each in deviations.values()]
    )
    total = linear(machine, block, (columns, values))
    beyond = []
    for part in (1.0, 0.5):
        exact, _ = displacement(machine, block.joints, block.placements, (columns, part * values))
        beyond.append(np.abs(exact - part * total).max())
    assert beyond[0] < 0.02 * np.abs(total).max()
    assert beyond[0] / beyond[1] == pytest.approx(4.0, rel=0.05)
    gap = (
        budget_of(path).overall_error.values
        - displacement(machine, block.joints, block.placements, (columns, values))[0]
    )
    assert np.abs(gap).max() < ROUNDING


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_source_taken_out_changes_its_own_rows_only(path: Path) -> None:
    machine, block, deviations = at_poses(path)
    every = budget_of(path)
    for removed in every.source.values:
        kept = [source for source in machine.sources if source.name != removed]
        found = tp.budget(with_sources(machine, *kept), some_poses(path))
        others = every.sel(source=[source.name for source in kept])
        for variable, values in found.data_vars.items():
            if values.dims == ("pose", "source", "component"):
                assert np.array_equal(values, others[variable], equal_nan=True), (removed, variable)
        without = [
            (each.parameters, each.shift) for key, each in deviations.items() if key != removed
        ]
        total = displacement(machine, block.joints, block.placements, sum_deviations(without))[0]
        assert np.abs(found.overall_error.values - total).max() < ROUNDING


@pytest.mark.parametrize("removed", OWN_LINES)
def test_a_source_taken_out_of_the_file_changes_its_own_rows_only(
    removed: str, tmp_path: Path
) -> None:
    text = MIXED.read_text(encoding="utf-8")
    shorter, count = re.subn(OWN_LINES[removed], "", text, flags=re.MULTILINE)
    assert count
    every = budget_of(MIXED)
    found = tp.budget(load_text(tmp_path, shorter), some_poses(MIXED))
    assert found.source.values.tolist() == [each for each in EVERY if each != removed]
    others = every.sel(source=found.source)
    for variable, values in found.data_vars.items():
        if values.dims == ("pose", "source", "component"):
            assert np.array_equal(values, others[variable], equal_nan=True), variable
