"""Plain words for what cannot be told apart: names put together, bases made sparse, numbers."""

from __future__ import annotations

import numpy as np
import pytest

from truepose.calibration.acceptance import sentences
from truepose.files.shown_units import shown_units
from truepose.files.units import FileUnit

DELTA = (
    "delta radius",
    "endstop a",
    "endstop b",
    "endstop c",
    "tower angle a",
    "tower angle b",
    "rod length a",
    "rod length b",
    "rod length c",
)
STRUTS = tuple(f"length of strut {n}" for n in range(1, 7))
JOINTS = tuple(f"base joint {axis} of strut {n}" for n in range(1, 7) for axis in "xyz")


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (3.7142e-3, "m", "3.7 mm"),
        (0.5e-3, "m", "0.50 mm"),
        (65.2e-6, "m", "65 µm"),
        (1.0e-4, "m", "0.10 mm"),
        (0.9e-4, "m", "90 µm"),
        (9.99e-6, "m", "10 µm"),
        (0.3e-9, "m", "0.00030 µm"),
        (0.2696, "m", "270 mm"),
        (np.radians(0.126), "rad", "0.13°"),
        (80e-6, "rad", "4.6 mdeg"),
        (-0.0185, "m", "−18 mm"),
        (0.0, "m", "0 µm"),
        (1.1e-5, "1/K", "1.1e−05 1/K"),
        (0.31, "1", "0.31"),
        (np.inf, "m", "without limit"),
    ],
)
def test_quantities(value: float, unit: str, shown: str) -> None:
    assert sentences.quantity(value, unit) == shown


def test_stated_sizes_have_no_zeros_at_their_end() -> None:
    assert sentences.stated(0.5e-3, "m") == "0.5 mm"
    assert sentences.stated(20e-6, "m") == "0.02 mm"
    assert sentences.stated(10e-3, "m") == "10 mm"
    assert sentences.stated(2e-6, "m") == "2 µm"
    assert sentences.stated(np.radians(0.2), "rad") == "0.2°"


def test_quantities_of_a_machine_in_inches_and_radians() -> None:
    units = shown_units({"length": FileUnit("in", 0.0254), "angle": FileUnit("rad")})
    assert sentences.quantity(0.254e-3, "m", units=units) == "0.010 in"
    assert sentences.quantity(25.4e-6, "m", units=units) == "1000 µin"
    assert sentences.quantity(80e-6, "rad", units=units) == "80 µrad"
    assert sentences.quantity(0.01, "rad", units=units) == "0.010 rad"
    assert sentences.stated(0.0254e-3, "m", units) == "0.001 in"


def test_ratios() -> None:
    assert [sentences.times(value) for value in (37.0, 1.234, 412.0, 0.31)] == [
        "37",
        "1.2",
        "410",
        "0.31",
    ]


def test_lists_are_cut() -> None:
    assert sentences.listed([]) == ""
    assert sentences.listed(["a"]) == "a"
    assert sentences.listed(["a", "b"]) == "a and b"
    assert sentences.listed(list("abcdef")) == "a, b, c, d, e and f"
    assert sentences.listed(list("abcdefg")) == "a, b, c, d, e and 2 more"
    assert sentences.listed(list("abcdefghijkl")) == "a, b, c, d, e and 7 more"


def test_phrases_of_several_instruments() -> None:
    assert sentences.by_phrase(["by heights alone"]) == "by heights alone"
    assert sentences.by_phrase(["by heights alone", "by heights alone"]) == "by heights alone"
    assert (
        sentences.by_phrase(["by heights alone", "by distances alone"])
        == "by heights and distances together"
    )
    assert sentences.by_phrase([]) == "by these measurements"


def test_names_are_put_together() -> None:
    assert sentences.collapsed(DELTA[6:], DELTA) == ["rod length"]
    assert sentences.collapsed(DELTA[6:8], DELTA) == ["rod length a and b"]
    assert sentences.collapsed(DELTA[6:7], DELTA) == ["rod length a"]
    assert sentences.collapsed((DELTA[8], DELTA[0], *DELTA[6:8]), DELTA) == [
        "rod length",
        "delta radius",
    ]
    assert sentences.collapsed(STRUTS, STRUTS) == ["the strut lengths"]
    assert sentences.collapsed(STRUTS[1:5], STRUTS) == ["the strut lengths"]
    assert sentences.collapsed((STRUTS[0], STRUTS[3]), STRUTS) == ["length of strut 1 and 4"]
    assert sentences.collapsed(JOINTS, JOINTS) == ["the strut base joints"]
    assert sentences.collapsed(JOINTS[::3], JOINTS) == ["the strut base joints in x"]
    drives = tuple(f"offset of drive {letter}" for letter in "abc")
    assert sentences.collapsed(drives, drives) == ["the drive offsets"]
    frame = tuple(f"frame of tracker, origin {axis}" for axis in "xyz")
    assert sentences.collapsed(frame, frame) == ["frame of tracker, origin"]
    # Coordinates of numbered points, numbers last.
    points = tuple(f"joint {n}, {axis}" for n in (1, 2, 3) for axis in "xyz")
    assert sentences.collapsed(points, points) == ["joints 1, 2 and 3"]
    assert sentences.collapsed(points[:3], points) == ["joint 1"]
    # Groups have such names as their file gives them.
    assert sentences.collapsed(["rod-a", "rod-b"], ["rod-a", "rod-b", "hub_1"]) == ["rod"]
    # What only looks like a family is none.
    assert sentences.collapsed(
        ["delta radius", "delta height"], ["delta radius", "delta height"]
    ) == [
        "delta radius",
        "delta height",
    ]


def test_one_of_a_family() -> None:
    assert sentences.some("rod length a", DELTA, "one") == "one rod length"
    assert sentences.some("delta radius", DELTA, "one") == "delta radius"
    assert sentences.some("length of strut 2", STRUTS, "every") == "the length of every strut"


def test_a_basis_of_direct_sums_is_found_again() -> None:
    parts = np.zeros((3, 9))
    parts[0, [0, 1, 2]] = 1.0, -2.0, 0.5
    parts[1, [3, 4]] = 1.0, 1.0
    parts[2, 7] = 1.0
    turned = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0] @ parts
    found = sentences.sparse(turned)
    assert sorted(sentences.members(row) for row in found) == [(1, 0, 2), (3, 4), (7,)]
    assert np.linalg.matrix_rank(np.vstack([found, parts]), tol=1e-9) == 3
    assert np.abs(found).max(axis=1) == pytest.approx(1.0)


def test_small_parts_are_not_named() -> None:
    assert sentences.members([1.0, 0.11, 0.09]) == (0, 1)


def test_worse_seen_directions_are_not_mixed_with_better_seen_ones() -> None:
    worst = np.array([1.0, -1.0, 0.0, 0.0]) / np.sqrt(2.0)
    better = np.array([1.0, 1.0, 1.0, 0.0]) / np.sqrt(3.0)
    found = sentences.clustered([better, worst], [0.5, 0.01])
    assert sentences.members(found[0]) == (0, 1)
    assert sentences.members(found[1]) == (0, 1, 2)
    assert sentences.clustered(np.zeros((0, 4)), []).shape == (0, 4)


def test_what_cannot_be_told_apart() -> None:
    rows = np.zeros((1, 9))
    rows[0, [0, 1, 2, 3, 6, 7, 8]] = 0.3, -0.8, -0.8, -0.8, 1.0, 1.0, 1.0
    assert sentences.undetermined(rows, DELTA, "by a flat bed") == [
        "rod length, endstop and delta radius cannot be told apart by a flat bed"
    ]
    assert sentences.undetermined(rows, DELTA, "by a flat bed", within_tolerances=True) == [
        "rod length, endstop and delta radius cannot be told apart by a flat bed "
        "within their tolerances"
    ]
    assert sentences.undetermined(np.zeros((0, 9)), DELTA, "by a flat bed") == []


def test_one_unknown_alone_is_not_found() -> None:
    rows = np.eye(9)[[4]]
    assert sentences.undetermined(rows, DELTA, "by heights alone") == [
        "tower angle a cannot be found by heights alone"
    ]
    assert sentences.undetermined(rows, DELTA, "by heights alone", within_tolerances=True) == [
        "tower angle a cannot be found by heights alone better than its tolerance says"
    ]


def test_all_of_one_family() -> None:
    # Only their sum is seen: each against the others.
    rows = sentences.sparse(np.linalg.svd(np.ones((1, 6)))[2][1:])
    assert sentences.undetermined(rows, STRUTS, "by heights alone") == [
        "the strut lengths cannot be told apart by heights alone"
    ]
    rows = np.zeros((2, 9))
    rows[0, [6, 7]] = 1.0, -1.0
    rows[1, [6, 8]] = 1.0, -1.0
    assert sentences.undetermined(rows, DELTA, "by heights alone") == [
        "rod length a, b and c cannot be told apart by heights alone"
    ]


def test_numbered_points_that_cannot_be_told_apart() -> None:
    points = tuple(f"joint {n}, {axis}" for n in (1, 2, 3) for axis in "xyz")
    rows = np.ones((1, 9))
    assert sentences.undetermined(rows, points, "by heights alone") == [
        "joints 1, 2 and 3 cannot be told apart by heights alone"
    ]
    assert sentences.undetermined(np.eye(9)[:1] + np.eye(9)[1], points, "by heights alone") == [
        "joint 1 x and y cannot be told apart by heights alone"
    ]


def test_many_directions_make_few_sentences() -> None:
    trees = ("alder", "beech", "cedar", "dogwood", "elm", "fir", "gum", "holly")
    labels = tuple(f"{tree} size" for tree in trees)
    rows = np.zeros((4, 8))
    for index in range(4):
        rows[index, [2 * index, 2 * index + 1]] = 1.0, -1.0
    assert sentences.undetermined(rows, labels, "by heights alone") == [
        "alder size and beech size cannot be told apart by heights alone, nor can cedar size and "
        "dogwood size, nor can elm size and fir size, nor can one more such combination"
    ]
