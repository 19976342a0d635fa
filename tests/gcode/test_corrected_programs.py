"""Corrected programs: the actual machine, driven by what was written, follows the program.

Both the program and what was written for it are read by LinuxCNC's own interpreter where it is
installed, and else by ours. The tool is followed closely, pose by pose, through
`truepose.compensation.commands`, and compared with the programmed path as a curve: how far off it
is, not how far off at some share of a block. Nothing of the division or its proof is used.
"""

from __future__ import annotations

import math
import struct
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

import truepose as tp
from build_machine import MACHINES, machine_files
from made_source import MadeSource, with_sources
from sweeps import thinned
from system_package import missing
from truepose import _kernel
from truepose.compensation.commands import actual_of_joints, actual_poses
from truepose.controllers.gcode import correct
from truepose.controllers.gcode._axes import Axes
from truepose.controllers.gcode.correct import correct_program
from truepose.controllers.gcode.proof import Proof
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.sources import Deviation, PoseBlock

TOLERANCE = 5e-6
SYSTEM_PYTHON = Path("/usr/bin/python3")
READ_BY_LINUXCNC = Path(__file__).with_name("linuxcnc_moves.py")

PLANAR_PART = """\
%
(a part for the planar machine)
N10 G21 G90 G17 G94
N20 G0 X250 Y150 Z5 ; above the corner
N30 G1 Z-1 F200
N40 G1 X350 Y150 F1500 (along the bottom)
N50 G3 X370 Y170 I0 J20
N60 G1 Y220
N70 G2 X330 Y260 R40 Z-2
G91
N80 G1 X-40 Y-20
X-10 Y-15
X-0.5 Y0.25 M8
G90
N90 G3 X230 Y200 R60
M5
G0 Z20
%
"""

HEXAPOD_PART = """\
G21 G90 G94 G40 G49
G0 X-40 Y-30 Z500 A0 B0 C0
G1 Z490 F600
X40 (the long side)
G2 X60 Y-10 I0 J20
G1 Y30 A4 B-3 C2
A-4 F300
G93 G1 X0 Y0 B5 F4
G94 G3 X0 Y0 Z480 I15 J5 F800
G20
G1 X-1 Y0.5 F20
G91 X0.25 Y-0.125 Z0.1
G21 G90 G0 X0 Y0 Z500 A0 B0 C0
M2
"""


@dataclass(frozen=True)
class Path9:
    """Blocks as they were read: ends (n, 9) mm and degrees, whether each is at feed, fine points.

    `fine[i]` (m, 9): the path of block i, its begin left out.
    """

    ends: np.ndarray
    feed: np.ndarray
    lines: np.ndarray
    fine: list[np.ndarray]


Read = Callable[[Path, Machine], Path9]


def read_here(program: Path, machine: Machine) -> Path9:
    """With the interpreter of this project."""
    axes = Axes(machine)
    reader = _kernel.GcodeReader(program, start=axes.home(), axes=axes.names)
    moves = reader.read(10**6)
    share = np.linspace(0.0, 1.0, 2001)[1:]
    fine = [moves.points(np.full(2000, number), share) for number in range(len(moves))]
    return Path9(moves.end, moves.kind != 0, moves.line, fine)


def read_by_linuxcnc(program: Path, machine: Machine) -> Path9:
    """With LinuxCNC's interpreter, and arcs made of its centres and turns."""
    if (
        not SYSTEM_PYTHON.exists()
        or subprocess.run(
            [SYSTEM_PYTHON, "-c", "import gcode"], capture_output=True, check=False
        ).returncode
    ):
        missing("LinuxCNC's interpreter (Debian: linuxcnc-uspace) is not installed")
    parameters = program.with_suffix(".var")
    parameters.write_text("".join(f"{number}\t0.0\n" for number in PARAMETERS), encoding="ascii")
    done = subprocess.run(
        [SYSTEM_PYTHON, READ_BY_LINUXCNC, parameters],
        input=f"{program}\n".encode(),
        capture_output=True,
        check=True,
    )
    numbers = np.array(struct.unpack(f"{len(done.stdout) // 8}d", done.stdout))
    count, failed = int(numbers[0]), int(numbers[1])
    assert failed == 0, done.stderr.decode()
    rows = numbers[2:].reshape(count, 15)
    home = np.zeros(9)
    for letter, value in Axes(machine).home().items():
        home["XYZABCUVW".index(letter)] = value
    begins = np.vstack([home, rows[:-1, 3:12]])
    fine = [_fine(begin, row) for begin, row in zip(begins, rows, strict=True)]
    return Path9(rows[:, 3:12], rows[:, 2] > 0, rows[:, 0].astype(int), fine)


PARAMETERS = [5161, 5181, 5210, 5211, 5220, *range(5221, 5231), *range(5241, 5251)]


def _fine(begin: np.ndarray, row: np.ndarray) -> np.ndarray:
    share = np.linspace(0.0, 1.0, 2001)[1:, np.newaxis]
    end = row[3:12]
    points = begin + (end - begin) * share
    plane, centre, turns = int(row[1]), row[12:14], int(row[14])
    if plane:
        u, v = {17: (0, 1), 18: (2, 0), 19: (1, 2)}[plane]
        first = math.atan2(begin[v] - centre[1], begin[u] - centre[0])
        last = math.atan2(end[v] - centre[1], end[u] - centre[0])
        sweep = last - first
        if turns > 0:
            sweep += 2.0 * math.pi * ((sweep <= 1e-9) + turns - 1)
        else:
            sweep -= 2.0 * math.pi * ((sweep >= -1e-9) - turns - 1)
        radius = math.hypot(begin[u] - centre[0], begin[v] - centre[1])
        angle = first + sweep * share[:, 0]
        points[:, u] = centre[0] + radius * np.cos(angle)
        points[:, v] = centre[1] + radius * np.sin(angle)
    return points


READERS: dict[str, Read] = {"here": read_here, "linuxcnc": read_by_linuxcnc}


@pytest.fixture(params=READERS)
def read(request: pytest.FixtureRequest) -> Read:
    return READERS[request.param]


def hot(name: str) -> Machine:
    machine = tp.load(MACHINES / f"{name}.toml")
    warm = machine.condition.reference_temperature + 25.0
    return machine.with_condition(
        machine.condition.replace(temperature=warm, force=(300.0, 200.0, -150.0))
    )


def written(folder: Path, text: str, machine: Machine, **options: object) -> tuple[Path, Proof]:
    """The corrected program of a text, and its proof."""
    (folder / "part.ngc").write_text(text, encoding="utf-8", newline="")
    target = folder / "corrected.ngc"
    return target, correct_program(machine, folder / "part.ngc", target, **options)  # type: ignore[arg-type]


def followed(machine: Machine, program: Path9, *, joints: bool, after: int = 0) -> np.ndarray:
    """(k, n_commanded) where the actual tool goes at the feeds of a program beyond line `after`."""
    axes = Axes(machine)
    commands = axes.poses(program.ends)
    all_joints = machine.inverse(commands)
    t = np.linspace(0.0, 1.0, 12)
    found = []
    for block in range(1, len(commands)):
        if not program.feed[block] or program.lines[block] <= after:
            continue
        way = commands[block - 1] + np.outer(t, commands[block] - commands[block - 1])
        if joints:
            begin, end = all_joints[block - 1], all_joints[block]
            there, status = actual_of_joints(machine, begin + np.outer(t, end - begin), near=way)
        else:
            there, status = actual_poses(machine, way)
        assert not status.any()
        found.append(there)
    return np.concatenate(found)


def off_path(machine: Machine, tool: np.ndarray, program: Path9) -> np.ndarray:
    """(k,) m how far poses of the tool are off a program's feeds, an angle times the size.

    From the nearest of all chords of the programmed path, which are a thousandth of a block long.
    """
    axes = Axes(machine)
    length = machine.characteristic_length
    unit = np.array([1.0 if name in "xyz" else length for name in machine.commanded])
    chords = []
    begin = None
    for block, fine in enumerate(program.fine):
        points = axes.poses(fine) * unit
        if begin is not None and program.feed[block]:
            through = np.vstack([begin, points])
            chords.append(np.stack([through[:-1], through[1:]], axis=1))
        begin = points[-1:]
    table = np.concatenate(chords)
    # The nearest chord is one of the few whose middles are nearest.
    _, near = cKDTree(table.mean(axis=1)).query(tool * unit, k=8)
    start, along = table[near, 0], table[near, 1] - table[near, 0]
    from_start = (tool * unit)[:, np.newaxis] - start
    square = np.maximum((along**2).sum(axis=2), 1e-300)
    share = np.clip((from_start * along).sum(axis=2) / square, 0.0, 1.0)
    gaps = np.linalg.norm(from_start - along * share[:, :, np.newaxis], axis=2)
    return np.asarray(gaps.min(axis=1))


PARTS = {"planar_two_slider": PLANAR_PART, "hexapod": HEXAPOD_PART}


@pytest.mark.parametrize("interpolation", thinned(["pose", "either"], {"either"}))
@pytest.mark.parametrize("name", thinned(PARTS))
def test_the_actual_tool_follows_the_program(
    name: str, interpolation: str, read: Read, tmp_path: Path
) -> None:
    machine = hot(name)
    target, proof = written(tmp_path, PARTS[name], machine, interpolation=interpolation)
    programmed, corrected = read(tmp_path / "part.ngc", machine), read(target, machine)
    tool = followed(machine, corrected, joints=False)
    off = off_path(machine, tool, programmed)
    stated = max(
        proof.after.position.value if proof.after.position else 0.0,
        machine.characteristic_length
        * (proof.after.orientation.value if proof.after.orientation else 0.0),
    )
    assert stated <= TOLERANCE
    # Both kinds of error add up to the distance of a pose from the path.
    assert off.max() <= math.sqrt(2.0) * stated + 2e-9
    if interpolation == "either":
        off = off_path(machine, followed(machine, corrected, joints=True), programmed)
        assert off.max() <= math.sqrt(2.0) * TOLERANCE
    # The program as it was is far off, and every end of a block of it is passed.
    uncorrected = followed(machine, programmed, joints=False)
    assert off_path(machine, uncorrected, programmed).max() > 20.0 * TOLERANCE
    ends = Axes(machine).poses(programmed.ends[programmed.feed])
    gaps = np.abs(tool[:, np.newaxis] - ends).max(axis=2).min(axis=0)
    assert gaps.max() < 1e-7


@pytest.mark.parametrize("path", machine_files(), ids=lambda path: path.stem)
def test_every_machine_shipped(path: Path, tmp_path: Path) -> None:
    """Ten percent of the workspace along every freedom, about its middle."""
    machine = hot(path.stem)
    axes = Axes(machine)
    poses = machine.poses()
    middle, reach = poses.mean(axis=0), 0.1 * np.ptp(poses, axis=0)
    random = np.random.default_rng(6)
    at = middle + reach * random.uniform(-1.0, 1.0, (5, len(middle)))
    points = axes.with_poses(np.zeros((5, 9)), at)[:, axes.columns]
    words = [
        " ".join(f"{n}{v:.4f}" for n, v in zip(axes.names, row, strict=True)) for row in points
    ]
    text = "G21 G90 G94 F900\nG0 " + "\nG1 ".join(words) + "\n"
    target, proof = written(tmp_path, text, machine, interpolation="pose")
    for before, after in (
        (proof.before.position, proof.after.position),
        (proof.before.orientation, proof.after.orientation),
    ):
        assert (before is None) == (after is None)
        if before and after:
            assert after.value < 0.3 * before.value
    corrected = read_here(target, machine)
    joints = machine.inverse(axes.poses(corrected.ends))
    near = axes.poses(corrected.ends)
    there, status = actual_of_joints(machine, joints, near=near)
    assert not status.any()
    programmed = read_here(tmp_path / "part.ngc", machine)
    gaps = np.abs(there[:, np.newaxis] - axes.poses(programmed.ends)).max(axis=2).min(axis=0)
    assert gaps.max() < 2e-8


def test_the_proof_tells_the_errors_of_the_budget(tmp_path: Path) -> None:
    machine = hot("hexapod")
    text = "G21G90G94 F900\nG0 X10 Y20 Z500 A1 B2 C0\nG1 X10.5\nX11 Y20.5\nX11.5 Y21 B2.1\n"
    _, proof = written(tmp_path, text, machine)
    ends = np.array(
        [[10, 20, 500, 1, 2, 0], [10.5, 20, 500, 1, 2, 0], [11, 20.5, 500, 1, 2, 0],
         [11.5, 21, 500, 1, 2.1, 0]], np.float64
    )  # fmt: skip
    middles = 0.5 * (ends[1:] + ends[:-1])
    poses = np.concatenate([ends, middles])
    poses = poses * np.array([1e-3, 1e-3, 1e-3, *[math.pi / 180.0] * 3])
    errors = tp.budget(machine, poses).overall_error.values
    sizes = np.linalg.norm(errors[:, :3], axis=1), np.linalg.norm(errors[:, 3:], axis=1)
    assert proof.before.position
    assert proof.before.orientation
    assert proof.before.position.value == pytest.approx(sizes[0].max(), rel=1e-9)
    assert proof.before.orientation.value == pytest.approx(sizes[1].max(), rel=1e-9)
    at = poses[np.argmax(sizes[0])]
    assert np.allclose(proof.before.position.pose, at, rtol=0, atol=1e-12)
    assert (proof.moves, proof.blocks, proof.points) == (4, 4, 7)
    # The mean is over the path: every feed has its middle, known from its ends, and its end.
    lengths = np.array([0.5, math.hypot(0.5, 0.5), math.hypot(0.5, 0.5)])
    turns = np.array([0.0, 0.0, math.radians(0.1) * machine.characteristic_length * 1e3])
    weights = np.maximum(lengths, turns)
    mean = (weights * 0.5 * (sizes[0][1:4] ** 2 + sizes[0][4:] ** 2)).sum() / weights.sum()
    assert proof.before.position_rms == pytest.approx(math.sqrt(mean), rel=1e-6)


def test_the_proof_counts_what_joints_do_between_blocks(tmp_path: Path) -> None:
    """On straight lines, where a controller that goes straight in pose is hardly off at all."""
    machine = hot("planar_two_slider")
    text = "G21 G90 G94 F900\nG0 X230 Y130\nG1 X230.1\nX380 Y280\nX220\n"
    found = {}
    for interpolation in ("pose", "either"):
        target, proof = written(tmp_path, text, machine, interpolation=interpolation)
        assert proof.after.position
        found[interpolation] = proof.after.position.value
    programmed, corrected = (read_here(p, machine) for p in (tmp_path / "part.ngc", target))
    off = off_path(machine, followed(machine, corrected, joints=True), programmed)
    # What is stated counts along the path as well, where the tool is a little ahead or behind.
    assert off.max() == pytest.approx(found["either"], rel=0.05)
    assert found["either"] > 1.2 * found["pose"]


def test_what_moves_nothing_stays_as_it_is(tmp_path: Path) -> None:
    machine = hot("planar_two_slider")
    target, _ = written(tmp_path, PLANAR_PART, machine)
    lines = target.read_text(encoding="utf-8").splitlines()
    for line in ("%", "(a part for the planar machine)", "N10 G21 G90 G17 G94", "G91", "G90", "M5"):
        assert line in lines
    assert any(line.startswith("N40 ") and line.endswith("(along the bottom)") for line in lines)
    assert sum("F1500" in line for line in lines) == 1
    # Z is none of this machine's axes: where the program has it, it stays.
    assert any(line.startswith("N30 ") and "Z-1" in line and "F200" in line for line in lines)
    assert "G0 Z20" in lines
    assert not any(word in line for line in lines for word in ("G2 ", "G3 "))


def test_increments_do_not_drift(tmp_path: Path) -> None:
    machine = hot("planar_two_slider")
    steps = "".join(f"X{0.01 * (-1) ** (n // 300):.2f} Y0.0125\n" for n in range(3000))
    text = f"G21 G90 G94\nG0 X300 Y150\nG91 G1 F500\n{steps}"
    target, proof = written(tmp_path, text, machine, digits=4)
    corrected = read_here(target, machine)
    programmed = read_here(tmp_path / "part.ngc", machine)
    there, _ = actual_poses(machine, Axes(machine).poses(corrected.ends))
    gap = np.abs(there - Axes(machine).poses(programmed.ends)).max(axis=1)
    # Half of the last decimal on each of two axes, at the end as at the beginning.
    assert gap.max() < 1e-7
    assert proof.after.position
    assert proof.after.position.value < 1e-6


def test_inches_stay_inches(tmp_path: Path) -> None:
    machine = hot("planar_two_slider")
    text = "G20 G90 G94\nG0 X10 Y6\nG1 X12 Y8 F20\n"
    target, _ = written(tmp_path, text, machine)
    lines = target.read_text(encoding="utf-8").splitlines()
    assert lines[1] == "G20 G90 G94"
    last = lines[-1]
    assert 11.9 < float(last[last.index("X") + 1 :].split()[0].partition("Y")[0]) < 12.1
    programmed = read_here(tmp_path / "part.ngc", machine)
    assert programmed.ends[-1, 0] == pytest.approx(304.8, abs=1e-9)
    tool = followed(machine, read_here(target, machine), joints=False)
    assert off_path(machine, tool, programmed).max() <= TOLERANCE


def test_offsets_and_start(tmp_path: Path) -> None:
    machine = hot("planar_two_slider")
    text = "G21 G90 G94 G55\nG1 X0 F600\nY0\nX20 Y10\n"
    target, proof = written(
        tmp_path,
        text,
        machine,
        offsets={"g55": {"x": 0.3, "y": 0.2, "z": 0.01}},
        start={"y": 0.21},
    )
    assert proof.start == pytest.approx({"X": 300.0, "Y": 210.0}, rel=1e-12)
    assert proof.approach == 2
    reader = _kernel.GcodeReader(
        target, start={"X": 300, "Y": 210}, offsets={"G55": {"X": 300, "Y": 200}}, axes="XY"
    )
    ends = reader.read(10**6).end
    there, _ = actual_poses(machine, Axes(machine).poses(ends[-1:]))
    assert np.allclose(there, [[0.32, 0.21]], rtol=0, atol=1e-8)


def test_a_move_of_angles_alone_keeps_its_time(tmp_path: Path) -> None:
    machine = hot("hexapod")
    text = "G21 G90 G94\nG0 X0 Y0 Z500 A0 B0 C0\nG1 A5 F100\nX10\n"
    target, _ = written(tmp_path, text, machine)
    text = target.read_text(encoding="utf-8")
    timed = [line for line in text.splitlines() if line.startswith("G93") or "G93" in line]
    assert timed
    rates = [
        float(line[line.rindex("F") + 1 :])
        for line in text.partition("G93")[2].partition("G94")[0].splitlines()
        if "F" in line
    ]
    # 5 degrees at 100 degrees a minute.
    assert sum(1.0 / rate for rate in rates) == pytest.approx(0.05, rel=1e-6)
    assert "G94 F100" in text


def test_batches_make_no_difference(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = hot("hexapod")
    target, proof = written(tmp_path, HEXAPOD_PART, machine)
    whole = target.read_bytes()
    monkeypatch.setattr(correct, "BATCH", 3)
    target, again = written(tmp_path, HEXAPOD_PART, machine)
    assert target.read_bytes() == whole
    assert again.points == proof.points
    assert again.after.position
    assert proof.after.position
    assert again.after.position.value == pytest.approx(proof.after.position.value, rel=1e-6)
    assert again.after.position_rms == pytest.approx(proof.after.position_rms, rel=1e-6)


@pytest.mark.parametrize("count", [1, 2])
def test_threads_make_no_difference(
    count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = hot("planar_two_slider")
    target, proof = written(tmp_path, PLANAR_PART, machine)
    whole = target.read_bytes()
    before = tp.threads()
    turns = sys.getswitchinterval()
    monkeypatch.setattr(correct, "BATCH", 2)
    tp.threads(count)
    try:
        target, again = written(tmp_path, PLANAR_PART, machine)
    finally:
        tp.threads(before)
    assert target.read_bytes() == whole
    assert again.points == proof.points
    assert sys.getswitchinterval() == turns


def test_a_finer_tolerance_takes_more_blocks(tmp_path: Path) -> None:
    machine = hot("planar_two_slider")
    counts = []
    for tolerance in (50e-6, 5e-6, 0.5e-6):
        _, proof = written(tmp_path, PLANAR_PART, machine, tolerance=tolerance)
        assert proof.after.position
        assert proof.after.position.value <= tolerance
        counts.append(proof.blocks)
    _, proof = written(tmp_path, PLANAR_PART, machine, interpolation="pose")
    assert proof.blocks < counts[1] < counts[2]
    assert counts[0] < counts[1]
    # The deviation grows with the square of the length.
    assert counts[2] / counts[1] == pytest.approx(math.sqrt(10.0), rel=0.3)


def refused(folder: Path, text: str, machine: Machine, **options: object) -> tuple[str, int | None]:
    """Code and line of the only problem; nothing is left behind."""
    with pytest.raises(RequestError) as failure:
        written(folder, text, machine, **options)
    (problem,) = failure.value.problems
    assert problem.file == str(folder / "part.ngc")
    assert [path.name for path in folder.iterdir()] == ["part.ngc"]
    return problem.code, problem.line


HEAD = "G21 G90 G94 F900\nG0 X300 Y200\n"


@pytest.mark.parametrize(
    ("lines", "code", "line"),
    [
        ("G1 X310\n\nX700 (far out)\n", "gcode-pose", 5),
        ("G1 X310\nG0 X700\n", "gcode-pose", 4),
        ("G1 Y560\n", "gcode-pose", 3),
        ("G1 X310\nG1 X#1\n", "gcode-parameters", 4),
        ("G1 X\n", "gcode-no-number", 3),
        ("G2 X310 Y200 I20 J0\n", "gcode-arc", 3),
        ("G81 X310 Y200 Z-5 R2\n", "gcode-unsupported", 3),
        ("G41 D1\n", "gcode-unsupported", 3),
    ],
)
def test_what_cannot_be_done_is_refused(lines: str, code: str, line: int, tmp_path: Path) -> None:
    assert refused(tmp_path, HEAD + lines, hot("planar_two_slider")) == (code, line)


def test_the_column_of_a_program_is_told(tmp_path: Path) -> None:
    with pytest.raises(RequestError) as failure:
        written(tmp_path, HEAD + "G1 X310 Y\n", hot("planar_two_slider"))
    (problem,) = failure.value.problems
    assert (problem.line, problem.column) == (3, 9)
    assert str(problem).startswith(f"{tmp_path / 'part.ngc'}:3:9: error[gcode-no-number]")


def test_a_pose_off_reach_is_explained(tmp_path: Path) -> None:
    with pytest.raises(RequestError) as failure:
        written(tmp_path, HEAD + "G1 X700\n", hot("planar_two_slider"))
    (problem,) = failure.value.problems
    assert problem.found is not None
    assert "strut 1 misses by" in problem.found
    assert problem.found.startswith("X")


def test_what_the_platform_cannot_be_asked_for(tmp_path: Path) -> None:
    """The 3-PRS moves in X by itself, as its orientation asks for; a program cannot."""
    machine = hot("3prs")
    home = Axes(machine).home()
    good = f"G21 G90 G94 F900\nG0 Z{home['Z']} A0 B0\nG1 Z{home['Z'] + 5}\n"
    _, proof = written(tmp_path, good, machine)
    assert proof.moves == 2
    (tmp_path / "corrected.ngc").unlink()
    assert refused(tmp_path, good + "X5\n", machine) == ("gcode-axis", 4)


def test_the_proof_is_of_the_rounded_numbers_in_the_file(tmp_path: Path) -> None:
    machine = hot("planar_two_slider")
    angle = np.linspace(0.0, 3.0, 300)
    at = np.column_stack([300.0 + 20.0 * np.cos(angle), 200.0 + 20.0 * np.sin(angle)])
    text = "G21 G90 G94 F900\nG0 X320 Y200\nG1\n" + "".join(f"X{x:.4f} Y{y:.4f}\n" for x, y in at)
    found = []
    for digits in (8, 3):
        _, proof = written(tmp_path, text, machine, digits=digits, interpolation="pose")
        assert proof.after.position
        assert proof.after.position_rms
        found.append((proof.after.position.value, proof.after.position_rms))
    assert found[0][0] < 2e-9
    # Half of the last decimal on both axes; on the mean a third of that square at the ends, and
    # half of that again in the middles.
    step = 0.5e-6
    assert found[1][0] == pytest.approx(math.sqrt(2.0) * step, rel=0.1)
    assert found[1][1] == pytest.approx(step * math.sqrt(2.0 / 3.0 * 0.75), rel=0.1)


def test_too_few_digits_are_found_out(tmp_path: Path) -> None:
    found = refused(tmp_path, PLANAR_PART, hot("planar_two_slider"), digits=1)
    assert found[0] == "gcode-proof"


def test_options_that_are_none(tmp_path: Path) -> None:
    machine = hot("planar_two_slider")
    for options in (
        {"tolerance": 0.0},
        {"tolerance": math.nan},
        {"interpolation": "cubic"},
        {"units": "yard"},
        {"digits": 12},
        {"start": {"q": 0.0}},
        {"start": {"x": math.inf}},
        {"offsets": {"g60": {"x": 0.0}}},
        {"offsets": {"g54": {"k": 0.0}}},
    ):
        with pytest.raises(RequestError) as failure:
            written(tmp_path, HEAD, machine, **options)  # type: ignore[arg-type]
        assert [problem.code for problem in failure.value.problems] == ["bad-correction"]
    with pytest.raises(RequestError) as failure:
        written(tmp_path, HEAD, machine, start={"x": 5.0})
    assert failure.value.problems[0].code == "gcode-start"


def test_files_that_are_none(tmp_path: Path) -> None:
    machine = hot("planar_two_slider")
    part = tmp_path / "part.ngc"
    part.write_text(HEAD, encoding="utf-8")
    link = tmp_path / "link.ngc"
    link.symlink_to(part)
    for source, target, code in (
        (tmp_path / "none.ngc", tmp_path / "out.ngc", "file-missing"),
        (tmp_path, tmp_path / "out.ngc", "file-is-directory"),
        (part, part, "output-is-input"),
        (part, link, "output-is-input"),
        (part, tmp_path / "none" / "out.ngc", "output-not-writable"),
        (part, tmp_path, "output-not-writable"),
    ):
        with pytest.raises(RequestError) as failure:
            correct_program(machine, source, target)
        assert failure.value.problems[0].code == code
    assert part.read_text(encoding="utf-8") == HEAD
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.ngc", "part.ngc"]


def test_bytes_that_are_no_text(tmp_path: Path) -> None:
    (tmp_path / "part.ngc").write_bytes(b"G21\n\x7fELF\x02\x01\x00\n")
    with pytest.raises(RequestError) as failure:
        correct_program(hot("planar_two_slider"), tmp_path / "part.ngc", tmp_path / "out.ngc")
    problem = failure.value.problems[0]
    assert (problem.code, problem.line) == ("gcode-not-text", 2)


@pytest.mark.parametrize("stands", [False, True])
def test_an_interrupted_run_leaves_what_stood_there(
    stands: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = hot("planar_two_slider")
    monkeypatch.setattr(correct, "BATCH", 2)
    target = tmp_path / "corrected.ngc"
    if stands:
        target.write_text("what stood here", encoding="utf-8")
    seen = []

    def interrupt(done: int, total: int) -> None:
        seen.append((done, total))
        if len(seen) == 3:
            assert len(list(tmp_path.iterdir())) == 2 + stands, "nothing was being written"
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        written(tmp_path, PLANAR_PART, machine, progress=interrupt)
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"part.ngc"} | ({"corrected.ngc"} if stands else set())
    if stands:
        assert target.read_text(encoding="utf-8") == "what stood here"
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    assert all(0 < done <= PLANAR_PART.count("\n") and not total for done, total in seen)


def test_a_turn_that_the_controller_would_time_wrongly_is_refused(tmp_path: Path) -> None:
    """In feed per revolution there is no time that the pieces could be given instead."""
    text = "G21 G90 G95 F0.1 S100\nG0 X0 Y0 Z500 A0 B0 C0\nG1 A4\n"
    assert refused(tmp_path, text, hot("hexapod")) == ("gcode-division", 3)


def test_a_machine_of_which_nothing_is_known_is_refused(tmp_path: Path) -> None:
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    machine = with_sources(machine)
    with pytest.raises(RequestError) as failure:
        written(tmp_path, HEAD, machine)
    assert failure.value.problems[0].code == "no-source"


def test_a_program_that_moves_nothing_is_passed_on(tmp_path: Path) -> None:
    text = "(nothing)\nG21\nM2\n"
    target, proof = written(tmp_path, text, hot("hexapod"))
    heading, _, rest = target.read_text(encoding="utf-8").partition("\n")
    assert heading.startswith("(truepose for ")
    assert rest == text
    assert (proof.moves, proof.blocks, proof.points, proof.approach) == (0, 0, 0, None)
    assert proof.before.position is None
    assert proof.after.position_rms is None


def test_rapids_alone_have_no_mean(tmp_path: Path) -> None:
    _, proof = written(tmp_path, "G21 G90\nG0 X300 Y200\nG0 X310\n", hot("planar_two_slider"))
    assert proof.after.position
    assert proof.after.position.value < 1e-8
    assert proof.after.position_rms is None


def test_a_jump_within_a_move_is_refused(tmp_path: Path) -> None:
    """As of a play whose load changes its sign: however it is divided, half the jump is left."""
    base = tp.load(MACHINES / "planar_two_slider.toml")

    def jumping(block: PoseBlock) -> Deviation:
        side = np.where(block.placements[:, :1] < 0.3, 2e-5, -2e-5)
        return Deviation.of(base.kernel.length_parameters, np.hstack([side, side]))

    machine = with_sources(base, MadeSource("jumping", of_block=jumping))
    text = "G21 G90 G94 F900\nG0 X280 Y200\nG1 X290\n\nX310\n"
    with pytest.raises(RequestError) as failure:
        written(tmp_path, text, machine)
    (problem,) = failure.value.problems
    assert (problem.code, problem.line) == ("gcode-tolerance", 5)
    assert problem.found is not None
    assert "near X300" in problem.found


def test_a_way_through_a_singularity_is_refused(tmp_path: Path) -> None:
    """Turned far enough, the struts of the 3-RRR meet in a point."""
    machine = hot("3rrr")
    x, y = 1e3 * machine.poses()[:, :2].mean(axis=0)
    turns = "".join(f"C{angle}\n" for angle in range(5, 170, 5))
    text = f"G21 G90 G94\nG0 X{x:.3f} Y{y:.3f} C0\nG1 F900\n{turns}"
    code, line = refused(tmp_path, text, machine, interpolation="pose")
    assert code == "gcode-singularity"
    assert line is not None
    assert line > 4
    # Up to that line all is well.
    good = "".join(text.splitlines(keepends=True)[: line - 2])
    written(tmp_path, good, machine, interpolation="pose")
