"""Displacements by force, weight and heat against CalculiX, which knows nothing of closures.

Each machine is built as a truss at 20 poses: its struts elastic members between joint centres, its
platform a rigid body. The finite-element program finds where the tool goes by equilibrium of nodes;
truepose by `sensitivity . deviation`. Both are linear, and they must agree to the program's digits.

Each machine is built twice, with masses and expansions of its parts, whatever its file says of
them: stiff where its file says nothing, and with drives and joints that give way too.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

import calculix
import truepose
from build_machine import machine_files
from guided_machines import rigidly_guided
from machine_under_test import OK, MachineUnderTest
from reference_kinematics import rotation_of
from sweeps import sweep
from truepose.machine import Condition, Joint, Machine
from truepose.runs.poses import PoseRun
from truepose.sources import Source
from truss_of_machine import COMPONENTS, Truss

Vector = NDArray[np.float64]

AGREES = 1e-6
"""Of the displacement's length: a printed number is within half a unit of its seventh digit."""
POSES = np.r_[0:10, 27:37]
"""Ten of the poses anywhere in the workspace, ten at its borders and its corner."""
SOURCES = {"force": "elastic", "weight": "loads", "heat": "thermal", "growth": "thermal"}
"""What happens, and the source that answers for it."""


def equipped(machine: Machine, random: np.random.Generator) -> Machine:
    """The machine with masses and expansions of all its parts, on a base that stands askew."""

    def point() -> tuple[float, float, float]:
        x, y, z = 0.3 * machine.characteristic_length * random.uniform(-1.0, 1.0, 3)
        return (x, y, z)

    struts = [
        dataclasses.replace(
            strut,
            mass=random.uniform(0.5, 3.0),
            centre_of_mass=random.uniform(0.2, 0.8),
            expansion=random.uniform(5e-6, 2e-5),
        )
        for strut in machine.struts
    ]
    drives = [
        dataclasses.replace(
            drive,
            mass=random.uniform(1.0, 5.0),
            # A file gives a telescopic strut one of the two expansions; here both add up.
            expansion=random.uniform(5e-6, 2e-5),
            fixed_at=random.uniform(*drive.travel),
            carriage=None
            if drive.carriage is None
            else dataclasses.replace(drive.carriage, expansion=random.uniform(5e-6, 2e-5)),
        )
        for drive in machine.drives
    ]
    return dataclasses.replace(
        machine,
        struts=tuple(struts),
        drives=tuple(drives),
        platform=dataclasses.replace(
            machine.platform, mass=12.0, centre_of_mass=point(), expansion=2.3e-5, anchor=point()
        ),
        frame=dataclasses.replace(machine.frame, expansion=1.1e-5, anchor=point()),
        tool=dataclasses.replace(machine.tool, expansion=6e-6, anchor=point()),
        mounting=tuple(random.uniform(-0.5, 0.5, 3)),
    )


def softened(machine: Machine, random: np.random.Generator) -> Machine:
    """The machine with drives, passive joints and base joints that give way like its struts."""

    def stiffness() -> float:
        return float(random.uniform(2e7, 2e8))  # N/m

    def soft(joint: Joint) -> Joint:
        return dataclasses.replace(joint, stiffness=stiffness())

    struts = [
        dataclasses.replace(
            strut,
            base_joint=soft(strut.base_joint),
            platform_joint=soft(strut.platform_joint),
            base_stiffness=(stiffness(), stiffness(), stiffness()),
        )
        for strut in machine.struts
    ]
    drives = [
        # Of a crank in N m/rad: as stiff as the rest at an arm of 0.2 m.
        dataclasses.replace(
            drive, stiffness=stiffness() * (0.04 if drive.coordinate == "angle" else 1.0)
        )
        for drive in machine.drives
    ]
    return dataclasses.replace(machine, struts=tuple(struts), drives=tuple(drives))


def conditions(machine: Machine, random: np.random.Generator) -> dict[str, Condition]:
    """What happens, one after the other."""
    still, length = Condition(), machine.characteristic_length
    warm = {
        part: still.reference_temperature + random.uniform(-10.0, 30.0)
        for part in machine.parts
        if not part.startswith("guide")
    }
    struts = [strut.part for strut in machine.struts]
    return {
        "force": still.replace(
            force=tuple(random.uniform(-500.0, 500.0, 3)),
            moment=tuple(length * random.uniform(-500.0, 500.0, 3)),
        ),
        "weight": still.replace(acceleration=tuple(random.uniform(-5.0, 5.0, 3))),
        "heat": still.replace(
            temperature={part: warm[part] for part in struts},
            gradient={part: (random.uniform(-20.0, 20.0), 0.0, 0.0) for part in struts},
        ),
        "growth": still.replace(temperature=warm),
    }


def by_calculix(
    under_test: MachineUnderTest,
    machine: Machine,
    happening: Mapping[str, Condition],
    folder: Path,
) -> dict[str, Vector]:
    """(n_pose, n_component) displacement of the tool point and turn, m and rad, by the case."""
    still = Condition()
    down = rotation_of(machine.mounting).T @ [0.0, 0.0, -still.gravity]
    deck = calculix.Deck(gravity=down, reference=still.reference_temperature)
    trusses = {
        name: [
            Truss(deck, machine, under_test, pose, condition, weight=down * (name == "weight"))
            for pose in POSES
        ]
        for name, condition in happening.items()
    }
    found = deck.run(folder)
    kept = [COMPONENTS.index(name) for name in machine.components]
    return {
        name: np.array([np.r_[found[truss.tool], found[truss.turn]][kept] for truss in row])
        for name, row in trusses.items()
    }


def by_truepose(
    under_test: MachineUnderTest, machine: Machine, condition: Condition, name: str
) -> Vector:
    """(n_pose, n_component) sensitivity . deviation of the source `name`."""
    (source,) = (one for one in cast("tuple[Source, ...]", machine.sources) if one.name == name)
    (block,) = PoseRun(machine, under_test.poses[POSES], condition)
    assert len(block.indices) == len(POSES)
    deviation = source.deviation(machine, condition, block)
    assert not deviation.half.any()
    sensitivity, status = machine.kernel.sensitivity_at(
        block.joints, block.placements, deviation.parameters
    )
    assert (status == OK).all()
    shift = np.broadcast_to(deviation.shift, sensitivity.shape[::2])
    return np.asarray(np.einsum("nck,nk->nc", sensitivity, shift))


@dataclasses.dataclass(frozen=True)
class Both:
    """A machine's displacements, (n_pose, n_component) by the case, on the two roads."""

    calculix: dict[str, Vector]
    truepose: dict[str, Vector]
    unit: Vector
    """(n_component,) how many metres a metre or a radian counts."""

    def sizes(self, displacements: Vector) -> Vector:
        """(n_pose,) m."""
        return np.asarray(np.linalg.norm(displacements * self.unit, axis=1))


def compared(
    under_test: MachineUnderTest, machine: Machine, random: np.random.Generator, folder: Path
) -> Both:
    """All that happens, on both roads."""
    happening = conditions(machine, random)
    found = by_calculix(under_test, machine, happening, folder)
    expected = {
        name: by_truepose(under_test, machine, condition, SOURCES[name])
        for name, condition in happening.items()
    }
    turn = machine.characteristic_length
    unit_of = [1.0 if name in "xyz" else turn for name in machine.components]
    return Both(found, expected, np.array(unit_of))


SOME = {"planar_two_slider", "rotary_delta", "tricept", "hexapod_all_sources", "overconstrained"}
"""In the quick suite: machines of every kind of drive, guides, and more closures than freedoms."""


def variants() -> Iterator[tuple[MachineUnderTest, bool]]:
    """Every machine shipped, and whether more of it gives way than its file says.

    Where there are more closures than freedoms, the kernel shares loads by the file's compliances:
    there nothing else is made to give way.
    """
    for path in machine_files():
        under_test = MachineUnderTest(path)
        yield under_test, False
        if not under_test.reference.overconstrained:
            yield under_test, True


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(
            each,
            id=f"{each[0].path.stem}{'-softened' * each[1]}",
            # A softened machine gives way as the filed one does, and more.
            marks=()
            if each[0].path.stem in SOME and (each[1] or each[0].reference.overconstrained)
            else sweep,
        )
        for each in variants()
    ],
)
def both(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Both:
    calculix.required()
    under_test, soft = request.param
    random = np.random.default_rng(under_test.seed + 11)
    # Limbs that bend are in test_calculix_limbs.py.
    machine = equipped(truepose.load(rigidly_guided(under_test.path)), random)
    if soft:
        machine = softened(machine, random)
    return compared(under_test, machine, random, tmp_path_factory.mktemp(under_test.path.stem))


@pytest.mark.parametrize("case", SOURCES)
def test_displacement_agrees(both: Both, case: str) -> None:
    found, expected = both.calculix[case], both.truepose[case]
    assert (both.sizes(expected) > 0.0).all()
    assert (both.sizes(found - expected) <= AGREES * both.sizes(expected)).all()


@pytest.mark.parametrize(
    ("ci", "outcome"), [("", pytest.skip.Exception), ("1", pytest.fail.Exception)]
)
def test_without_the_program(
    monkeypatch: pytest.MonkeyPatch, ci: str, outcome: type[BaseException]
) -> None:
    monkeypatch.setattr(calculix, "CCX", "nowhere/ccx")
    monkeypatch.setenv("TRUEPOSE_CI", ci)
    with pytest.raises(outcome, match="apt-get install calculix-ccx"):
        calculix.required()
