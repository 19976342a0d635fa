"""`[[limb]]` and the chains of drives: what is read, and what is refused, with code and place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from truepose.errors import MachineFileError

PRS = (MACHINES / "3prs.toml").read_text()
TRICEPT = (MACHINES / "tricept.toml").read_text()
ROTARY = (MACHINES / "rotary_delta.toml").read_text()

REVOLUTE = 'joint = "revolute", radial = "300 N/um", axial = "300 N/um", tilt = "1e6 N m/rad"'
TUBE = 'beam = "tube", outside = 50, wall = 6, material = "steel"'
AXIS = "axis = [-1, 0, 0] # of its revolute joint"
PLANE = "normal = [-1, 0, 0]\nplatform = [0, 250, 0]"
EACH_STRUT = "length = 500\n"
WARM = 'temperature = { default = 24, "strut.1" = 28 }'


def written(folder: Path, text: str) -> Path:
    path = folder / "machine.toml"
    path.write_text(text)
    return path


def changed(text: str, found: str, put: str) -> str:
    assert found in text
    return text.replace(found, put, 1)


@pytest.mark.parametrize(
    ("found", "put", "code", "says"),
    [
        (AXIS, "axis = [-1, 0.2, 0]", "open-chain", "turning about the revolute"),
        (PLANE, PLANE.replace("250", "240"), "open-chain", "closure guide g1"),
        ('guides = ["g1"]', "guides = []", "open-chain", "its closures hold 1: 1 too few"),
        ('guides = ["g2"]', 'guides = ["g1"]', "duplicate-name", "guide g1 belongs to two limbs"),
        ('guides = ["g1"]', 'guides = ["g7"]', "unknown-part", 'there is no guide "g7"'),
        ('strut = "1"', 'strut = "7"', "unknown-part", 'there is no strut "7"'),
        (REVOLUTE, REVOLUTE.replace("revolute", "universal"), "open-chain", "of the family PUS"),
        (REVOLUTE, REVOLUTE.replace("revolute", "spherical").split(", tilt")[0],
         "unsupported-chain", "limbs of the family PSS"),
        (REVOLUTE, REVOLUTE.replace("revolute", "revolut"), "unknown-choice", "revolut"),
        (REVOLUTE, REVOLUTE + ", wall = 3", "unknown-key", "a revolute joint has no wall"),
        (REVOLUTE, REVOLUTE.split(", axial")[0], "missing-key", "without axial, tilt"),
        (REVOLUTE, 'stiffness = "rigid"', "missing-key", "a part of a limb is a joint or a beam"),
        (REVOLUTE, REVOLUTE + ', beam = "tube"', "excluding-keys", "is a joint or a beam"),
        (TUBE, 'beam = "section", area = "829 mm^2", material = "steel"', "missing-key",
         "a section beam without moments, torsion, shear_coefficient"),
        (TUBE, TUBE + ", length = 0", "not-positive", "a length above zero"),
        (TUBE, TUBE + ", length = 400", "zero-length", "500 mm, the strut's length"),
        (TUBE, TUBE + ", length = 500 },\n  { " + TUBE, "zero-length", "something left"),
        (TUBE, TUBE + " },\n  { " + TUBE, "zero-length", "2 beams without a length"),
        (TUBE, TUBE.replace("wall = 6", "wall = 25"), "empty-section", "the wall of a tube"),
        (TUBE, TUBE.replace(', material = "steel"', ""), "missing-key", "no modulus, poisson"),
        (TUBE, TUBE.replace("steel", "carbon fibre"), "missing-key", "no poisson"),
        (TUBE, TUBE + ', stiffness = "rigid"', "unknown-key", "a tube beam has no stiffness"),
        ("radial = \"300 N/um\", axial = \"300 N/um\" },\n]",
         "radial = \"-300 N/um\", axial = \"300 N/um\" },\n]", "not-positive", "-300 N/um"),
        (EACH_STRUT, EACH_STRUT + 'section_area = "829 mm^2"\n', "excluding-keys",
         "leave section_area of strut 1 away"),
        (EACH_STRUT, EACH_STRUT + 'stiffness = "80 N/um"\n', "excluding-keys", "leave stiffness"),
        (EACH_STRUT, EACH_STRUT + 'base_stiffness = "80 N/um"\n', "excluding-keys",
         "leave base_stiffness"),
        ('base_joint = { kind = "revolute" }',
         'base_joint = { kind = "revolute", stiffness = "80 N/um" }', "excluding-keys",
         "leave base_joint.stiffness"),
        (AXIS, "", "missing-key", "nothing says how the limb is turned"),
        ('"drive.*.offset" = 0.01', '"guide.g1.offset" = 0.01', "tolerance-of-offset",
         "is what a limb gives way by"),
        (WARM, 'temperature = { default = 24, "limb.1" = 28 }', "unknown-part", "limb.1"),
        (WARM, 'gradient = { "limb.1" = "3 K/m" }', "wrong-type", "along each of its axes"),
        (WARM, 'gradient = { "limb.1" = ["3 K/m", "0 K/m", "0 K/m"] }', "bad-condition",
         "0 along it"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_limb(
    found: str, put: str, code: str, says: str, tmp_path: Path
) -> None:
    path = written(tmp_path, changed(PRS, found, put))
    with pytest.raises(tp.errors.TrueposeError) as caught:
        tp.load(path)
    told = {problem.code for problem in caught.value.problems}
    assert told == {code}
    assert says in str(caught.value)
    if code != "bad-condition":
        assert all(problem.line for problem in caught.value.problems)


@pytest.mark.parametrize(
    ("found", "put", "code", "says"),
    [
        ('guides = ["tube", "joint"]', 'guides = ["tube"]', "open-chain", "its closures hold 2"),
        ("wall = 12", "wall = 12, length = 900", "zero-length", "one beam without a length"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_tube(
    found: str, put: str, code: str, says: str, tmp_path: Path
) -> None:
    with pytest.raises(MachineFileError) as caught:
        tp.load(written(tmp_path, changed(TRICEPT, found, put)))
    assert {problem.code for problem in caught.value.problems} == {code}
    assert says in str(caught.value)


PRISMATIC = '{ joint = "prismatic", across = "20 N/um", tilt = "2e3 N m/rad" }'
BEARING = '{ joint = "revolute", radial = "20 N/um", axial = "20 N/um", tilt = "2e3 N m/rad" }'
ROUND = '{ beam = "tube", outside = 18, wall = 2, material = "aluminium" }'
LONG = ROUND.replace("wall", "length = 900, wall")
DRIVES = "[each.drive] # what every drive has\n"


@pytest.mark.parametrize(
    ("name", "parts", "code", "says"),
    [
        ("tricept", [PRISMATIC], "unsupported-chain", "telescopic"),
        ("linear_delta", [BEARING], "unsupported-chain", "found:    revolute"),
        ("linear_delta", [PRISMATIC, ROUND], "unsupported-chain", "prismatic, beam"),
        ("rotary_delta", [ROUND], "unsupported-chain", "then the beams of the arm"),
        ("rotary_delta", [ROUND, BEARING], "unsupported-chain", "beam, revolute"),
        ("rotary_delta", [PRISMATIC, ROUND], "unsupported-chain", "prismatic, beam"),
        ("rotary_delta", [BEARING, ROUND, ROUND], "zero-length", "2 without a length"),
        ("rotary_delta", [BEARING, LONG], "zero-length", "beams of 900 mm"),
        ("rotary_delta", [BEARING, LONG, ROUND], "zero-length", "beams of 900 mm"),
        ("3prs", [PRISMATIC], "excluding-keys", "a chain of the drive, and limb 1"),
        ("linear_delta", [], "wrong-type", "1 or more"),
    ],
)
def test_what_is_wrong_with_the_chain_of_a_drive(
    name: str, parts: list[str], code: str, says: str, tmp_path: Path
) -> None:
    text = (MACHINES / f"{name}.toml").read_text()
    chain = f"chain = [{', '.join(parts)}]\n"
    with pytest.raises(MachineFileError) as caught:
        tp.load(written(tmp_path, changed(text, DRIVES, DRIVES + chain)))
    assert {problem.code for problem in caught.value.problems} == {code}
    assert says in str(caught.value)
    assert all(problem.line for problem in caught.value.problems)


def test_chains_are_refused_where_closures_are_more_than_freedoms(tmp_path: Path) -> None:
    text = (MACHINES / "overconstrained.toml").read_text()
    path = written(tmp_path, changed(text, "[[drive]]\n", f"[[drive]]\nchain = [{PRISMATIC}]\n"))
    with pytest.raises(MachineFileError, match="more closures than freedoms") as caught:
        tp.load(path)
    assert {problem.code for problem in caught.value.problems} == {"unsupported-chain"}


def test_offsets_are_neither_toleranced_nor_identified(tmp_path: Path) -> None:
    text = changed(TRICEPT, '"guide.joint.*.*" = 0.003', '"guide.joint.*" = 0.003')
    machine = tp.load(written(tmp_path, text))
    assert "guide.joint.offset" in machine.parameters
    assert "guide.tube.offset.2" in machine.parameters
    (tolerance,) = (source for source in machine.sources if source.name == "tolerance")
    block = next(iter(tp.runs.poses.PoseRun(machine, machine.poses()[:1], machine.condition)))
    deviation = tolerance.deviation(machine, machine.condition, block)  # type: ignore[attr-defined]
    names = {machine.parameters[column] for column in deviation.parameters}
    assert "guide.joint.platform_axis.u" in names
    assert not any("offset." in name or name.endswith("joint.offset") for name in names)


def test_machines_without_limbs_have_no_offsets() -> None:
    for name in ("hexapod", "linear_delta", "planar_two_slider", "overconstrained"):
        machine = tp.load(MACHINES / f"{name}.toml")
        assert machine.limbs == ()
        assert not machine.kernel.limb_pairs
        assert not any(".carriage." in name or "guide" in name for name in machine.parameters)


def test_rigid_limbs_bend_nothing(tmp_path: Path) -> None:
    """Whatever all of a limb's parts call rigid; what is left is the drives' own."""
    rigid = """chain = [
  { joint = "prismatic", stiffness = "rigid" },
  { joint = "revolute", stiffness = "rigid" },
  { beam = "rigid" },
  { joint = "spherical", stiffness = "rigid" },
]"""
    start, end = PRS.index("chain = ["), PRS.index("]\n\n[[limb]]")
    text = PRS[:start] + rigid + PRS[end + 1 :]
    machine = tp.load(written(tmp_path, text))
    poses = machine.poses()[::25]
    assert np.abs(machine.compliance(poses)).max() == 0.0
    drives = changed(
        text, "[each.drive] # what every drive has", '[each.drive]\nstiffness = "50 N/um"'
    )
    compliance = tp.load(written(tmp_path, drives)).compliance(poses)
    assert (np.linalg.eigvalsh(compliance)[:, :3] < 1e-12 * np.abs(compliance).max()).all()


def test_a_guide_in_a_limb_is_not_taken_as_rigid() -> None:
    machine = tp.load(MACHINES / "3prs.toml")
    warnings = tp.budget(machine, machine.poses()[:3]).attrs.get("warnings", "")
    assert "guide-taken-rigid" not in str(warnings)


def test_a_limb_that_is_warmer_on_one_side_says_how_its_beams_expand(tmp_path: Path) -> None:
    silent = changed(
        PRS, TUBE, TUBE.replace('material = "steel"', 'modulus = "210 GPa", poisson = 0.3')
    )
    machine = tp.load(written(tmp_path, silent))
    warm = machine.condition.replace(gradient={"limb.1": (0.0, 3.0, 0.0)})
    with pytest.raises(tp.errors.TrueposeError, match="nothing says how much its beams expand"):
        tp.budget(machine, machine.poses()[:1], warm)
    text = changed(silent, WARM, WARM + '\ngradient = { "limb.1" = ["0 K/m", "3 K/m", "0 K/m"] }')
    with pytest.raises(MachineFileError) as caught:
        tp.load(written(tmp_path, text))
    (problem,) = caught.value.problems
    assert problem.code == "no-expansion"
    assert problem.line
