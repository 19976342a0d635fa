"""Whether a design is proven all over the box: what the proof gives, refuses and cannot say."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import call
from designs import file_with, unseen
from sweeps import long_member, thinned
from truepose.design.region_proof import prove_region
from truepose.errors import RequestError

Capture = pytest.CaptureFixture[str]


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


@pytest.mark.parametrize("kind", [*thinned(["planar_two_slider", "five_bar"]), long_member("3rrr")])
def test_the_proof_refuses_what_is_reached_and_proves_a_little_more(kind: str) -> None:
    machine = tp.load(Path("machines") / f"{kind}.toml")
    assert machine.workspace is not None
    region = {
        name: (min(axis.start, axis.stop), max(axis.start, axis.stop))
        for name, axis in zip(machine.commanded, machine.workspace.axes, strict=True)
    }
    sizes = tp.bounds(machine, region=region, gap=0.02)["reached_magnitude"]
    reached = {str(name): float(sizes.sel(quantity=name)) for name in sizes["quantity"].values}
    for share, kept in ((0.9, False), (0.97, False), (0.995, False), (1.05, True)):
        targets = {name: share * size for name, size in reached.items()}
        # As if the search had found less: the proof alone has to refuse it.
        thought = {name: target / 1.05 for name, target in targets.items()}
        proof = prove_region(machine, {"condition": machine.condition}, targets, thought)
        assert proof.kept is kept
        assert bool(proof.why) is not kept


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


def test_only_the_worst_case_before_compensation(tmp_path: Path) -> None:
    machine = tp.load(file_with(tmp_path, "planar_two_slider"))
    for options in ({"state": "after compensation"}, {"statistical": 0.95}):
        with pytest.raises(RequestError) as caught:
            tp.allocate(machine, region=True, **options)
        assert caught.value.problems[0].code == "bad-allocation"
