"""`--minimise`: what the optimiser finds, what it may not do, and that it goes on where it was."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

import truepose as tp
from command_line import PLANAR, call
from sweeps import sweep
from truepose.cli import study as command
from truepose.studies.block import BlockTask
from truepose.studies.constraints import Constraints
from truepose.studies.minimise import Minimised
from truepose.studies.objectives import OBJECTIVES
from truepose.studies.optimiser import generation_of, search
from truepose.studies.ranking import objective_of, ranked

Capture = pytest.CaptureFixture[str]
RODS = {"strut.*.length": "360:620 mm"}
"""Short rods lose poses, and long ones let the carriages err more."""

KNOWN = {
    "count": 24,
    "seed": 3,
    "quantities": ["error"],
}


@pytest.fixture(scope="module")
def minimised() -> Any:
    return tp.study(PLANAR, RODS, minimise="error", **KNOWN)


@pytest.fixture(scope="module")
def scanned() -> Any:
    """Every other millimetre, without an optimiser."""
    return tp.study(PLANAR, {"strut.*.length": "360:620:131 mm"}, quantities=["error"])


def sizes_of(study: Any) -> Any:
    return study["linear_maximum"].values[:, 0]


def test_it_is_as_good_as_looking_everywhere(minimised: Any, scanned: Any) -> None:
    fine = scanned["status"].values == "ok"
    assert 0 < fine.sum() < fine.size
    least = sizes_of(scanned)[fine].min()
    found = sizes_of(minimised)[ranked(minimised)[0]]
    assert found <= 1.005 * least
    # The scan is fine enough: nothing between two of its values is much better.
    assert found >= 0.98 * least


def test_every_evaluation_is_kept_in_its_order(minimised: Any) -> None:
    assert minimised["done"].values.all()
    assert minimised.sizes["variant"] == KNOWN["count"]
    for number in (0, 11, 23):
        (text,) = minimised["setting"].values[number]
        assert float(text.split()[0]) == minimised["value"].values[number, 0]
        alone = tp.study(PLANAR, [f"strut.*.length={text}"], quantities=["error"])
        assert alone["status"].values[0] == minimised["status"].values[number]
        assert np.array_equal(
            alone["linear_maximum"].values[0],
            minimised["linear_maximum"].values[number],
            equal_nan=True,
        )


def test_rods_too_short_for_a_pose_are_never_the_best(minimised: Any, scanned: Any) -> None:
    lost = minimised["poses_lost"].values > 0
    assert lost.any()
    assert (minimised["status"].values[lost] == "infeasible").all()
    assert minimised["reach"].values[ranked(minimised)].min() == 1.0
    shortest = scanned["value"].values[scanned["status"].values == "ok", 0].min()
    assert minimised["value"].values[ranked(minimised), 0].min() >= shortest - 2.0


def test_with_conditioning_and_travel_asked_both_hold() -> None:
    plain = tp.study(PLANAR, {"strut.*.length": "450,500,560,600 mm"}, quantities=["kinematics"])
    fine = plain["status"].values == "ok"
    for number in np.flatnonzero(fine).tolist():
        (text,) = plain["setting"].values[number]
        machine = tp.load(PLANAR, settings=[f"strut.*.length={text}"])
        assert plain["conditioning"].values[number] == machine.conditioning(machine.poses()).min()
        spare = [
            min(q - drive.travel[0], drive.travel[1] - q) / (drive.travel[1] - drive.travel[0])
            for joints in machine.inverse(machine.poses())
            for q, drive in zip(joints, machine.drives, strict=True)
        ]
        assert plain["travel_left"].values[number] == pytest.approx(min(spare), rel=1e-12)
    conditioning, travel = (np.sort(plain[k].values[fine]) for k in ("conditioning", "travel_left"))
    asked = {
        "conditioning": float(conditioning[:2].mean()),
        "travel_left": float(travel[:2].mean()),
    }
    for one in ("conditioning", "travel_left"):
        study = tp.study(
            PLANAR,
            {"strut.*.length": "450,500,560,600 mm"},
            quantities=["error"],
            **{one: asked[one]},
        )
        refused = study["code"].values == one.replace("_", "-")
        assert refused.any()
        assert (study["status"].values[refused] == "infeasible").all()
        assert (study[one].values[refused] < asked[one]).all()
        assert (study[one].values[study["status"].values == "ok"] >= asked[one]).all()
        assert np.isnan(study["linear_maximum"].values[refused]).all()
    best = tp.study(PLANAR, RODS, minimise="error", **KNOWN, **asked)
    kept = ranked(best)
    assert (best["conditioning"].values[kept] >= asked["conditioning"]).all()
    assert (best["travel_left"].values[kept] >= asked["travel_left"]).all()


def test_interrupted_it_goes_on_where_it_was(tmp_path: Path, minimised: Any) -> None:
    def stopped(done: int, total: int) -> None:
        if done == 10:
            raise KeyboardInterrupt

    store = tmp_path / "search.zarr"
    first = tp.study(PLANAR, RODS, minimise="error", **KNOWN, output=store, progress=stopped)
    assert first.attrs["interrupted"] == 1
    assert 0 < first["done"].values.sum() < 24
    told: list[tuple[int, int]] = []
    second = tp.study(
        PLANAR,
        RODS,
        minimise="error",
        **KNOWN,
        output=store,
        progress=lambda *counts: told.append(counts),
    )
    left = 24 - int(first["done"].values.sum())
    assert told == [(number, left) for number in range(1, left + 1)]
    for name in ("setting", "value", "status", "known", "linear_maximum", "done"):
        assert np.array_equal(
            second[name].values.astype(str), minimised[name].values.astype(str)
        ), name


@sweep
def test_two_processes_give_the_same(minimised: Any) -> None:
    shared = tp.study(PLANAR, RODS, minimise="error", **KNOWN, workers=2)
    assert shared["setting"].values.tolist() == minimised["setting"].values.tolist()
    assert np.array_equal(sizes_of(shared), sizes_of(minimised), equal_nan=True)


def test_a_store_whose_settings_others_asked_for_is_refused(tmp_path: Path) -> None:
    import zarr

    store = tmp_path / "search.zarr"
    asked = {**KNOWN, "count": 16}
    tp.study(PLANAR, RODS, minimise="error", **asked, output=store)
    zarr.open_group(str(store), mode="r+")["setting"][5, 0] = "500.0 mm"
    with pytest.raises(tp.errors.RequestError, match="other-study") as raised:
        tp.study(PLANAR, RODS, minimise="error", **asked, output=store)
    assert "another variant 5" in str(raised.value)


@pytest.mark.parametrize("name", OBJECTIVES)
def test_each_objective_is_what_the_best_are_chosen_by(name: str) -> None:
    study = tp.study(
        PLANAR, {"strut.*.length": "495:520 mm"}, minimise=name, count=16, quantities=["error"]
    )
    objective = objective_of(study)
    assert objective.name == name
    order = ranked(study)
    assert (np.diff(objective.of(study)[order]) >= 0.0).all()


def test_every_objective_is_named_where_people_look() -> None:
    page = (Path(__file__).parents[3] / "docs" / "studies.md").read_text("utf-8")
    (option,) = (one for one in command.command.params if one.name == "minimise")
    for name in OBJECTIVES:
        assert f"`{name}`" in page
        assert re.search(rf"[ ,]{name}[,.]", getattr(option, "help", ""))
        assert f'"{name}"' in str(tp.study.__doc__)


@pytest.mark.parametrize(
    ("more", "code"),
    [
        ({"minimise": "eror"}, "unknown-choice"),
        ({"minimise": "error", "count": None}, "bad-design"),
        ({"minimise": "error", "count": 15}, "bad-design"),
        ({"minimise": "error", "count": 10_001}, "study-too-large"),
        ({"minimise": "error", "design": "sobol"}, "bad-design"),
        ({"minimise": "error", "vary": ["strut.*.length=500:520:3 mm"]}, "bad-design"),
        ({"minimise": "error", "vary": ["strut.*.material=steel,invar"]}, "bad-design"),
        ({"minimise": "error", "conditioning": 0.0}, "bad-constraint"),
        ({"minimise": "error", "conditioning": float("nan")}, "bad-constraint"),
        ({"minimise": "error", "travel_left": 0.6}, "bad-constraint"),
    ],
)
def test_bad_requests(more: dict[str, Any], code: str) -> None:
    asked = {"count": 24, "vary": RODS, **more}
    with pytest.raises(tp.errors.RequestError, match=code):
        tp.study(PLANAR, asked.pop("vary"), **asked)


def test_the_optimiser_is_told_which_of_two_is_worse() -> None:
    """Any that is feasible is better than any that is not, and nothing worse than no machine."""
    constraints = Constraints(1.0, conditioning=0.2, travel_left=0.1)
    template = BlockTask(0, cast("Any", None), (), ("error", "kinematics"), constraints, "scalar")
    of = Minimised(OBJECTIVES["error"], (), 0, 0, template)
    variants = {
        "status": np.array(["ok", "ok", *["infeasible"] * 4, "failed"], object),
        "linear_maximum": np.array([1e-5, 2e-3, *[np.nan] * 5])[:, np.newaxis],
        "reach": np.array([1.0, 1.0, 1.0, 1.0, 0.9, 0.1, np.nan]),
        "conditioning": np.array([0.3, 0.3, 0.19, 0.02, np.nan, np.nan, np.nan]),
        "travel_left": np.array([0.2, 0.2, 0.2, 0.2, np.nan, np.nan, np.nan]),
    }
    told = of.value_of(variants)
    assert np.isfinite(told).all()
    assert (np.diff(told) > 0.0).all()
    assert told[:2].tolist() == [1e-5, 2e-3]


@pytest.mark.parametrize("count", [64, 97])
def test_a_search_finds_the_bottom_of_a_valley_with_a_kink(count: int) -> None:
    """Of a function of two variables whose least is known, in just so many evaluations."""
    asked: list[Any] = []

    def ask(shares: Any) -> Any:
        asked.append(shares.copy())
        return np.abs(shares[:, 0] - 0.3) + 2.0 * np.abs(shares[:, 1] - shares[:, 0] - 0.2)

    search(ask, 2, count, 7)
    points = np.concatenate(asked)
    assert points.shape == (count, 2)
    assert ((points >= 0.0) & (points <= 1.0)).all()
    found = points[ask(points).argmin()]
    assert np.abs(found - [0.3, 0.5]).max() < 0.05
    first = asked[0]
    assert ask(points).min() < 0.5 * ask(first).min()


def test_a_generation_is_as_large_as_its_variables_need() -> None:
    sizes = [generation_of(count) for count in range(1, 12)]
    assert all(size >= 5 * count for count, size in enumerate(sizes, 1))
    assert all(size.bit_count() == 1 for size in sizes)
    assert sizes == sorted(sizes)


def test_the_command_says_what_is_best(tmp_path: Path, capsys: Capture, minimised: Any) -> None:
    search = (
        "study", PLANAR, "--vary", "strut.*.length=360:620 mm", "--minimise", "error", "--count",
        "24", "--seed", "3", "--quantities", "error",
    )  # fmt: skip
    dry = call(capsys, *search, "--dry-run")
    assert (dry.code, dry.out.split(" of ")[0]) == (0, "24 variants")
    outcome = call(capsys, *search, "--output", tmp_path / "search.zarr")
    assert outcome.code == 0
    best = int(ranked(minimised)[0])
    lines = [line.split() for line in outcome.out.splitlines()]
    first = next(line for line in lines if line[:1] == [str(best)])
    assert " ".join(first[1:3]) == minimised["setting"].values[best, 0]
    wrong = call(capsys, *search, "--travel-left", "much", "--dry-run")
    assert (wrong.code, wrong.codes) == (2, ["bad-constraint"])
