"""A witness as a machine file: its budget at the one pose is the witness."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from build_machine import machine_files
from machine_texts import PLANAR, edited, load_text
from random_machines import DRAWN, DrawnMachine
from sweeps import thinned
from truepose._kernel import STATUS
from truepose.budget.exact import displacement
from truepose.budget.poses import OK, Walk
from truepose.budget.spread import spread
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.sources import acting
from truepose.verdict.witness import AFTER, BEFORE, Witness
from truepose.verdict.witness_file import write_witness

N_POSE = 3
QUICK = {"planar_two_slider", "hexapod_all_sources", "3prs"}


def witnesses(
    machine: Machine, poses: np.ndarray, random: np.random.Generator, scale: float = 1.0
) -> list[Witness]:
    """In both states at each pose a corner and a point inside the domain, by the exact error."""
    found = []
    condition = machine.condition
    sources = acting(machine, condition)
    (block,) = Walk(machine, poses, condition)
    moves = spread(machine, block, sources)
    corrected, _, status = machine.kernel.corrected(poses[block.indices], *moves.shift)
    assert (status == OK).all()
    after = dataclasses.replace(block, joints=corrected)
    for state, each in ((BEFORE, block), (AFTER, after)):
        unknown = spread(machine, each, sources)
        for pose in range(block.indices.size):
            of_pose = unknown.at(pose)
            domain = of_pose.domain
            corner = domain.most_along(random.normal(size=domain.lower.size))
            inside = random.uniform(domain.lower, domain.upper)
            for members in domain.directions:
                inside[members] *= 0.5
            for t in (corner, inside):
                t = t * scale
                error, status = displacement(
                    machine,
                    each.joints[[pose]],
                    block.placements[[pose]],
                    of_pose.parameters_moved(t[np.newaxis]),
                )
                name = STATUS[status[0]]
                for quantity in ("position", "orientation"):
                    at = [c in "xyz" for c in machine.components]
                    if quantity == "orientation":
                        at = [not c for c in at]
                    if not any(at):
                        continue
                    fine = name == "ok"
                    found.append(
                        Witness(
                            state=state,
                            quantity=quantity,
                            machine=machine,
                            pose=poses[block.indices[pose]],
                            number=int(block.indices[pose]),
                            joints=each.joints[pose],
                            spread=of_pose,
                            t=t,
                            error=error[0] if fine else None,
                            size=float(np.linalg.norm(error[0][at])) if fine else np.inf,
                            status=name,
                        )
                    )
    return found


def assert_same(machine: Machine, witness: Witness, path: Path, original: Path) -> Machine:
    """Write it, read it back by the public door, and let the budget say its size."""
    write_witness(machine, witness, path, original=original)
    written = tp.load(path)
    if witness.status != "ok":
        with pytest.raises(RequestError) as refused:
            tp.budget(written)
        (problem,) = refused.value.problems
        assert problem.code == "no-pose-left"
        assert witness.status.replace("_", " ") in (problem.found or "")
        return written
    budget = tp.budget(written)
    assert np.allclose(budget.x if False else written.poses()[0], witness.pose, rtol=0, atol=1e-15)
    names = list("xyz") if witness.quantity == "position" else ["rx", "ry", "rz"]
    kept = [name for name in names if name in written.components]
    error = budget.overall_error.sel(component=kept).values[0]
    assert np.linalg.norm(error) == pytest.approx(witness.size, rel=1e-9)
    # One machine: nothing of it is unknown.
    assert not budget.reach.values.any()
    return written


def some(machine: Machine, random: np.random.Generator) -> np.ndarray:
    poses = machine.poses()
    return poses[random.choice(len(poses), min(N_POSE, len(poses)), replace=False)]


@pytest.mark.parametrize(
    "original",
    [
        pytest.param(p, marks=[] if p.stem in QUICK else [pytest.mark.sweep])
        for p in machine_files()
    ],
    ids=lambda path: path.stem,
)
def test_the_file_of_a_machine_shipped_is_its_witness(original: Path, tmp_path: Path) -> None:
    machine, random = tp.load(original), np.random.default_rng(3)
    for witness in witnesses(machine, some(machine, random), random):
        assert_same(machine, witness, tmp_path / "witness.toml", original)


@pytest.mark.parametrize("drawn", thinned(DRAWN), ids=lambda each: each.name)
def test_the_file_of_a_machine_drawn_is_its_witness(drawn: DrawnMachine, tmp_path: Path) -> None:
    machine, random = tp.load(drawn.path), np.random.default_rng(drawn.number)
    for witness in witnesses(machine, some(machine, random)[:2], random):
        assert_same(machine, witness, tmp_path / "witness.toml", drawn.path)
