"""Whether a design is proven all over the box: what the proof gives, refuses and cannot say."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES, call
from designs import file_with, unseen
from sweeps import thinned
from truepose.design.region_proof import RegionProof, prove_region
from truepose.errors import RequestError
from truepose.machine import Machine

Capture = pytest.CaptureFixture[str]

SMALL = {"planar_two_slider", "five_bar", "3rrr"}

WITHOUT_WITNESS = {
    "3prs", "3rps", "hexapod_all_sources", "overconstrained", "tricept", "walking_6psu"
}  # fmt: skip
"""Machines with a source, closures or bands so wide that nothing is enclosed."""


@pytest.mark.parametrize(
    "kind", thinned(["planar_two_slider", "five_bar", "3rrr"], quick={"planar_two_slider"})
)
def test_a_design_is_proven_all_over_the_box(kind: str, tmp_path: Path) -> None:
    found = tp.allocate(tp.load(file_with(tmp_path, kind)), region=True)
    assert found.proven == "region"
    assert found.region_proof is not None
    for quantity, target in found.targets.items():
        reached = max(one.error for one in found.worst_poses if one.quantity == quantity)
        assert reached * (1.0 - 1e-9) <= found.region_proof.bound[quantity] <= target
    poses = unseen(found.designed, 2_000)
    largest = tp.budget(found.designed, poses)["linear_maximum"].max("pose")
    for quantity, bound in found.region_proof.bound.items():
        assert float(largest.sel(quantity=quantity)) <= bound * (1.0 + 1e-3)


def reached_over(machine: Machine) -> dict[str, float]:
    """The largest sizes at the poses of the workspace, m and rad."""
    largest = tp.budget(machine, summary=True)["highest_linear_maximum"]
    return {str(name): float(largest.sel(quantity=name)) for name in largest["quantity"].values}


@pytest.mark.parametrize(
    "kind",
    thinned(["planar_two_slider", "five_bar", "3rrr", "hexapod"], quick=SMALL),
)
def test_a_little_more_than_what_is_reached_is_proven(kind: str) -> None:
    machine = tp.load(MACHINES / f"{kind}.toml")
    targets = {name: 1.05 * size for name, size in reached_over(machine).items()}
    proof = prove_region(machine, {"condition": machine.condition}, targets, targets)
    assert proof.kept
    assert proof.witness is None
    for name, target in targets.items():
        assert target / 1.05 <= proof.bound[name] <= target


@pytest.mark.parametrize(
    "kind",
    thinned(sorted(path.stem for path in MACHINES.glob("*.toml")), quick={*SMALL, "hexapod"}),
)
def test_less_than_what_is_reached_is_refused(kind: str) -> None:
    """And where a pose is told, a machine of the bands is above the target there."""
    machine = tp.load(MACHINES / f"{kind}.toml")
    sizes = reached_over(machine)
    for share in (0.9, 0.97, 0.995):
        targets = {name: share * size for name, size in sizes.items()}
        # As if the search had found less: the proof alone has to refuse it.
        thought = {name: target / 1.05 for name, target in targets.items()}
        proof = prove_region(machine, {"condition": machine.condition}, targets, thought)
        assert not proof.kept
        assert proof.why
        met = proof.witness
        assert (met is None) is (kind in WITHOUT_WITNESS), proof.why
        if met is not None:
            assert met.error > targets[met.quantity]
            assert met.in_words(machine) == proof.why
            proven = tp.bounds(machine, [met.pose])["magnitude"].sel(quantity=met.quantity)
            assert met.error <= float(proven[0])
            drawn = tp.monte_carlo(machine, [met.pose], samples=2000, seed=1)["magnitude_maximum"]
            assert met.error > 0.8 * float(drawn.sel(quantity=met.quantity)[0])


def test_listed_poses_are_no_region(tmp_path: Path, capsys: Capture) -> None:
    path = file_with(tmp_path, "planar_two_slider")
    listed = "poses = [[300, 200], [320, 180]]"
    path.write_text(re.sub(r"grid = .*", listed, path.read_text(), count=1))
    found = tp.allocate(tp.load(path), region=True)
    assert found.proven == "these poses"
    assert found.region_proof is not None
    assert found.region_proof.why == "the workspace lists poses, and has no box"
    done = call(capsys, "allocate", path, "--region")
    assert "All over the box nothing is proven: the workspace lists poses" in done.out
    assert np.isinf(found.region_proof.bound["position"])


def test_a_design_that_is_refuted_somewhere_is_told_so(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if the targets were a little below what the search found."""
    path = file_with(tmp_path, "planar_two_slider")

    def below(
        machine: Machine, conditions: Any, _: Any, largest: dict[str, float], *rest: Any
    ) -> RegionProof:
        targets = {kind: 0.97 * size for kind, size in largest.items()}
        return prove_region(machine, conditions, targets, targets, *rest)

    monkeypatch.setattr("truepose.design.one_allocation.prove_region", below)
    found = tp.allocate(tp.load(path), region=True)
    assert found.proven == "none"
    assert found.region_proof is not None
    witness = found.region_proof.witness
    assert witness is not None
    largest = tp.budget(found.designed, np.array([witness.pose]))["linear_maximum"]
    assert witness.error == pytest.approx(float(largest[0].sel(quantity="position")), rel=1e-2)
    done = call(capsys, "allocate", path, "--region")
    assert (
        "NOT kept all over the box: in condition a machine inside its bands has a position"
        in done.out
    )
    assert done.code == 1
    assert "was to be within" in done.out
    assert "is within" not in done.out
    assert "Proven at" not in done.out


def test_only_the_worst_case_before_compensation(tmp_path: Path) -> None:
    machine = tp.load(file_with(tmp_path, "planar_two_slider"))
    for options in ({"state": "after compensation"}, {"statistical": 0.95}):
        with pytest.raises(RequestError) as caught:
            tp.allocate(machine, region=True, **options)
        assert caught.value.problems[0].code == "bad-allocation"
