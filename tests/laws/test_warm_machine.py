"""A machine of one material at one temperature is the same machine, larger about its anchor."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import machine_files
from truepose.budget import exact
from truepose.budget.poses import Walk
from truepose.machine import Drive, Machine
from truepose.machine.parts_of_machine import Body
from truepose.sources.thermal import Thermal

ALPHA, RISE = 2e-5, 30.0
GROWN = ALPHA * RISE


def of_one_material(machine: Machine) -> Machine:
    """Every part of the same expansion; carriages at the origin of their guideway stay there."""
    nominal = dict(zip(machine.parameters, machine.nominal.tolist(), strict=True))
    anchor = [0.13 if name in machine.dof else 0.0 for name in "xyz"]

    def measured(drive: Drive) -> Drive:
        if f"{drive.part}.origin.x" not in nominal:
            return dataclasses.replace(drive, expansion=None)
        fixed = -nominal[f"{drive.part}.offset"] / nominal[f"{drive.part}.scale"]
        return dataclasses.replace(drive, expansion=ALPHA, fixed_at=fixed)

    warm = machine.condition.replace(
        reference_temperature=293.15, temperature=293.15 + RISE, gradient={}
    )
    grown = dataclasses.replace(
        machine,
        drives=tuple(map(measured, machine.drives)),
        struts=tuple(dataclasses.replace(strut, expansion=ALPHA) for strut in machine.struts),
        frame=Body("frame", expansion=ALPHA, anchor=tuple(anchor)),
        platform=Body("platform", expansion=ALPHA),
        tool=Body("tool"),
    )
    return dataclasses.replace(grown, condition=dataclasses.replace(warm, gradients={}))


@pytest.mark.parametrize("path", machine_files(), ids=lambda path: path.stem)
def test_a_warm_machine_of_one_material_is_a_larger_one(path: Path) -> None:
    machine = of_one_material(tp.load(path))
    poses = machine.poses()[:: max(1, len(machine.poses()) // 20)]
    (block,) = Walk(machine, poses, machine.condition)
    deviation = Thermal(requested=True).deviation(machine, machine.condition, block)
    # A carriage keeps its size in the source; here it is of the same material as all the rest.
    with_carriage = {drive.name for drive in machine.drives if drive.kind == "slider"}
    carriages = [
        index
        for index, name in enumerate(machine.parameters)
        for strut in machine.struts
        if strut.drive in with_carriage and name.startswith(f"{strut.part}.base.")
    ]
    extra = (np.array(carriages, np.intp), GROWN * machine.nominal[np.newaxis, carriages])
    moved = exact.together([(deviation.parameters, deviation.shift), extra])
    error, status = exact.displacement(machine, block.joints, block.placements, moved)
    assert not status.any()
    larger = GROWN * (block.placements[:, :3] - machine.frame.anchor)
    for index, component in enumerate(machine.components):
        wanted = larger[:, "xyz".index(component)] if component in "xyz" else np.zeros(len(larger))
        # Exact but for cos and sin of a crank, the solver's tolerance, and products of GROWN.
        assert np.allclose(error[:, index], wanted, rtol=0, atol=5e-12), component
