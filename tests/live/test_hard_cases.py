"""Bundles of machines that say little, of unusual unknowns, of sources that follow no law."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from math import pi, sin
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES
from made_source import MadeSource, with_sources
from truepose.errors import TrueposeError
from truepose.live import bundle
from truepose.machine import Condition, Machine
from truepose.probability.distributions import ARCSINE
from truepose.runs.poses import PoseRun
from truepose.sources import Deviation, PoseBlock
from truepose.sources._play import DeadZone, pressed
from weighing_machines import WEIGHING

HERE = Path(__file__).parents[1]
SAYS_LITTLE = [
    HERE / "house" / "inputs" / "hexapod.toml",
    HERE.parent / "examples" / "data" / "delta_printer.toml",
]
UNUSUAL = """
[tolerance]
"drive.d1.offset" = { band = 0.1, distribution = "triangular" }
"drive.d2.offset" = { band = 0.1, distribution = "arcsine" }
"drive.d1.origin.x" = { band = 0.1, distribution = "two-point" }
"drive.d2.origin.x" = { standard_deviation = 0.02 }
"tool.x" = { scale = 0.02, distribution = "student-t", dof = 5 }
"tool.y" = { values = [-0.1, 0, 0.2], probabilities = [0.2, 0.5, 0.3], distribution = "discrete" }
"strut.1.base.x" = { band = 0.05, group = "one set-up" }
"strut.2.base.x" = { band = 0.05, group = "one set-up" }

[[correlation]]
between = ["strut.1.length", "strut.2.length"]
coefficient = 0.6
"""
CORRELATED_STUDENT = """
[tolerance]
"tool.x" = { scale = 0.02, distribution = "student-t", dof = 5 }
"tool.y" = { scale = 0.02, distribution = "student-t", dof = 5 }

[[correlation]]
between = ["tool.x", "tool.y"]
coefficient = 0.6
"""


def planar_with(text: str, folder: Path) -> Machine:
    """The planar machine of the library with more tables."""
    path = folder / "planar.toml"
    path.write_text((MACHINES / "planar_two_slider.toml").read_text(encoding="utf-8") + text)
    return tp.load(path)


def refused(ask: Callable[[], object]) -> str:
    """What was found where a bundle is refused."""
    with pytest.raises(TrueposeError) as caught:
        ask()
    (problem,) = caught.value.problems
    assert problem.code == "not-live"
    assert problem.found is not None
    return problem.found


@pytest.mark.parametrize("path", SAYS_LITTLE, ids=lambda path: path.stem)
def test_a_machine_without_expansion_and_stiffness_is_live(path: Path) -> None:
    of = bundle(tp.load(path))
    assert all(source["live"] for source in of["sources"])
    assert of["parts"] == []
    assert of["compliance"] == {"own": [], "shared": [], "limbs": False}


def test_limbs_alone_take_no_force_where_struts_do_not_say_how_stiff_they_are(
    tmp_path: Path,
) -> None:
    text = (MACHINES / "tricept.toml").read_text(encoding="utf-8")
    without = re.sub(r"(?m)^stiffness = .*$|^force = .*$", "", text)
    path = tmp_path / "tricept.toml"
    path.write_text(without, encoding="utf-8")
    machine = tp.load(path)
    assert machine.limbs
    assert bundle(machine)["compliance"] == {"own": [], "shared": [], "limbs": False}


def test_every_distribution_is_told(tmp_path: Path) -> None:
    of = bundle(planar_with(UNUSUAL, tmp_path))
    told = {one["name"]: one for one in of["variables"]}
    assert {name: one["distribution"]["kind"] for name, one in told.items()} == {
        "one set-up": "uniform",
        "strut.1.length": "uniform",
        "strut.2.length": "uniform",
        "drive.d1.origin.x": "two-point",
        "drive.d1.offset": "triangular",
        "drive.d2.origin.x": "normal",
        "drive.d2.offset": "arcsine",
        "tool.x": "student-t",
        "tool.y": "discrete",
    }
    assert told["tool.x"]["distribution"]["dof"] == 5
    half = {of["parameters"][one["parameter"]]: one["half"] for one in of["columns"]}
    # About their mean of 0.04 mm.
    values = np.array(told["tool.y"]["distribution"]["values"]) * half["tool.y"][0]
    np.testing.assert_allclose(values + 4e-5, [-1e-4, 0.0, 2e-4], atol=1e-18)
    moved = [of["parameters"][c["parameter"]] for c in of["columns"] if c["variable"] == 0]
    assert moved == ["strut.1.base.x", "strut.2.base.x"]


def test_correlated_tolerances_are_a_copula_of_normal_variables(tmp_path: Path) -> None:
    of = bundle(planar_with(UNUSUAL, tmp_path))
    names = [of["variables"][at]["name"] for at in of["copula"]["members"]]
    assert names == ["strut.1.length", "strut.2.length"]
    factor = np.array(of["copula"]["factor"])
    # Uniform variables of correlation r are made of normal ones of 2 sin(pi r / 6).
    normal = 2.0 * sin(pi * 0.6 / 6.0)
    np.testing.assert_allclose(factor @ factor.T, [[1.0, normal], [normal, 1.0]], atol=1e-12)


def test_correlated_variables_that_the_kernel_cannot_draw_are_not_live(tmp_path: Path) -> None:
    of = bundle(planar_with(CORRELATED_STUDENT, tmp_path))
    named = {one["name"]: one for one in of["sources"]}
    assert named["tolerance"]["why"] == "has correlated variables of Student's distribution"
    assert named["tolerance"]["banded"]
    assert named["thermal"]["live"]
    assert of["variables"] == []
    assert of["copula"] is None


def test_a_direction_is_told_as_what_it_is() -> None:
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    two = [machine.kernel.parameters.index(f"tool.{axis}") for axis in "xy"]
    given = Deviation.of(
        two, 0.0, 1e-4, groups=[0, 1], distribution=[ARCSINE] * 2, directions=[(0, 1)]
    )
    of = bundle(with_sources(machine, MadeSource("turned", given)))
    assert of["directions"] == [[0, 1]]


@dataclass(frozen=True)
class OfParts:
    """A strut's length that follows from temperatures in a way that no law has."""

    name: ClassVar[str] = "of parts"
    doc: ClassVar[str] = "made for a test"

    size: Callable[[Condition], float]

    def acts(self, condition: Condition) -> bool:
        return True

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        return Deviation.of([machine.kernel.length_parameters[0]], self.size(condition))


def both_warm(condition: Condition) -> float:
    """Nothing as long as only one of two parts is warm."""
    rises = [condition.temperature_rise(f"strut.{strut}") for strut in (1, 2)]
    return 1e-7 * rises[0] * rises[1]


def room_warm(condition: Condition) -> float:
    """From a temperature of what the machine does not have as a part."""
    return 1e-6 * condition.temperature_rise("room")


@pytest.mark.parametrize("size", [both_warm, room_warm])
def test_temperatures_that_do_not_count_part_by_part_are_no_law(size: Any) -> None:
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    of = bundle(with_sources(machine, *machine.sources, OfParts(size)))
    named = {one["name"]: one for one in of["sources"]}
    why = "follows from temperatures in another way than part by part"
    assert named["of parts"]["why"] == why
    assert named["of parts"]["largest"]["position"] > 0.0
    assert all(one["live"] for name, one in named.items() if name != "of parts")


@pytest.mark.parametrize("component", ["force", "moment"])
def test_a_band_that_follows_the_wrench_is_no_law(component: str) -> None:
    class Loaded(OfParts):
        def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
            # As play that opens under a large load in one direction only.
            load = max(0.0, -min(getattr(condition, component)) - 60.0)
            column = machine.kernel.length_parameters[0]
            return Deviation.of([column], 0.0, 1e-6 * (1.0 + load))

    machine = tp.load(MACHINES / "hexapod.toml")
    of = bundle(with_sources(machine, *machine.sources, Loaded(lambda _: 0.0)))
    named = {one["name"]: one for one in of["sources"]}
    assert named["of parts"]["why"] == "has bands that follow from the temperature or the wrench"


def test_replaced_values_are_not_shown_as_those_of_the_file() -> None:
    machine = tp.load(MACHINES / "planar_two_slider.toml").replace({"strut.1.length": 0.501})
    assert "strut.1.length" in refused(lambda: bundle(machine))


def test_a_file_of_whose_poses_none_can_be_reached_is_refused() -> None:
    # Its two poses are out of reach on either side; what lies between can be reached.
    wide = {"workspace.grid.x": "[-500, 500, 2]"}
    machine = tp.load(MACHINES / "hexapod_all_sources.toml", settings=wide)
    assert "no pose" in refused(lambda: bundle(machine))


def test_home_can_be_reached_where_the_middle_cannot() -> None:
    far = {"workspace.grid.z": "[18, 60, 3]"}
    machine = tp.load(MACHINES / "hexapod.toml", settings=far)
    workspace = bundle(machine)["workspace"]
    middle = 0.5 * (np.array(workspace["low"]) + np.array(workspace["high"]))
    assert [
        len(list(PoseRun(machine, np.array([pose]), machine.condition)))
        for pose in (middle, workspace["home"])
    ] == [0, 1]


def loose(block: PoseBlock, threshold: float) -> Deviation:
    """Play of the first strut, taken up above a load."""
    column = block.machine.kernel.length_parameters[:1]
    side, _ = pressed(block, column, block.loads(column, "all"), threshold)
    return Deviation.of(column, side * 1e-6, np.where(side == 0.0, 1e-6, 0.0))


@dataclass(frozen=True)
class Loose(MadeSource):
    """A source that says which its dead zones are; `zones` of the machine's first strut."""

    zones: Callable[[int], tuple[DeadZone, ...]] = lambda column: ()

    def dead_zones(self, machine: Machine) -> tuple[DeadZone, ...]:
        return self.zones(int(machine.kernel.length_parameters[0]))


@pytest.mark.parametrize(
    ("zones", "told"),
    [
        (lambda column: (DeadZone(column, 10.0),), True),
        (lambda column: (DeadZone(column, 200.0),), False),
        (lambda column: (DeadZone(column + 1, 10.0),), False),
        (lambda column: (), False),
    ],
)
def test_a_source_that_says_other_dead_zones_than_it_has_is_refused(
    zones: Callable[[int], tuple[DeadZone, ...]], told: bool
) -> None:
    machine = tp.load(MACHINES / "hexapod.toml")
    source = Loose("loose", of_block=lambda block: loose(block, 10.0), zones=zones)
    of = bundle(with_sources(machine, *machine.sources, source))
    (found,) = [one for one in of["sources"] if one["name"] == "loose"]
    assert found["live"] is told
    assert told or found["why"] == "has other dead zones than it says"
    played = [column["play"] for column in of["columns"] if "play" in column]
    assert [(one["source"], one["threshold"]) for one in played] == [("loose", 10.0)] * told


def test_a_force_of_unknown_direction_is_not_live() -> None:
    settings = dict(WEIGHING["hexapod"]) | {"condition.envelope": '{ force = "100 N" }'}
    of = bundle(tp.load(MACHINES / "hexapod.toml", settings=settings))
    not_live = {one["name"]: one["why"] for one in of["sources"] if not one["live"]}
    assert not_live == dict.fromkeys(
        ["loads", "backlash", "clearance"], "follows from a force of unknown direction"
    )


def test_a_gradient_along_a_strut_is_named_and_one_of_a_body_is_live() -> None:
    def thermal(part: str, gradient: str) -> dict[str, Any]:
        settings = {f"condition.gradient.{part}": gradient}
        of = bundle(tp.load(MACHINES / "hexapod.toml", settings=settings))
        (found,) = [one for one in of["sources"] if one["name"] == "thermal"]
        return found

    of_body = thermal("platform", '["1 K/m", "2 K/m", "-3 K/m"]')
    assert of_body["live"]
    assert of_body["at_reference"]
    along = thermal("strut.1", '"20 K/m"')
    assert (along["live"], along["why"]) == (False, "follows from the pose")
