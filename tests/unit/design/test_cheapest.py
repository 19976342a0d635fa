"""`truepose.allocate`: the cheapest design, against all designs enumerated in closed form."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from costed_slider import COSTS, LENGTHS, OFFSETS, ROWS, errors
from designs import file_with, row


def largest(rod: tuple[float, ...], offset: tuple[float, ...], poses: np.ndarray) -> float:
    """The largest error at the poses over all corners of the bands, mm."""
    corners = np.array(list(product((-1.0, 1.0), repeat=4)))[:, np.newaxis]
    size = errors(poses, corners[..., :2] * rod, corners[..., 2:] * offset)
    return float(np.sqrt(np.square(size).sum(axis=-1)).max())


@pytest.fixture(scope="module")
def enumerated() -> list[tuple[float, float, tuple[int, ...]]]:
    """Largest error and cost of all 81 designs."""
    x, y = np.meshgrid(np.linspace(200.0, 400.0, 81), np.linspace(100.0, 300.0, 5))
    poses = np.stack([x.ravel(), y.ravel()], axis=-1)
    every = []
    for grades in product(range(3), repeat=4):
        rod = tuple(LENGTHS[grade] for grade in grades[:2])
        offset = tuple(OFFSETS[grade] for grade in grades[2:])
        cost = sum(COSTS[tie // 2][grade] for tie, grade in enumerate(grades))
        every.append((largest(rod, offset, poses), cost, grades))
    return every


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return file_with(tmp_path_factory.mktemp("planar"), "planar_two_slider", rows=ROWS)


def test_the_closed_form_is_of_this_machine(file: Path) -> None:
    poses = np.array([[0.3, 0.2], [0.21, 0.12]])
    known = tp.budget(tp.load(file), poses)["overall_error"].values
    nothing = np.zeros(2)
    assert 1e-3 * errors(1e3 * poses, nothing, nothing) == pytest.approx(known, abs=1e-12)


@pytest.mark.parametrize("target", [0.31, 0.385, 0.47])
def test_the_cheapest_of_all_designs(
    file: Path, enumerated: list[tuple[float, float, tuple[int, ...]]], target: float
) -> None:
    limit = 0.99 * target
    # No design is so near the limit that rounding, or the second order, decides.
    assert min(abs(error / limit - 1.0) for error, _, _ in enumerated) > 3e-4
    cheapest = min(cost for error, cost, _ in enumerated if error <= limit)
    assert cheapest > min(cost for _, cost, _ in enumerated)
    found = tp.allocate(tp.load(file, [f"accuracy.target={target}"]), gap=0.0)
    assert found.cost == pytest.approx(cheapest)
    assert found.lower_bound <= cheapest
    assert found.lower_bound == pytest.approx(cheapest, rel=1e-6)
    assert found.proven == "these poses"
    chosen = {grade.name: grade.halves for grade in found.grades}
    grades = tuple(
        halves.index(round(1e3 * chosen[name][0], 9))
        for name, halves in (
            ("strut.1.length", LENGTHS),
            ("strut.2.length", LENGTHS),
            ("drive.d1.offset", OFFSETS),
            ("drive.d2.offset", OFFSETS),
        )
    )
    error = next(error for error, _, one in enumerated if one == grades)
    assert error <= limit
    assert max(one.error for one in found.worst_poses) == pytest.approx(1e-3 * error, rel=1e-3)


def test_one_grade_for_all_in_comparison(
    file: Path, enumerated: list[tuple[float, float, tuple[int, ...]]]
) -> None:
    limit = 0.99 * 0.385
    found = tp.allocate(tp.load(file, ["accuracy.target=0.385"]), gap=0.0)
    alike = [(cost, error) for error, cost, grades in enumerated if len(set(grades)) == 1]
    assert len(alike) == 3
    assert found.one_grade == pytest.approx(min(cost for cost, error in alike if error <= limit))
    x, y = np.meshgrid(np.linspace(200.0, 400.0, 81), [100.0, 300.0])
    poses = np.stack([x.ravel(), y.ravel()], axis=-1)

    def halves(place: float) -> tuple[float, float]:
        lower = min(int(place), 1)
        share = place - lower
        widths = [
            grades[lower] ** (1.0 - share) * grades[lower + 1] ** share
            for grades in (LENGTHS, OFFSETS)
        ]
        return widths[0], widths[1]

    within, beyond = 0.0, 2.0
    for _ in range(30):
        middle = 0.5 * (within + beyond)
        rod, offset = halves(middle)
        keeps = largest((rod, rod), (offset, offset), poses) <= limit
        within, beyond = (middle, beyond) if keeps else (within, middle)
    rod, offset = halves(within)
    assert found.one_width == pytest.approx(2.0 * (0.09 / rod + 0.05 / offset), rel=1e-3)
    assert found.cost < found.one_grade
    assert found.one_width < found.one_grade


def test_options_are_chosen_with_the_grades(
    file: Path, enumerated: list[tuple[float, float, tuple[int, ...]]], tmp_path: Path
) -> None:
    """Rods of invar, by hand: with what they cost, they are worth it for a fine target alone."""
    choice = """[[cost.choice]]
name = "rods"
of = "strut.*"
options = [
  { name = "steel", set = {}, cost = 0 },
  { name = "invar", set = { expansion = "1.2e-6 1/K" }, cost = 3 },
]
"""
    path = file_with(tmp_path, "planar_two_slider", choice, rows=ROWS)
    dear = [cost for error, cost, _ in enumerated if error <= 0.99 * 0.4]
    wide = tp.allocate(tp.load(path, ["accuracy.target=0.47"]), gap=0.0)
    assert [one.option for one in wide.options] == ["steel"]
    fine = tp.allocate(tp.load(path, ["accuracy.target=0.4"]), gap=0.0)
    alone = tp.allocate(
        tp.load(file, ["accuracy.target=0.4", "strut.*.expansion=1.2e-6 1/K"]), gap=0.0
    )
    assert fine.cost == pytest.approx(min(min(dear), alone.cost + 3.0))
    assert [one.option for one in fine.options] == [
        "invar" if alone.cost + 3.0 < min(dear) else "steel"
    ]
    assert fine.combinations == 2


def test_of_the_designs_within_the_gap_one_of_fewer_grades(
    file: Path, enumerated: list[tuple[float, float, tuple[int, ...]]]
) -> None:
    """What the gap allows is used for fewer different grades, and for nothing else."""
    gap, fewer = 0.25, 0
    for target in (0.385, 0.40, 0.42, 0.45):
        limit = 0.99 * target
        allowed = [(cost, grades) for error, cost, grades in enumerated if error <= limit]
        cheapest = min(cost for cost, _ in allowed)

        def kinds(grades: tuple[int, ...]) -> int:
            return len(set(grades[:2])) + len(set(grades[2:]))

        machine = tp.load(file, [f"accuracy.target={target}"])
        found = tp.allocate(machine, gap=gap)
        exactly = tp.allocate(machine, gap=0.0)
        assert exactly.cost == pytest.approx(cheapest)
        assert found.gap <= gap + 1e-9
        # The bound told may be lower than the cheapest: at least what that leaves is used.
        within = [grades for cost, grades in allowed if cost <= cheapest * (1.0 + 1e-9)]
        assert found.distinct_grades <= min(kinds(grades) for grades in within)
        beyond = [grades for cost, grades in allowed if cost <= found.lower_bound / (1.0 - gap)]
        assert found.distinct_grades == min(kinds(grades) for grades in beyond)
        assert found.proven == "these poses"
        fewer += found.distinct_grades < exactly.distinct_grades
    assert fewer > 0


def test_other_designs_are_the_next_cheapest(tmp_path: Path) -> None:
    """Of other rods, and of another grade for both rods together; each by itself, by hand."""
    rows = (
        row("strut.*.length", "kind", '["20 um", "50 um", "100 um"]', 9.0),
        row("drive.*.offset", bands='["10 um", "30 um", "80 um"]', cost=5.0),
    )
    invar = "expansion=1.2e-6 1/K"
    choice = """[[cost.choice]]
name = "rods"
of = "strut.*"
options = [
  { name = "steel", set = {}, cost = 0 },
  { name = "invar", set = { expansion = "1.2e-6 1/K" }, cost = 3 },
]
"""
    path = file_with(tmp_path, "planar_two_slider", choice, rows=rows)
    target = "accuracy.target=0.42"
    found = tp.allocate(tp.load(path, [target]), gap=0.0, alternatives=2)
    assert len(found.alternatives) == 2
    costs = [one.cost for one in found.alternatives]
    assert found.cost <= costs[0] <= costs[1]
    grade = next(one.grade for one in found.grades if one.of == "strut.*.length")
    other_grades = [one for one in ("20 um", "50 um", "100 um") if one != grade]
    steel = found.options[0].option == "steel"

    def cheapest(rods: str, *settings: str) -> float:
        bands = f'["{rods}"]'
        alone = file_with(
            tmp_path,
            "planar_two_slider",
            rows=(row("strut.*.length", "kind", bands, 9.0), rows[1]),
        )
        try:
            return tp.allocate(tp.load(alone, [target, *settings]), gap=0.0).cost
        except tp.RequestError:
            return float("inf")

    own = [] if steel else [f"strut.*.{invar}"]
    other = [f"strut.*.{invar}"] if steel else []
    of_other = min(cheapest(one, *other) for one in (grade, *other_grades)) + 3.0 * steel
    of_grade = min(cheapest(one, *own) for one in other_grades) + 3.0 * (not steel)
    assert costs == pytest.approx(sorted([of_other, of_grade]))
    assert all(one.differs for one in found.alternatives)
    assert any(text.startswith("rods: ") for one in found.alternatives for text in one.differs)
    assert list(found.dataset["alternative_cost"].values) == pytest.approx(costs)
