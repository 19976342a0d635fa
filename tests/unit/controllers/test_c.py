"""The exported C against the kernel, its warnings, its memory and its stack."""

from __future__ import annotations

import dataclasses
import re
import subprocess
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from c_program import EXACT, FUSED, STRICT, Answers, compiled, compiler, driver
from made_source import MadeSource, with_sources
from sweeps import sweep, thinned
from truepose import _kernel, controllers
from truepose.controllers.c import Program, program_of
from truepose.errors import RequestError
from truepose.machine import Condition, Machine
from truepose.runs.displacement import sum_deviations
from truepose.runs.poses import PoseRun
from truepose.sources import Deviation, PoseBlock, acting
from yielding_machines import CHAINS, yielding

MACHINE_FOLDER = Path("machines")
MACHINES = sorted(path.stem for path in MACHINE_FOLDER.glob("*.toml"))
YIELDING = [f"yielding_{name}" for name in CHAINS]
"""Deltas on carriages and arms that give way."""
FREEDOMS = "xyzabc"
WITHOUT = {"hexapod_all_sources": ("loads", "backlash", "clearance", "screw_coupling")}
ALWAYS = {"hexapod_all_sources": ("tolerance", "sensor", "actuator", "guideway")}
"""Sources whose shift does not go away with heat and load."""
POSES = 100_000
Floats = NDArray[np.float64]

exported = pytest.mark.parametrize("name", [*MACHINES, *YIELDING])
OF_EACH_KIND = {"planar_two_slider", "rotary_delta", "tricept", "overconstrained"}
"""Sliders, cranks, guides, and more closures than freedoms: what the C is printed of differs."""

in_part = pytest.mark.parametrize("name", thinned(MACHINES, OF_EACH_KIND))


@cache
def machine_of(name: str) -> Machine:
    if name in YIELDING:
        return tp.load(yielding(name.removeprefix("yielding_")))
    return tp.load(f"machines/{name}.toml")


@cache
def program(name: str) -> Program:
    return program_of(machine_of(name), without=WITHOUT.get(name, ()))


def hot_and_loaded(name: str) -> tuple[Condition, Floats, Floats]:
    """A condition with every part at its own temperature and a wrench, and both as C takes them."""
    machine, c = machine_of(name), program(name)
    rng = np.random.default_rng(7)
    reference = machine.condition.reference_temperature
    kelvin = reference + rng.uniform(-10.0, 30.0, len(c.temperature_parts))
    wrench = rng.normal(size=6) * [400.0, 400.0, 400.0, 15.0, 15.0, 15.0]
    wrench *= [freedom in machine.dof for freedom in FREEDOMS]
    condition = machine.condition.replace(
        temperature=reference, force=wrench[:3].tolist(), moment=wrench[3:].tolist()
    ).replace(temperature=dict(zip(c.temperature_parts, kelvin.tolist(), strict=True)))
    return condition, kelvin, wrench


def random_poses(machine: Machine, count: int) -> Floats:
    """Commanded poses anywhere in the box of the file's workspace."""
    poses = machine.poses()
    low, high = poses.min(axis=0), poses.max(axis=0)
    rng = np.random.default_rng(11)
    return np.asarray(low + (high - low) * rng.random((count, len(low))))


def in_full(machine: Machine, values: Floats, names: tuple[str, ...]) -> Floats:
    """(n, 6) coordinates x y z a b c; what is not named is at home."""
    full = np.tile(np.array(machine.kernel.control["home"]), (len(values), 1))
    full[:, [FREEDOMS.index(name) for name in names]] = values
    return full


class Both:
    """The kernel's answers and those of C at the same poses."""

    def __init__(self, name: str, folder: Path, flags: tuple[str, ...], count: int) -> None:
        machine, c = machine_of(name), program(name)
        condition, kelvin, wrench = hot_and_loaded(name)
        table = random_poses(machine, count)
        nominal, joints, poses, commanded = [], [], [], []
        sources = [s for s in acting(machine, condition) if s.name not in c.left_out]
        for block in PoseRun(machine, table, condition):
            deviations = [source.deviation(machine, condition, block) for source in sources]
            shift = sum_deviations([(d.parameters, d.shift) for d in deviations])
            requested = block.requested[block.indices]
            found, _, status = machine.kernel.corrected(requested, *shift)
            usable = status == 0
            nominal.append(block.joints[usable])
            joints.append(found[usable])
            poses.append(machine.kernel.pose_of(block.placements)[usable])
            commanded.append(requested[usable])
        self.nominal, self.joints = np.concatenate(nominal), np.concatenate(joints)
        self.poses = in_full(machine, np.concatenate(poses), machine.dof)
        # From 5 mm and 0.02 rad away, as after a lost cycle or two.
        moved = [0.005 if f in "xyz" else 0.02 for f in machine.dof]
        starts = in_full(machine, np.concatenate(poses) + moved, machine.dof)
        wanted = in_full(machine, np.concatenate(commanded), machine.commanded)
        self.c: Answers = driver(c, folder, flags)(wanted, starts, kelvin, wrench)
        self.angles = [FREEDOMS.index(f) for f in machine.dof if f in "abc"]
        self.lengths = [FREEDOMS.index(f) for f in machine.dof if f in "xyz"]


@exported
@pytest.mark.parametrize(
    ("flags", "close", "count"),
    [
        (EXACT, 1e-12, POSES // 50),
        pytest.param(EXACT, 1e-12, POSES, marks=sweep),
        pytest.param(FUSED, 1e-11, POSES // 10, marks=sweep),
    ],
    ids=["exact", "exact-at-many", "fused"],
)
def test_c_is_the_kernel_hot_and_loaded(
    name: str, flags: tuple[str, ...], close: float, count: int, builds: Path
) -> None:
    both = Both(name, builds, flags, count)
    c = both.c
    assert len(both.nominal) > 0.5 * count
    assert (c.status == 0).all()
    size = np.abs(both.nominal).max()
    assert np.abs(c.nominal - both.nominal).max() <= close * size
    assert np.abs(c.joints - both.joints).max() <= close * size
    # The shifts are there at all.
    assert np.abs(both.joints - both.nominal).max() > 1e-5
    assert (c.found == 0).all()
    assert np.abs(c.back - both.poses)[:, both.lengths].max() <= close * machine_size(name)
    turned = np.abs(c.back - both.poses)[:, both.angles]
    assert turned.size == 0 or turned.max() <= 10 * close
    assert c.steps.max() <= 30


def machine_size(name: str) -> float:
    """m: the largest of what a machine measures."""
    return float(np.abs(machine_of(name).nominal).max())


@exported
def test_forward_from_home_is_the_kernels(name: str, builds: Path) -> None:
    machine, c = machine_of(name), program(name)
    table = random_poses(machine, 300)
    joints, status = machine.inverse(table, status=True)
    table = table[status == 0]
    expected, kernel_status = machine.forward(joints[status == 0], status=True)
    home = np.tile(np.array(machine.kernel.control["home"]), (len(table), 1))
    kelvin = np.full(max(len(c.temperature_parts), 1), 293.15)
    wanted = in_full(machine, table, machine.commanded)
    found = driver(c, builds, EXACT)(wanted, home, kelvin, np.zeros(6))
    assert (found.found == kernel_status).all()
    good = kernel_status == 0
    assert good.mean() > 0.9
    there = in_full(machine, expected, machine.dof)
    assert np.abs(found.back - there)[good].max() < 1e-11 * max(1.0, machine_size(name))
    assert found.steps.max() < c.most_steps


NOT_FINITE = 7
IN_C = [
    "ok",
    "out_of_travel",
    "joint_limit",
    "unreachable",
    "singular",
    "not_converged",
    "branch_lost",
]


@exported
def test_a_pose_that_cannot_be_used_has_the_kernels_status(name: str, builds: Path) -> None:
    """Poses of a box three times the workspace: many are out of travel, reach or joint limits."""
    machine, c = machine_of(name), program(name)
    table = random_poses(machine, 1000)
    centre = table.mean(axis=0)
    table = centre + 3.0 * (table - centre)
    expected = machine.inverse(table, status=True)[1]
    kelvin = np.full(max(len(c.temperature_parts), 1), 293.15)
    wanted = in_full(machine, table, machine.commanded)
    # Without heat and load compensated joints are the nominal ones.
    nominal = program_of(machine, without=(*WITHOUT.get(name, ()), *ALWAYS.get(name, ())))
    found = driver(nominal, builds, EXACT)(wanted, wanted, kelvin, np.zeros(6)).status
    names = [_kernel.STATUS[code] for code in expected]
    assert [IN_C[code] for code in found] == names
    assert len(set(names)) > 1


@in_part
def test_arm_takes_it_without_a_warning(name: str, builds: Path) -> None:
    compiled(program(name), builds, ["-O1"], to="object", by="arm-linux-gnueabihf-gcc")


@sweep
@in_part
def test_sanitizers_find_nothing(name: str, tmp_path: Path) -> None:
    """Good poses, far ones, and numbers that are none, under address and undefined sanitizers."""
    c, machine = program(name), machine_of(name)
    rows = [*in_full(machine, random_poses(machine, 20), machine.commanded).tolist()]
    rows += [[50.0] * 6, [0.0] * 6]
    text = ",".join("{" + ",".join(map(repr, row)) + "}" for row in rows)
    p, upper = c.prefix, c.prefix.upper()
    more = f"""
#include <stdio.h>
static const double poses[][6] = {{{text}}};
int main(void)
{{
    const double none[] = {{0.0, -0.0, 1e300, -1e300, 1e-300, NAN, INFINITY}};
    {p}_machine machine;
    unsigned i, k;
    int bad = 0;
    {p}_init(&machine);
    for (i = 0; i < sizeof poses / sizeof poses[0] + 7; i++) {{
        double T[{max(len(c.temperature_parts), 1)}], w[6], q[{upper}_JOINTS] = {{0.0}}, pose[6];
        int steps;
        for (k = 0; k < 6; k++) {{
            pose[k] = i < 7 ? none[i] : poses[i - 7][k];
            w[k] = i < 7 ? none[i] : 10.0;
        }}
        for (k = 0; k < sizeof T / sizeof T[0]; k++)
            T[k] = i < 7 ? none[6 - i] : 300.0;
        if ({p}_compensate(&machine, pose, T, w, q) < 2)
            for (k = 0; k < {upper}_JOINTS; k++)
                bad += !(fabs(q[k]) < HUGE_VAL);
        if (i < 7)
            for (k = 0; k < {upper}_JOINTS; k++)
                q[k] = none[i];
        if ({p}_forward(&machine, q, pose, &steps) == {upper}_OK)
            for (k = 0; k < 6; k++)
                bad += !(fabs(pose[k]) < HUGE_VAL);
        bad += steps > {upper}_MOST_STEPS;
        {p}_forward(&machine, q, pose, 0);
    }}
    printf("%d\\n", bad);
    return 0;
}}
"""
    (tmp_path / f"{p}.h").write_text(c.header)
    (tmp_path / "main.c").write_text(c.source + more)
    flags = ["-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    command = [compiler(), *STRICT, *flags, "main.c", "-o", "main", "-lm"]
    subprocess.run(command, check=True, cwd=tmp_path)
    done = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "0\n"


@pytest.mark.parametrize("flags", [["-O0"], ["-O2"]])
@pytest.mark.parametrize(
    "name",
    thinned(
        ["planar_two_slider", "hexapod", "linear_delta", "tricept", "overconstrained"],
        OF_EACH_KIND,
    ),
)
@pytest.mark.parametrize("by", ["gcc", "arm-linux-gnueabihf-gcc"])
def test_the_stack_stated_is_enough(name: str, flags: list[str], by: str, builds: Path) -> None:
    """All functions' frames together, which is more than any chain of calls can take."""
    c = program(name)
    made = compiled(c, builds, [*flags, "-fstack-usage"], to="object", by=by)
    usage = made.with_suffix(".su").read_text()
    frames = [line.split("\t") for line in usage.splitlines()]
    assert {kind for *_, kind in frames} <= {"static", "dynamic,bounded"}
    stated = re.search(r"(\d+) bytes of stack", c.header)
    assert stated is not None
    taken = sum(int(size) for _, size, _ in frames)
    assert 0 < taken <= int(stated[1])


def test_nothing_is_kept_between_calls() -> None:
    """No object of static storage that is not constant, no heap, no recursion."""
    for name in ("planar_two_slider", "linear_delta"):
        source = program(name).source
        declared = re.findall(r"(?m)^\s*static (?!const )[^(]*[;=]", source)
        assert declared == []
        assert not re.search(r"\b(malloc|calloc|free|alloca)\b", source)


def test_a_tolerance_that_is_known_is_in_it() -> None:
    """Shifts that hold always are compensated: here an asymmetric tolerance."""
    machine = tp.load(
        "machines/planar_two_slider.toml", settings=["strut.1.length_tolerance=[0.1, 0.3]"]
    )
    assert re.search(r"p\[6\]|v6 \+ 0\.0002", program_of(machine).source)


@exported
def test_one_number_that_is_none_is_refused(name: str, builds: Path) -> None:
    """At each place of temperatures, wrench and pose by itself, and of the joints."""
    c, machine = program(name), machine_of(name)
    pose = in_full(machine, random_poses(machine, 1), machine.commanded)
    good = np.full(max(len(c.temperature_parts), 1), 300.0), np.full(6, 10.0)
    home = np.array(machine.kernel.control["home"])[np.newaxis]
    run = driver(c, builds, EXACT)
    for bad in (np.nan, np.inf):
        for place in range(len(c.temperature_parts)):
            kelvin = good[0].copy()
            kelvin[place] = bad
            found = run(pose, home, kelvin, good[1])
            assert found.status[0] == NOT_FINITE
            assert np.isnan(found.joints).all()
            assert np.isnan(found.nominal).all()
        for place in range(6):
            wrench = good[1].copy()
            wrench[place] = bad
            assert run(pose, home, good[0], wrench).status[0] == NOT_FINITE
            nowhere = pose.copy()
            nowhere[0, place] = bad
            found = run(nowhere, home, good[0], good[1])
            assert found.status[0] == NOT_FINITE


def test_sources_that_no_controller_can_follow_are_refused_all_at_once() -> None:
    machine = machine_of("hexapod_all_sources")
    without = WITHOUT["hexapod_all_sources"]
    with pytest.raises(RequestError) as refusal:
        controllers.export(machine, "c")
    problems = refusal.value.problems
    assert {str(p.found).split()[2] for p in problems} == set(without)
    # One answer for all of them, not one a try.
    assert {p.hint for p in problems} == {problems[0].hint}
    assert set(without) == set(str(problems[0].hint).split("without=")[1].split(";")[0].split(","))
    given = controllers.export(machine, "c", {"without": ", ".join(without)})
    assert any("left out" in line for line in given.statement)
    assert "Left out, and not compensated: loads" in given.files["hexapod_all_sources.h"]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (
            "travel = [0, 900]",
            'travel = [0, 900]\nbacklash = { play = "40 um", threshold = "10 N" }',
        ),
        ('name = "1"', 'name = "1"\nplatform_joint = { clearance = "20 um" }'),
    ],
)
def test_play_that_a_force_presses_is_refused(old: str, new: str, tmp_path: Path) -> None:
    """Nothing presses it where no force acts: the shift is zero there, and no constant."""
    text = (MACHINE_FOLDER / "planar_two_slider.toml").read_text()
    assert old in text
    file = tmp_path / "play.toml"
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(RequestError) as refusal:
        controllers.export(tp.load(file), "c")
    assert "follows from the wrench" in str(refusal.value)


def test_a_law_is_not_believed_of_one_pose(tmp_path: Path) -> None:
    """A workspace of one pose makes everything constant: poses about it are asked as well."""
    text = (MACHINE_FOLDER / "hexapod_all_sources.toml").read_text()
    file = tmp_path / "one.toml"
    head, _, rest = text.partition("[workspace]")
    after = rest[rest.index("\n[") :] if "\n[" in rest else ""
    file.write_text(f"{head}[workspace]\nposes = [[0, 0, 660, 0, 0, 0]]\n{after}")
    with pytest.raises(RequestError) as refusal:
        controllers.export(tp.load(file), "c", {"without": "backlash,clearance,screw_coupling"})
    assert "the source loads follows from the pose" in str(refusal.value)


def test_a_shift_out_of_proportion_to_the_heat_is_refused() -> None:
    def bending(block: PoseBlock) -> Deviation:
        return Deviation.of([6], 1e-7 * block.condition.temperature_rise("strut.1") ** 2)

    machine = with_sources(machine_of("planar_two_slider"), MadeSource("bending", of_block=bending))
    with pytest.raises(RequestError) as refusal:
        program_of(machine)
    (problem,) = refusal.value.problems
    assert problem.found == "the source bending is not in proportion to the temperature"


@pytest.mark.parametrize(
    "name", thinned(["planar_two_slider", "hexapod", "hexaglide", "hexapod_telescope"])
)
def test_both_ways_to_compensated_joints_agree(name: str, builds: Path) -> None:
    """In one go, and with pivoting, which is for poses where the order of home does not serve."""
    c, machine = program(name), machine_of(name)
    assert c.source.count("growth < 100.0") == 1
    pivoting = dataclasses.replace(c, source=c.source.replace("growth < 100.0", "growth < 0.0"))
    _, kelvin, wrench = hot_and_loaded(name)
    poses = in_full(machine, random_poses(machine, 500), machine.commanded)
    straight, other = (
        driver(each, builds, EXACT)(poses, poses, kelvin, wrench) for each in (c, pivoting)
    )
    assert (straight.status == other.status).all()
    assert (straight.status == 0).mean() > 0.5
    usable = straight.status == 0
    size = np.abs(straight.joints[usable]).max()
    assert np.abs(straight.joints - other.joints)[usable].max() <= 1e-12 * size
    assert np.abs(straight.joints - straight.nominal)[usable].max() > 1e-5


def test_what_is_left_out_is_said_whatever_the_condition() -> None:
    machine = machine_of("hexapod").with_condition(
        machine_of("hexapod").condition.replace(temperature=293.15, force=(0, 0, 0))
    )
    given = controllers.export(machine, "c", ["without=thermal,elastic"])
    assert given.statement[0] == "left out, and not compensated: thermal, elastic"
    assert "Left out, and not compensated: thermal, elastic." in given.files["hexapod.h"]


def test_an_option_given_twice_is_refused() -> None:
    with pytest.raises(RequestError) as refusal:
        controllers.export(machine_of("hexapod"), "c", ["without=thermal", "without=elastic"])
    assert "twice" in str(refusal.value)


@pytest.mark.parametrize(
    ("stem", "names"),
    [("math", ("1", "2")), ("a b-ü", ("a", "A")), ("x", ("ä", "ö")), ("trigraph", ("q??/", "2"))],
)
def test_odd_names_compile(stem: str, names: tuple[str, str], tmp_path: Path, builds: Path) -> None:
    text = (MACHINE_FOLDER / "planar_two_slider.toml").read_text()
    for old, new in zip(("1", "2"), names, strict=True):
        text = text.replace(f'[[strut]]\nname = "{old}"', f'[[strut]]\nname = "{new}"')
    file = tmp_path / f"{stem}.toml"
    file.write_text(text.replace('name = "Planar two-slider PKM"', 'name = "what?? */ /* ??/"'))
    c = program_of(tp.load(file))
    compiled(c, builds, ["-O0", "-I."], to="object")
    words = re.findall(r"define (\S+_TEMPERATURE_\S+) ", c.header)
    assert len(set(words)) == 2


def test_a_source_that_is_not_there_is_refused() -> None:
    with pytest.raises(RequestError) as refusal:
        controllers.export(machine_of("hexapod"), "c", ["without=thermall"])
    problem = refusal.value.problems[0]
    assert (problem.code, problem.hint) == ("bad-option", 'did you mean "thermal"?')


def test_an_option_that_is_not_there_is_refused() -> None:
    with pytest.raises(RequestError) as refusal:
        controllers.export(machine_of("hexapod"), "c", ["witout=thermal", "x"])
    assert [p.code for p in refusal.value.problems] == ["bad-option", "bad-option"]
    assert refusal.value.problems[0].hint == 'did you mean "without"?'


def test_a_controller_that_is_not_there_is_refused() -> None:
    with pytest.raises(RequestError) as refusal:
        controllers.export(machine_of("hexapod"), "cc")
    assert refusal.value.problems[0].code == "unknown-controller"
