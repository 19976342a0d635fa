"""A variant that loses poses is infeasible: no machine gets better by what it cannot reach."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES, PLANAR
from truepose.studies.ranking import ranked

DELTA = MACHINES / "rotary_delta.toml"
SHORT = "strut.*.length=380 mm"


def test_shrinking_rods_never_improve_a_machine() -> None:
    """With shorter arms it loses poses, and at those that are left its error is smaller."""
    lengths = [f"{length} mm" for length in range(224, 321, 16)]
    study = tp.study(DELTA, {"strut.*.length": ",".join(lengths)}, quantities=["error", "verdict"])
    status = study["status"].values.tolist()
    first = status.index("ok")
    assert status == ["infeasible"] * first + ["ok"] * (len(lengths) - first)
    assert 0 < first < len(lengths) - 1
    # What is left alone would have been an improvement.
    alone = []
    for length in lengths[:first]:
        budget = tp.budget(tp.load(DELTA, [f"strut.*.length={length}"]))
        assert budget.sizes["pose"] < 100
        alone.append(float(budget["linear_maximum"].sel(quantity="position").max()))
    fine = study["linear_maximum"].sel(quantity="position").values[first:]
    assert min(alone) < fine.min()
    for name in ("known", "linear_maximum", "witness", "linear", "bound"):
        assert np.isnan(study[name].values[:first]).all(), name
    assert int(ranked(study)[0]) >= first
    assert float(study["linear_maximum"].sel(quantity="position").min()) == fine.min()


def test_what_is_lost_is_told() -> None:
    study = tp.study(PLANAR, [SHORT, "condition.temperature=20,35 degC"]).isel(variant=0)
    machine = tp.load(PLANAR)
    _, status = tp.load(PLANAR, [SHORT]).inverse(machine.poses(), status=True)
    lost = np.flatnonzero(status)
    assert study["poses_lost"] == lost.size
    assert lost.size > 0
    assert study["reach"] == pytest.approx(1.0 - lost.size / 25)
    assert study["first_lost"] == lost[0]
    pose = machine.poses()[lost[0]] * 1000.0
    reason = str(study["reason"].values)
    assert reason.startswith(
        f"{lost.size} of 25 poses lost, the first x = {pose[0]:.6g} mm, y = {pose[1]:.6g} mm: "
    )
    assert "strut" in reason or "travel" in reason


@pytest.mark.parametrize(("reach", "status"), [(1.0, "infeasible"), (0.5, "ok")])
def test_a_reach_that_is_enough(reach: float, status: str) -> None:
    study = tp.study(PLANAR, [SHORT], reach=reach)
    assert study["status"].values.tolist() == [status]
    assert 0.5 < study["reach"].item() < 1.0
    if status == "ok":
        budget = tp.budget(tp.load(PLANAR, [SHORT]))
        assert study["linear_maximum"].item() == float(budget["linear_maximum"].max())
        assert study["poses_lost"].item() == 25 - budget.sizes["pose"]


def test_all_poses_may_be_lost() -> None:
    study = tp.study(PLANAR, ["strut.*.length=100,520 mm"])
    assert study["status"].values.tolist() == ["infeasible", "ok"]
    assert study["reach"].values.tolist() == [0.0, 1.0]
    assert study["poses_lost"].values.tolist() == [25, 0]


def test_poses_that_the_base_has_not_are_asked_of_no_variant() -> None:
    short = ["strut.*.length=380 mm"]
    base = tp.budget(tp.load(PLANAR, short))
    asked = tp.load(PLANAR).poses()
    assert 0 < base.sizes["left_out"] < len(asked)
    study = tp.study(PLANAR, ["strut.*.length=420,450,350 mm"], settings=short)
    assert study["status"].values.tolist() == ["ok", "ok", "infeasible"]
    for variant, length in enumerate(("420 mm", "450 mm")):
        there = tp.load(PLANAR, [f"strut.*.length={length}"])
        assert tp.budget(there).sizes["pose"] == len(asked), "it has more poses than the base"
        linear = tp.budget(there, asked[base["pose"].values])["linear_maximum"].max().item()
        assert study["linear_maximum"].values[variant, 0] == linear
    assert study["first_lost"].values[2] in base["pose"].values


def test_a_pose_that_some_machines_inside_the_bands_lose_is_lost() -> None:
    """Bands so wide that some machines reach a pose no more: the verdict is NOT met there."""
    bands = "strut.*.length_tolerance=[-0.1,0.1],[-150,150]"
    study = tp.study(PLANAR, [bands], settings=["strut.*.length=450 mm"])
    assert study["status"].values.tolist() == ["ok", "infeasible"]
    assert "some machines inside the bands cannot be assembled" in str(study["reason"].values[1])


def test_failed_variants_stay_with_their_reason() -> None:
    study = tp.study(PLANAR, ["drive.d1.travel=[0,900],[900,0],[0,950]"])
    assert study["status"].values.tolist() == ["ok", "failed", "ok"]
    assert study["code"].values.tolist() == ["", "travel-reversed", ""]
    assert "travel" in str(study["reason"].values[1])
    assert np.isnan(study["linear_maximum"].values[1]).all()
    assert study["done"].all()


def test_a_variant_that_nothing_acts_on_fails_so(tmp_path: Path) -> None:
    text = "".join(
        line
        for line in PLANAR.read_text().splitlines(keepends=True)
        if not line.startswith(("length_tolerance", "force", "temperature = 35"))
    )
    machine = tmp_path / "m.toml"
    machine.write_text(text)
    # What acts on no machine of the base may act on a variant.
    pulled = tp.study(machine, ["condition.force={},{x='100 N'}"])
    assert pulled["status"].values.tolist() == ["ok", "ok"]
    assert pulled["known"].values[:, 0].tolist()[0] == 0.0 < pulled["known"].values[1, 0]
    still = tp.study(machine, ["strut.*.length=500,380 mm"])
    assert still["status"].values.tolist() == ["failed", "infeasible"]
    assert still["code"].values.tolist() == ["no-source", ""]
    assert still["reach"].values.tolist()[0] == 1.0


def test_a_base_without_poses_is_no_base() -> None:
    with pytest.raises(tp.errors.RequestError, match="no-pose-left"):
        tp.study(PLANAR, ["condition.temperature=20,30 degC"], settings=["strut.*.length=100"])


@pytest.mark.parametrize("reach", [0.0, -1.0, 1.5, float("nan"), 98.0])
def test_what_is_no_reach(reach: float) -> None:
    with pytest.raises(tp.errors.RequestError, match="bad-reach"):
        tp.study(PLANAR, ["condition.temperature=20,30 degC"], reach=reach)


@pytest.mark.parametrize("quantities", [[], ["eror"], ["error", "nothing"]])
def test_what_is_no_quantity(quantities: list[str]) -> None:
    with pytest.raises(tp.errors.RequestError, match="unknown-choice"):
        tp.study(PLANAR, ["condition.temperature=20,30 degC"], quantities=quantities)


def test_only_what_is_chosen_is_computed() -> None:
    study = tp.study(PLANAR, ["condition.temperature=20,30 degC"], quantities=["shares"])
    assert {"share", "highest"} < set(study.data_vars)
    assert not {"known", "answer", "coverage_95"} & set(study.data_vars)
    assert "state" not in study.dims
