"""Similarity: a machine of one material at one temperature is the same machine, larger.

Where every part has the expansion a and the rise T, uniform, all lengths of the machine are 1 + a T
times what they were: the warm machine at its joints is the cold one at the same joints, larger
about the point of the frame that stays. Its tool point errs by a T (tool point - anchor), and the
platform does not turn, wherever screws and scales are fixed, and wherever the other bodies have
their anchors. No approximation is in this: what is left is rounding, that of the machine's lengths
in the closures, and in the pose as much more as the machine is badly conditioned.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from zlib import crc32

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from build_machine import machine_files
from drive_kinds import is_strut
from machine_file import file_at, rows_of
from random_machines import DrawnMachine
from truepose.machine import Body, Condition, Drive, Machine
from truepose.sources.thermal import Thermal

ALPHA, RISE = 2e-5, 30.0
GROWN = ALPHA * RISE
ROUNDING = 100 * np.finfo(np.float64).eps
"""Of the largest length: of the some ten products and sums of a closure, with room."""
MOST_POSES = 12

Floats = NDArray[np.float64]


def of_one_material(machine: Machine, random: np.random.Generator, *, scales: bool) -> Machine:
    """Every part of one expansion and nothing but heat; anchors and bearings anywhere.

    `scales`: struts that are drives are measured by a scale along them that grows, from where their
    length would be 0; else they are their own measure.
    """
    size = machine.characteristic_length

    def somewhere() -> tuple[float, float, float]:
        # In the plane of a planar machine, whose parts do not leave it.
        free = np.array([name in machine.dof for name in "xyz"])
        x, y, z = (random.uniform(-2.0, 2.0, 3) * size * free).tolist()
        return (x, y, z)

    def measured(drive: Drive) -> Drive:
        if is_strut(drive.kind):
            return dataclasses.replace(drive, expansion=ALPHA if scales else None, fixed_at=None)
        first, last = drive.travel
        fixed = first + (last - first) * random.uniform(-1.0, 2.0)
        made_of = (
            None if drive.carriage is None else dataclasses.replace(drive.carriage, expansion=ALPHA)
        )
        return dataclasses.replace(drive, expansion=ALPHA, fixed_at=fixed, carriage=made_of)

    stretching = {drive.name for drive in machine.drives if is_strut(drive.kind)}
    return dataclasses.replace(
        machine,
        drives=tuple(map(measured, machine.drives)),
        struts=tuple(
            dataclasses.replace(
                strut, expansion=0.0 if scales and strut.drive in stretching else ALPHA
            )
            for strut in machine.struts
        ),
        frame=Body("frame", expansion=ALPHA, anchor=somewhere()),
        platform=Body("platform", expansion=ALPHA, anchor=somewhere()),
        tool=Body("tool", expansion=ALPHA if random.uniform() < 0.5 else None, anchor=somewhere()),
        condition=Condition(
            reference_temperature=293.15, default_temperature=293.15 + RISE, gravity=0.0
        ),
        sources=(Thermal(requested=True),),
    )


def retold(machine: Machine, random: np.random.Generator) -> Machine:
    """The machine whose joints count otherwise: other scales and offsets, the middles the same."""
    values = {}
    for drive in machine.drives:
        scale, offset = (
            machine.nominal[machine.parameters.index(f"{drive.part}.{key}")]
            for key in ("scale", "offset")
        )
        middle = np.mean(drive.travel)
        other = scale * random.uniform(0.9, 1.1)
        values |= {
            f"{drive.part}.scale": other,
            f"{drive.part}.offset": offset + (scale - other) * middle,
        }
    return machine.replace(values)


def is_larger(machine: Machine, random: np.random.Generator, *, scales: bool) -> None:
    warm = of_one_material(machine, random, scales=scales)
    poses = warm.poses()
    poses = poses[:: max(1, len(poses) // MOST_POSES)]
    found = tp.budget(warm, poses)
    assert found.sizes["pose"] >= min(3, len(poses))
    _, placements, _ = warm.kernel.place(poses[found["pose"].values])
    larger = GROWN * (placements[:, :3] - warm.frame.anchor)
    wanted = np.zeros((len(larger), len(warm.components)))
    for index, component in enumerate(warm.components):
        if component in "xyz":
            wanted[:, index] = larger[:, "xyz".index(component)]
    lengths = np.abs(warm.nominal[[unit == "m" for unit in warm.units]]).max()
    worst = warm.conditioning(poses[found["pose"].values]).min()
    allowed = ROUNDING * max(1.0, lengths) / worst
    assert np.abs(found.error.sel(source="thermal").values - wanted).max() < allowed
    # What is known is compensated: of what can be commanded, nothing is left.
    left = tp.compensate(warm, poses)
    assert left.sizes["pose"] >= min(3, len(poses))
    commanded = [
        index
        for index, component in enumerate(warm.components)
        if component.replace("rx", "a").replace("ry", "b").replace("rz", "c") in warm.commanded
    ]
    assert np.abs(left["residual_middle"].values[:, commanded]).max() < allowed


def random_of(path: Path) -> np.random.Generator:
    return np.random.default_rng(crc32(path.stem.encode()))


@pytest.mark.parametrize("path", machine_files(), ids=lambda path: path.stem)
def test_a_warm_machine_of_one_material_is_a_larger_one(path: Path) -> None:
    random = random_of(path)
    is_larger(retold(tp.load(path), random), random, scales=False)


@pytest.mark.parametrize(
    "path",
    [
        path
        for path in machine_files()
        if any(is_strut(row["kind"]) for row in rows_of(file_at(path), "drive"))
    ],
    ids=lambda path: path.stem,
)
def test_it_is_where_scales_measure_the_telescopic_struts(path: Path) -> None:
    random = random_of(path)
    is_larger(retold(tp.load(path), random), random, scales=True)


def test_a_warm_machine_drawn_of_one_material_is_a_larger_one(drawn: DrawnMachine) -> None:
    """Its offsets, scales and bearings are drawn with it."""
    is_larger(drawn.loaded, drawn.random("of one material"), scales=False)


def test_a_drawn_one_is_where_scales_measure_the_telescopic_struts(drawn: DrawnMachine) -> None:
    # One without telescopic struts has other bearings and anchors here than above.
    is_larger(drawn.loaded, drawn.random("measured by scales"), scales=True)
