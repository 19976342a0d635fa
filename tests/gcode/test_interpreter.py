"""Our reading of programs against LinuxCNC's, and what is refused.

`TRUEPOSE_GCODE_PROGRAMS` sets how many random programs are compared: 100000 take two minutes.
"""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
import threading
from collections.abc import Iterable
from pathlib import Path
from random import Random

import numpy as np
import pytest

from gcode import linuxcnc
from gcode.random_programs import SYSTEMS, Programs, mutated, soup
from sweeps import sweep, thinned
from system_package import missing
from truepose import _kernel

RS274 = Path("/usr/bin/rs274")
CORPUS = Path(__file__).with_name("corpus")
FILES = sorted(CORPUS.glob("*.ngc"))
SEED = 20_240
PROGRAMS = int(os.environ.get("TRUEPOSE_GCODE_PROGRAMS", "5000"))
# Offsets of the programs; the first system without, because programs start at its origin.
_DRAW = Random(SEED)  # noqa: S311
OFFSETS = {name: [round(_DRAW.uniform(-50, 50), 3) for _ in range(9)] for name in SYSTEMS}
OFFSETS["G54"] = [0.0] * 9
FIRST = [round(_DRAW.uniform(-50, 50), 3) for _ in range(9)]
ASKS_FOR_TOOLS = {"tools"}  # which LinuxCNC's Python module crashes on, but rs274 does not


def written(texts: Iterable[str], folder: Path) -> list[Path]:
    paths = []
    for number, text in enumerate(texts):
        path = folder / f"{number}.ngc"
        path.write_bytes(text.encode())
        paths.append(path)
    return paths


def compare(texts: list[str], folder: Path, offsets: linuxcnc.Offsets) -> list[str]:
    """What differs between the two readings of valid programs."""
    wrong = []
    paths = written(texts, folder)
    for text, path, theirs in zip(
        texts, paths, linuxcnc.theirs(paths, folder, offsets), strict=True
    ):
        ours = linuxcnc.ours(path, offsets)
        found = ours.error or theirs.error
        found = found or linuxcnc.difference(text, ours.moves, theirs.moves, offsets)
        if found:
            wrong.append(f"{found}\n{text}")
    return wrong


def test_corpus_makes_linuxcnc_s_moves(tmp_path: Path) -> None:
    linuxcnc.require()
    assert len(FILES) >= 60
    texts = [path.read_bytes().decode() for path in FILES if path.stem not in ASKS_FOR_TOOLS]
    assert compare(texts, tmp_path, OFFSETS) == []


@pytest.mark.parametrize("seed", thinned(range(2)))
def test_random_programs_make_linuxcnc_s_moves(seed: int, tmp_path: Path) -> None:
    linuxcnc.require()
    offsets = (OFFSETS, {**OFFSETS, "G54": FIRST})[seed]
    programs = Programs(SEED + seed, offsets)
    for _ in range(0, PROGRAMS // 2, 10_000):
        count = min(PROGRAMS // 2, 10_000)
        wrong = compare([programs.program() for _ in range(count)], tmp_path, offsets)
        assert not wrong, f"{len(wrong)} of {count}:\n{wrong[0]}"


def test_turned_systems_make_linuxcnc_s_moves(tmp_path: Path) -> None:
    """The same programs, every system turned; what we do not take, and how much that is."""
    linuxcnc.require()
    turned = {name: [*values, 7.5 * (1 + k)] for k, (name, values) in enumerate(OFFSETS.items())}
    turned["G54"] = [0.0] * 9 + [-33.0]
    programs = Programs(SEED + 7, OFFSETS)
    texts = [programs.program() for _ in range(2000)]
    paths = written(texts, tmp_path)
    compared = refused = 0
    for text, path, theirs in zip(
        texts, paths, linuxcnc.theirs(paths, tmp_path, turned), strict=True
    ):
        ours = linuxcnc.ours(path, turned)
        if ours.error is not None:
            refused += "turned coordinate system" in ours.error
            assert theirs.error is not None or "turned coordinate system" in ours.error, text
        elif theirs.error is None:
            found = linuxcnc.difference(text, ours.moves, theirs.moves, turned)
            assert found is None, f"{found}\n{text}"
            compared += 1
    assert compared > 300
    assert refused > 30


@pytest.mark.parametrize("kind", ["mutated", "soup"])
def test_what_we_accept_linuxcnc_accepts_and_moves_alike(kind: str, tmp_path: Path) -> None:
    linuxcnc.require()
    draw = Random(SEED)  # noqa: S311
    programs = Programs(SEED, OFFSETS)
    texts = [
        mutated(draw, programs.program()) if kind == "mutated" else soup(draw) for _ in range(1500)
    ]
    paths = written(texts, tmp_path)
    # A file without its end is complete for us; a spindle that stands is no matter of positions.
    pardoned = ("File ended with no percent sign", "zero spindle speed", linuxcnc.CRASHED)
    compared = 0
    for text, path, theirs in zip(
        texts, paths, linuxcnc.theirs(paths, tmp_path, OFFSETS), strict=True
    ):
        ours = linuxcnc.ours(path, OFFSETS)
        if ours.error is None and not any(word in (theirs.error or "") for word in pardoned):
            assert theirs.error is None, text
            found = linuxcnc.difference(text, ours.moves, theirs.moves, OFFSETS)
            assert found is None, f"{found}\n{text}"
            compared += 1
    assert compared > (300 if kind == "mutated" else 25)


_STRAIGHT = re.compile(r"(STRAIGHT_TRAVERSE|STRAIGHT_FEED|ARC_FEED)\((.*)\)")


def rs274_moves(path: Path, folder: Path) -> list[list[float]]:
    """Ends X Y Z A B C of the moves that `rs274 -g` prints, mm and degrees, to four decimals."""
    stored = folder / "rs274.var"
    stored.write_text(linuxcnc.parameters(OFFSETS), encoding="ascii")
    command = [RS274, "-v", stored, "-g", path]
    run = subprocess.run(command, capture_output=True)
    assert run.returncode == 0, run.stderr.decode(errors="replace")
    unit, offset, plane, moves = 1.0, [0.0] * 6, "XY", []
    for line in run.stdout.decode(errors="replace").splitlines():
        if "USE_LENGTH_UNITS" in line:
            unit = 25.4 if "INCHES" in line else 1.0
        elif "SELECT_PLANE" in line:
            plane = line.split("PLANE_")[1][:2]
        elif found := re.search(r"SET_G5X_OFFSET\(\d, (.*)\)", line):
            offset = [float(number) for number in found[1].split(", ")]
            offset[:3] = [number * unit for number in offset[:3]]
        elif found := _STRAIGHT.search(line):
            numbers = [float(number) for number in found[2].split(", ")]
            if found[1] == "ARC_FEED":
                first, second, _, _, _, third, *rest = numbers
                order = {"XY": (0, 1, 2), "YZ": (1, 2, 0), "XZ": (2, 0, 1)}[plane]
                place = dict(zip(order, (first, second, third), strict=True))
                numbers = [place[0], place[1], place[2], *rest]
            ends = [
                n * (unit if axis < 3 else 1.0) + offset[axis] for axis, n in enumerate(numbers)
            ]
            moves.append(ends)
    return moves


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_corpus_makes_the_moves_that_rs274_prints(path: Path, tmp_path: Path) -> None:
    require_rs274()
    text = path.read_bytes().decode()
    if set("UVWuvw") & set(re.sub(r"\([^)]*\)|;.*|what.*", "", text)):
        pytest.skip("rs274 has no axes U V W")
    ours = linuxcnc.ours(path, OFFSETS)
    assert ours.error is None
    ends = [row[linuxcnc.END][:6] for row in ours.moves]
    following = iter(rs274_moves(path, tmp_path))
    # rs274 makes more moves: of a bare G0, and those that G28 and G30 end in.
    for end in ends:
        assert any(np.allclose(end, other, rtol=1e-12, atol=2e-3) for other in following), end


REFUSED = [
    # what no controller can read
    ("G0 X1\0Y2", "gcode-not-text", 1, 6),
    ("G0 X1\n\x1a", "gcode-not-text", 2, 1),
    ("\ufeffG21\nG0 X1", "gcode-not-text", 1, 1),
    ("G0 X1 µ", "gcode-not-text", 1, 7),
    ("(µ\0)", "gcode-not-text", 1, 3),
    ("G0 X1 (" + "x" * 300 + ")", "gcode-line-too-long", 1, 253),
    ('G0 X1 "', "gcode-bad-character", 1, 7),
    ("G0 X1\nG0 N5 X1", "gcode-bad-character", 2, 4),
    ("G0 X1 /Y2", "gcode-bad-character", 1, 7),
    ("G0 X1 *71", "gcode-bad-character", 1, 7),
    ("G0 X1\n%\n", "gcode-bad-character", 2, 1),
    ("G0 X1 (never closed", "gcode-comment", 1, 7),
    ("G0 X1 (a (b) c)", "gcode-comment", 1, 10),
    ("G0 X1 ) Y2", "gcode-comment", 1, 7),
    ("G0 X Y2", "gcode-no-number", 1, 4),
    ("(µ°) G0 X", "gcode-no-number", 1, 9),
    ("G0 X(a)1", "gcode-no-number", 1, 4),
    ("G0 X1.2.3", "gcode-bad-number", 1, 5),
    ("G0 X.", "gcode-bad-number", 1, 5),
    ("N-1 G0 X1", "gcode-bad-number", 1, 1),
    ("G0 X1 Y2 X3", "gcode-word-twice", 1, 10),
    ("F10 F20", "gcode-word-twice", 1, 5),
    ("G0 G1 X1 F10", "gcode-modal-group", 1, 4),
    ("G90 G91", "gcode-modal-group", 1, 5),
    ("M3 M5", "gcode-modal-group", 1, 4),
    ("G28 G0 X1", "gcode-modal-group", 1, 5),
    ("M3 M8 M48 M62 P1 M0", "gcode-too-many-codes", 1, 18),
    ("G99.9", "gcode-unknown-code", 1, 1),
    ("G-1", "gcode-unknown-code", 1, 1),
    ("M31", "gcode-unknown-code", 1, 1),
    ("M3.5", "gcode-unknown-code", 1, 1),
    ("G0 X1 I5", "gcode-unused-word", 1, 7),
    ("G0 X1 R5", "gcode-unused-word", 1, 7),
    ("G0 X1 P5", "gcode-unused-word", 1, 7),
    ("H1 G0 X1", "gcode-unused-word", 1, 1),
    ("D1", "gcode-unused-word", 1, 1),
    ("G2 X10 I5 K0 F10", "gcode-unused-word", 1, 11),
    ("G4 P1 G2 X10 I5 F10", "gcode-shared-word", 1, 4),
    ("G4", "gcode-missing-word", 1, 1),
    ("M62", "gcode-missing-word", 1, 1),
    ("G96 D10", "gcode-missing-word", 1, 1),
    ("G2 F10", "gcode-missing-word", 1, 1),
    ("G2 X10 F10", "gcode-missing-word", 1, 1),
    ("G2 R5 F10", "gcode-missing-word", 1, 4),
    ("G90.1 G2 X10 I5 F10", "gcode-missing-word", 1, 14),
    ("G53", "gcode-missing-word", 1, 1),
    ("F-1", "gcode-bad-value", 1, 1),
    ("S-1", "gcode-bad-value", 1, 1),
    ("G4 P-1", "gcode-bad-value", 1, 4),
    ("G2 X10 I5 P1.5 F10", "gcode-bad-value", 1, 11),
    ("G2 X10 I5 P0 F10", "gcode-bad-value", 1, 11),
    ("X1", "gcode-no-motion", 1, 1),
    ("G0 X1\nG80\nX2", "gcode-no-motion", 3, 1),
    ("G80 X1", "gcode-no-motion", 1, 5),
    ("G4 P1 X1", "gcode-no-motion", 1, 7),
    ("G1 X1", "gcode-no-feed", 1, 1),
    ("G1", "gcode-no-feed", 1, 1),
    ("G1 X1 F0", "gcode-no-feed", 1, 7),
    ("G93 G1 X1 F1\nX2", "gcode-no-feed", 2, 1),
    ("G1 X1 F10\nG94 X2", "gcode-no-feed", 2, 5),
    ("G53 G2 X1 I.5 F10", "gcode-unsupported", 1, 1),
    ("G91 G53 G0 X1", "gcode-unsupported", 1, 5),
    ("G2 X10 I5.1 F10", "gcode-arc", 1, 8),
    ("G2 X10 R4.99 F10", "gcode-arc", 1, 8),
    ("G2 X0 Y0 R5 F10", "gcode-arc", 1, 10),
    ("G2 I0 F10", "gcode-arc", 1, 4),
    ("G2 X10 I0 F10", "gcode-arc", 1, 8),
    ("G2 X10 I5 R5 F10", "gcode-arc", 1, 11),
]
"""Programs (after G21) that LinuxCNC refuses too, and where they are wrong."""

NOT_TAKEN = [
    # what LinuxCNC reads and we do not do, never guessing
    ("#1=5", "gcode-parameters", 1, 1),
    ("G0 X#1", "gcode-parameters", 1, 5),
    ("G0 X[1+2]", "gcode-parameters", 1, 5),
    ("G0 X-[1]", "gcode-parameters", 1, 6),
    ("G0 Xsin[30]", "gcode-parameters", 1, 5),
    ("O100 sub", "gcode-flow", 1, 1),
    ("M98 P100", "gcode-flow", 1, 1),
    ("G81 X1 Z-1 R2 F10", "gcode-unsupported", 1, 1),
    ("G73 X1 Z-1 R2 Q1 F10", "gcode-unsupported", 1, 1),
    ("G41 D1", "gcode-unsupported", 1, 1),
    ("G43 H1", "gcode-unsupported", 1, 1),
    ("G10 L2 P1 X0", "gcode-unsupported", 1, 1),
    ("G92 X0", "gcode-unsupported", 1, 1),
    ("G52 X1", "gcode-unsupported", 1, 1),
    ("G5 X1 Y1 I1 J1 P1 Q1 F10", "gcode-unsupported", 1, 1),
    ("G33 Z1 K1", "gcode-unsupported", 1, 1),
    ("G38.2 X1 F10", "gcode-unsupported", 1, 1),
    ("G76 P1 Z-1 I-1 J1 K1", "gcode-unsupported", 1, 1),
    ("G7", "gcode-unsupported", 1, 1),
    ("G17.1", "gcode-unsupported", 1, 1),
    ("G0 @1 ^45", "gcode-unsupported", 1, 4),
    ("M70", "gcode-unsupported", 1, 1),
    ("G0 X--1", "gcode-bad-number", 1, 5),
    ("G0 X99999999999", "gcode-number-range", 1, 4),
]


SPIRAL = 0.01 * 2 * 2**0.5  # mm; in inch programs a tenth of it, inches
TOLERANCES = [
    # difference of the radii of an arc: absolute, as a share of the larger, absolute at most
    ("G21", "G2 F1 X10 I{:.12f}", 5 + SPIRAL / 2),
    ("G20", "G2 F1 X1 I{:.12f}", 0.5 + SPIRAL / 20),
    ("G21", "G2 F1 X200 I{:.12f}", 100 * (1 + 0.001 / 2 / (1 - 0.0005))),
    ("G21", "G2 F1 X20000 I{:.12f}", 10000 + 100 * SPIRAL / 2),
    ("G20", "G2 F1 X2000 I{:.12f}", 1000 + 10 * SPIRAL / 2),
    # a radius shorter than half the chord
    ("G21", "G2 F1 X10 R{:.12f}", 5 - 0.00127),
    ("G20", "G2 F1 X10 R{:.12f}", 5 - 0.00005),
    # a radius that is one
    ("G21", "G2 F1 I{:.12f}", 0.00127),
    ("G20", "G2 F1 I{:.12f}", 0.00005),
]


@pytest.mark.parametrize(("units", "block", "limit"), TOLERANCES)
def test_arcs_are_tolerated_as_linuxcnc_tolerates_them(
    units: str, block: str, limit: float, tmp_path: Path
) -> None:
    require_rs274()
    for sign in (-1, 1):
        text = f"{units}\n{block.format(limit + sign * 1e-9)}\nM2\n"
        (path,) = written([text], tmp_path)
        accepted = subprocess.run([RS274, "-g", path], capture_output=True).returncode == 0
        assert (linuxcnc.ours(path, {}).error is None) == accepted, text
        if sign < 0:
            before = accepted
    assert before != accepted, "the limit lies between the two"


def refusal(program: bytes, folder: Path, **settings: object) -> _kernel.GcodeError:
    path = folder / "program.ngc"
    path.write_bytes(program)
    settings = {"start": dict.fromkeys("XYZABC", 0.0), **settings}
    with pytest.raises(_kernel.GcodeError) as caught:
        _kernel.GcodeReader(path, **settings).read(1000)  # type: ignore[arg-type]
    return caught.value


@pytest.mark.parametrize(("text", "code", "line", "column"), REFUSED + NOT_TAKEN)
def test_refusal_names_line_and_column(
    text: str, code: str, line: int, column: int, tmp_path: Path
) -> None:
    problem = refusal(text.encode(), tmp_path, units="mm")
    assert (problem.code, problem.line, problem.column) == (code, line, column)
    assert problem.code in _kernel.gcode_codes()
    assert problem.message


def require_rs274() -> None:
    if not RS274.exists():
        missing("rs274 is not installed (Debian: linuxcnc-uspace)")


@pytest.mark.parametrize("text", [text for text, *_ in REFUSED if "\0" not in text])
def test_what_is_refused_as_wrong_linuxcnc_refuses_too(text: str, tmp_path: Path) -> None:
    # But for zero bytes, with which it drops the rest of the line unseen.
    require_rs274()
    (path,) = written([f"G21\n{text}\nM2\n"], tmp_path)
    assert subprocess.run([RS274, "-g", path], capture_output=True).returncode != 0


@pytest.mark.parametrize(
    ("text", "settings", "code", "line", "column"),
    [
        ("G0 X1", {"units": None}, "gcode-no-units", 1, 4),
        ("G0 A1\nG2 I1 F1", {"units": None}, "gcode-no-units", 2, 4),
        ("/G0 X1", {"units": "mm"}, "gcode-block-delete", 1, 1),
        ("G0 X1 Y1", {"units": "mm", "start": None}, "gcode-position-unknown", 1, 4),
        ("G0 X1Y1Z1\nG91\nG1 A1 F1", {"start": {}, "axes": "XYZA"}, "gcode-no-units", 1, 4),
        ("G21 G1 X1 Y1 Z1 F1", {"start": None}, "gcode-position-unknown", 1, 8),
        ("G21 G0 X1 Y1 Z1\nG28\nG1 X1 F1", {"start": None}, "gcode-position-unknown", 3, 4),
        ("G21 G0 X1 Y1 Z1\nG28 X2\nG91 G0 X1", {}, "gcode-position-unknown", 3, 8),
        ("G21 G18 G2 X1 R5 F1", {"start": {"X": 0}, "axes": "X"}, "gcode-position-unknown", 1, 12),
    ],
)
def test_what_nobody_said_is_not_guessed(
    text: str, settings: dict[str, object], code: str, line: int, column: int, tmp_path: Path
) -> None:
    problem = refusal(text.encode(), tmp_path, **settings)
    assert (problem.code, problem.line, problem.column) == (code, line, column)


def test_what_is_said_makes_a_position_known(tmp_path: Path) -> None:
    path = tmp_path / "program.ngc"
    path.write_text("G21\nG0 X1 Y2 Z3\nG91 G28 Z0\nG90 G0 Z5\nG28\nG1 X9 F1\n", encoding="ascii")
    reader = _kernel.GcodeReader(path, reference={"G28": {"X": 7, "Y": 8, "Z": 9}})
    moves = reader.read(10)
    assert np.isnan(moves.start[0]).all()
    np.testing.assert_array_equal(moves.end[:, :3], [[1, 2, 3], [1, 2, 5], [9, 8, 9]])
    np.testing.assert_array_equal(moves.start[1:, :3], [[1, 2, 9], [7, 8, 9]])
    assert len(reader.read(10)) == 0


def test_block_delete_on_leaves_lines_out(tmp_path: Path) -> None:
    path = tmp_path / "program.ngc"
    path.write_text("G21 G0 X1\n/X2 ( never closed\n / X3\nX4\n", encoding="ascii")
    reader = _kernel.GcodeReader(path, block_delete=True, start=dict.fromkeys("XYZ", 0.0))
    assert reader.read(10).end[:, 0].tolist() == [1, 4]


def test_settings_that_are_none_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "program.ngc"
    path.write_text("G21\n", encoding="ascii")
    for settings in (
        {"units": "metre"},
        {"axes": "XX"},
        {"axes": "Q"},
        {"start": {"Q": 1.0}},
        {"start": {"X": float("nan")}},
        {"offsets": {"G53": {"X": 1.0}}},
        {"reference": {"G29": {"X": 1.0}}},
    ):
        with pytest.raises(ValueError, match=r"\w"):
            _kernel.GcodeReader(path, **settings)  # type: ignore[arg-type]
    with pytest.raises(FileNotFoundError):
        _kernel.GcodeReader(tmp_path / "none.ngc")


def test_two_gigabytes_without_a_line_are_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "large.ngc"
    with path.open("wb") as file:
        file.truncate(2 << 30)  # zeros, and no room taken
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(_kernel.GcodeError) as caught:
        _kernel.GcodeReader(path).read(1)
    assert (caught.value.code, caught.value.line) == ("gcode-line-too-long", 1)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 4 << 10  # KiB


_DRAIN = """
import resource, sys
import numpy as np
from truepose import _kernel
origin = dict.fromkeys("XYZ", 0.0)
def drain(path, target):
    moves = 0
    corrector = _kernel.GcodeCorrector(path, target, start=origin)
    while len(batch := corrector.read(10_000)):
        moves += len(batch)
        corrector.write(np.ones(len(batch), np.int64), batch.end, np.ones(len(batch)))
    corrector.finish()
    return moves
drain(sys.argv[1], "/dev/null")
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(drain(sys.argv[2], "/dev/null"), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@sweep
@pytest.mark.parametrize(
    "block", [b"G1 X1.25 Y-2 F100\nX3 Y1 (to and fro)\n", b"(nothing moves)\n"]
)
def test_memory_does_not_grow_with_the_file(block: bytes, tmp_path: Path) -> None:
    """200 MB through a pipe, after 2 MB that bring every buffer to its size."""
    head = b"G21 G90\n"
    small = tmp_path / "small.ngc"
    small.write_bytes(head + block * (2_000_000 // len(block)))
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    count = 200_000_000 // len(block)

    def pour() -> None:
        with pipe.open("wb") as file:
            file.write(head)
            for _ in range(count // 1000):
                file.write(block * 1000)

    pouring = threading.Thread(target=pour, daemon=True)
    pouring.start()
    command = [sys.executable, "-c", _DRAIN, str(small), str(pipe)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=250)
    pouring.join(10)
    assert run.returncode == 0, run.stderr
    moves, growth = map(int, run.stdout.split())
    assert moves == (count // 1000 * 2000 if b"G1" in block else 0)
    assert growth < 8 << 10  # KiB
