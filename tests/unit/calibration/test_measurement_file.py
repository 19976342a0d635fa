"""Files of measurements: what they may say, one clear problem for everything that is wrong."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from made_measurement_files import GOOD, HEAD, TABLE, problems, read, several
from made_measurements import made_measurements, poses_within
from truepose.calibration import read_measurements
from truepose.calibration.measurements.write_csv import measurements_text
from truepose.calibration.observables import OBSERVABLES
from truepose.errors import RequestError
from truepose.files.data_file import MOST_PROBLEMS
from truepose.machine import Condition, Machine

MACHINES = Path(__file__).parents[3] / "machines"


@pytest.fixture(scope="module")
def slider() -> Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")


@pytest.fixture(scope="module")
def hexapod() -> Machine:
    return tp.load(MACHINES / "hexapod_telescope.toml")


# What files may say.


def test_a_file(tmp_path: Path, slider: Machine) -> None:
    found = read(tmp_path, GOOD, slider)
    (camera,) = found.instruments
    assert (camera.name, camera.kind) == ("camera", "position")
    assert camera.frame.unknown == (True, True, False, False, False, True)
    assert found.placements[:, :2].tolist() == [[0.3, 0.2], [0.25, 0.2]]
    assert np.allclose(found.joints, slider.inverse([[0.3, 0.2], [0.25, 0.2]]))
    assert found.value.tolist() == [0.001, 0.002, 0.003, 0.004]
    assert found.uncertainty.tolist() == [1e-5] * 4
    assert found.row.tolist() == [0, 0, 1, 1]
    assert [OBSERVABLES[each] for each in found.observable] == ["x", "y"] * 2
    assert found.strut.tolist() == [-1] * 4
    assert found.lines.tolist() == [6, 7]
    assert found.held_out.tolist() == [False, False]
    assert found.file == "measured.csv"
    content = (tmp_path / "measured.csv").read_bytes()
    assert found.file_hash == hashlib.sha256(content).hexdigest()
    cold = found.conditions[0]
    assert found.conditions[1] is cold
    assert cold.default_temperature == slider.condition.reference_temperature
    assert not cold.wrench.any()


def test_joints_instead_of_poses(tmp_path: Path, slider: Machine) -> None:
    joints = slider.inverse([0.3, 0.2])
    text = HEAD + "joint.d1 [mm],joint.d2 [m],x (mm),y (mm)\n"
    found = read(tmp_path, text + f"{float(joints[0]) * 1000!r},{float(joints[1])!r},1,2\n", slider)
    assert np.allclose(found.joints, joints, rtol=1e-15)
    assert np.allclose(found.placements[0, :2], [0.3, 0.2], atol=1e-12)


def test_several_instruments_and_blank_cells(tmp_path: Path, hexapod: Machine) -> None:
    pose = ",".join(map(repr, (poses_within(hexapod, 1)[0] * ([1e3] * 3 + [1] * 3)).tolist()))
    text = (
        "#: [instrument.tracker]\n"
        '#: kind = "position"\n'
        '#: frame = { origin = ["1 m", "0 mm", "-3 mm"], rotation = ["0 deg", "0 deg", "90 deg"], '
        'unknown = ["z", "a"] }\n'
        '#: target = { start = ["0 mm", "0 mm", "35 mm"], unknown = true }\n'
        '#: uncertainty = { x = "1 um", y = "2 um" }\n'
        "#: [instrument.bar]\n"
        '#: kind = "distance"\n'
        '#: frame = { origin = ["0 mm", "1 mm", "2 mm"] }\n'
        '#: bias = "unknown"\n'
        '#: target = ["0 mm", "0 mm", "5 mm"]\n'
        '#: uncertainty = "0.5 um"\n'
        "# a comment\n"
        "instrument,command.x (mm),command.y (mm),command.z (mm),"
        "command.a (rad),command.b (rad),command.c (rad),"
        "x (mm),y (mm),z (mm),z.uncertainty (um),distance (mm),distance.uncertainty (um),set,id\n"
        f"tracker,{pose},1,2,3,4,,,check,first\n"
        f"bar,{pose},,,,,250,,fit,\n"
        f"bar,{pose},,,,,250,0.7,,\n"
    )
    found = read(tmp_path, text, hexapod)
    tracker, bar = found.instruments
    assert tracker.frame.origin == (1.0, 0.0, -0.003)
    assert np.allclose(tracker.frame.rotation, [math.sqrt(0.5), 0, 0, math.sqrt(0.5)])
    assert tracker.frame.unknown == (False, False, True, True, False, False)
    assert (tracker.target, tracker.target_unknown) == ((0.0, 0.0, 0.035), True)
    assert (bar.target, bar.target_unknown, bar.bias_unknown) == ((0.0, 0.0, 0.005), False, True)
    assert found.instrument.tolist() == [0, 1, 1]
    assert found.row.tolist() == [0, 0, 0, 1, 2]
    assert np.allclose(found.value, [1e-3, 2e-3, 3e-3, 0.25, 0.25])
    assert np.allclose(found.uncertainty, [1e-6, 2e-6, 4e-6, 0.5e-6, 0.7e-6])
    assert found.held_out.tolist() == [True, False, False]


def test_the_condition_of_rows(tmp_path: Path, slider: Machine) -> None:
    text = HEAD + TABLE.replace(
        "\n",
        ",temperature.default (degC),temperature.strut.1 (degF),temperature.frame (K),"
        "force.y (N),moment.z (N m)\n",
    )
    rows = (
        "300,200,1,2,,,,,\n"
        "300,200,1,2,30,86,300,5,\n"
        "300,200,1,2,30,,,,\n"
        "300,200,1,2,20,,,0,0\n"
        "300,200,1,2,,,310,,2\n"
        "300,200,1,2,30,,,,\n"
    )
    found = read(tmp_path, text + rows, slider).conditions
    assert found[3] is found[0]
    assert found[5] is found[2]
    assert found[0].temperature("strut.1") == 293.15
    assert found[1].temperature("strut.1") == pytest.approx(303.15)
    assert found[1].temperature("frame") == 300.0
    assert found[1].force == (0.0, 5.0, 0.0)
    assert found[2].temperature("strut.1") == pytest.approx(303.15)
    assert found[4].temperature("strut.1") == 293.15
    assert found[4].moment == (0.0, 0.0, 2.0)
    assert found[0].gravity == slider.condition.gravity


def test_what_the_machine_works_in_does_not_hold_while_it_is_measured(tmp_path: Path) -> None:
    machine = tp.load(
        MACHINES / "planar_two_slider.toml", settings=["condition.temperature=300 K"]
    ).with_condition(
        Condition(
            default_temperature=300.0, force=(1.0, 2.0, 0.0), gradients={"strut.1": (1, 0, 0)}
        )
    )
    (condition,) = set(map(id, read(tmp_path, GOOD, machine).conditions))
    found = read(tmp_path, GOOD, machine).conditions[0]
    assert condition
    assert found.default_temperature == 293.15
    assert (found.force, dict(found.gradients)) == ((0.0, 0.0, 0.0), {})


def test_readings_of_struts(tmp_path: Path, slider: Machine) -> None:
    text = (
        "#: [instrument.eye]\n"
        '#: kind = "strut-direction"\n'
        '#: frame = "unknown"\n'
        '#: uncertainty = "0.1 mrad"\n'
        "#: [instrument.sensor]\n"
        '#: kind = "joint-angle"\n'
        '#: end = "platform"\n'
        "#: axis = [0, 0, -2]\n"
        "#: zero = [0, -1, 1]\n"
        '#: uncertainty = "1 arcmin"\n'
        "instrument,command.x (mm),command.y (mm),strut.1.direction.x,strut.1.direction.y (1),"
        "strut.1.direction.z,strut.2.angle (deg)\n"
        "eye,300,200,0.6,-0.8,0,\n"
        "sensor,300,200,,,,181\n"
    )
    found = read(tmp_path, text, slider)
    eye, sensor = found.instruments
    assert eye.frame.unknown == (False, False, False, True, True, True)
    assert sensor.axis == (0.0, 0.0, -1.0)
    assert sensor.zero == (0.0, -1.0, 0.0)
    assert sensor.end == "platform"
    assert found.strut.tolist() == [0, 0, 0, 1]
    assert np.allclose(found.value, [0.6, -0.8, 0.0, math.radians(-179)])
    assert np.allclose(found.uncertainty, [1e-4] * 3 + [math.radians(1 / 60)])


def test_contact_needs_no_column_of_readings(tmp_path: Path, hexapod: Machine) -> None:
    poses = poses_within(hexapod, 2) * [1e3, 1e3, 1e3, 1, 1, 1]
    rows = "".join(",".join(map(repr, pose.tolist())) + "\n" for pose in poses)
    text = ",".join(
        f"command.{each} ({unit})"
        for each, unit in zip("xyzabc", ["mm"] * 3 + ["rad"] * 3, strict=True)
    )
    head = '#: [instrument.ball]\n#: kind = "{}"\n#: frame = "unknown"\n#: uncertainty = "2 um"\n'
    found = read(tmp_path, head.format("contact") + text + "\n" + rows, hexapod)
    assert [OBSERVABLES[each] for each in found.observable] == ["x", "y", "z"] * 2
    assert not found.value.any()
    assert found.instruments[0].frame.unknown == (True, True, True, False, False, False)
    found = read(tmp_path, head.format("plane") + text + "\n" + rows, hexapod)
    assert [OBSERVABLES[each] for each in found.observable] == ["z"] * 2
    assert found.instruments[0].frame.unknown == (False, False, True, True, True, False)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("mark", ["", "\N{ZERO WIDTH NO-BREAK SPACE}"])
def test_files_of_other_systems(tmp_path: Path, slider: Machine, end: str, mark: str) -> None:
    found = read(tmp_path, mark + GOOD.replace("\n", end), slider)
    assert found.lines.tolist() == [6, 7]
    assert found.value.tolist() == [0.001, 0.002, 0.003, 0.004]


def test_a_file_that_a_spreadsheet_has_saved(tmp_path: Path, slider: Machine) -> None:
    text = (
        '"#: machine = ""Planar two-slider PKM""",,,\r\n'
        "#: [instrument.camera],,,\r\n"
        '"#: kind = ""position""",,,\r\n'
        '"#: frame = { origin = [""1 mm"""," ""2 mm"""," ""3 mm""] }"\r\n'
        '"#: uncertainty = ""10 um""",,,\r\n'
        '"# a comment, with ""words""",,,\r\n'
        "command.x (mm),command.y (mm),x (mm),y (mm)\r\n"
        "300,200,1,2\r\n"
        ",,,\r\n"
    )
    found = read(tmp_path, text, slider)
    assert found.instruments[0].frame.origin == (0.001, 0.002, 0.003)
    assert found.lines.tolist() == [8]


# What is wrong.


@dataclass(frozen=True)
class Bad:
    """A change of the good file that makes exactly one problem, at `line` (None: of the whole)."""

    code: str
    old: str
    new: str
    line: int | None
    path: str | None
    words: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.code}: {self.new!r}"


def bad(code: str, old: str, new: str, line: int | None, path: str | None, *words: str) -> Bad:
    return Bad(code, old, new, line, path, words)


CAMERA = "instrument.camera"
CASES = [
    # the head
    bad("not-toml", '"position"', '"position', 2, None, "begin with #:"),
    bad("missing-key", HEAD, "\n" * 4, None, "instrument", "#: [instrument.NAME]"),
    bad("missing-key", '#: kind = "position"', "", 1, f"{CAMERA}.kind", '"strut-length"'),
    bad("missing-key", '#: frame = "unknown"', "", 1, f"{CAMERA}.frame", '"base"', "mean nothing"),
    bad("unknown-choice", "position", "posision", 2, f"{CAMERA}.kind", 'did you mean "position"?'),
    bad("unknown-choice", '"position"', "3", 2, f"{CAMERA}.kind", '"pose"'),
    bad(
        "unknown-key",
        "#: uncertainty",
        '#: taget = "unknown"\n#: uncertainty',
        4,
        f"{CAMERA}.taget",
        'did you mean "target"?',
    ),
    bad("unknown-key", "#: [i", "#: camera = 1\n#: [i", 1, "camera", "machine, instrument"),
    bad("unknown-key", '"10 um"', '{ w = "1 um" }', 4, f"{CAMERA}.uncertainty.w", "x, y, z"),
    bad("no-unit", '"10 um"', "0.01", 4, f"{CAMERA}.uncertainty", "quotation marks"),
    bad("wrong-dimension", '"10 um"', '"10 N"', 4, f"{CAMERA}.uncertainty", "a force"),
    bad("not-positive", '"10 um"', '"0 um"', 4, f"{CAMERA}.uncertainty", "above zero"),
    bad("not-positive", '"10 um"', '{ x = "1 um", y = "-1 um" }', 4, f"{CAMERA}.uncertainty.y"),
    bad("not-finite", '"10 um"', '"inf um"', 4, f"{CAMERA}.uncertainty"),
    bad("excluding-keys", '"10 um"', '["1 um", "2 um"]', 4, f"{CAMERA}.uncertainty[1]", "table"),
    bad("wrong-type", '"10 um"', "true", 4, f"{CAMERA}.uncertainty", "a length"),
    bad("unknown-choice", '"unknown"', '"bass"', 3, f"{CAMERA}.frame", '"base", "unknown"'),
    bad("unknown-key", '"unknown"', "{ origen = 1 }", 3, f"{CAMERA}.frame.origen", '"origin"'),
    bad("wrong-type", '"unknown"', '{ origin = ["0 mm"] }', 3, f"{CAMERA}.frame.origin", "list"),
    bad("no-unit", '"unknown"', "{ origin = [0, 0, 0] }", 3, f"{CAMERA}.frame.origin[0]"),
    bad("wrong-type", '"unknown"', "{ rotation = [1, 1, 0, 0] }", 3, f"{CAMERA}.frame.rotation"),
    bad("unknown-choice", '"unknown"', '{ unknown = ["u"] }', 3, f"{CAMERA}.frame.unknown", '"u"'),
    bad("wrong-type", '"unknown"', "7", 3, f"{CAMERA}.frame", "a number"),
    bad("bad-name", "instrument.camera", "instrument.strut", 1, "instrument.strut", "strut"),
    bad("bad-name", "instrument.camera", 'instrument."a b"', 1, "instrument.a b", "letters"),
    bad("wrong-type", "[instrument.camera]", "[[instrument]]", 1, "instrument", "with a name"),
    bad(
        "unknown-choice",
        "#: unc",
        '#: bias = "1 um"\n#: unc',
        4,
        f"{CAMERA}.bias",
        "either unknown",
    ),
    bad("other-machine", "#: [i", '#: machine = "Hexaglide"\n#: [i', 1, "machine", "PKM"),
    bad("wrong-type", "#: [i", "#: machine = 3\n#: [i", 1, "machine", "a number"),
    # the header of the table
    bad("no-unit", "x (mm),y", "x,y", 5, "x", "(mm)"),
    bad("wrong-dimension", "x (mm),y", "x (deg),y", 5, "x", "an angle"),
    bad("unknown-unit", "x (mm),y", "x (mmm),y", 5, "x"),
    bad("unknown-column", "x (mm),y (mm)\n", "x (mm),y (mm),w (mm)\n", 5, "w", "instrument"),
    bad("doubled-column", "y (mm)\n", "x (mm)\n", 5, "x", "twice"),
    bad("missing-column", ",y (mm)\n300,200,1,2\n250,200,3,4", "\n300,200,1\n250,200,3", 5, None),
    bad("not-csv", TABLE, TABLE.replace(",", ";"), 5, None, "semicolons"),
    bad("nothing-measured", GOOD[len(HEAD) :], "command.x (mm),command.y (mm)\n300,200\n", 5, None),
    bad(
        "other-machine",
        "command.x (mm),command.y",
        "joint.a (mm),joint.b",
        5,
        "joint.a",
        "joint.a, joint.b",
        "joint.d1, joint.d2",
    ),
    bad(
        "other-machine",
        "y (mm)\n",
        "strut.9.length (mm)\n",
        5,
        "strut.9.length",
        "strut.1, strut.2",
    ),
    bad("other-machine", "command.y", "command.z", 5, "command.z", "command.x, command.y"),
    bad("missing-column", "command.x (mm),command.y (mm)", "id,set", 5, None, "joint.d1"),
    bad("missing-column", "command.x (mm)", "id", 5, None, "command.x"),
    bad("missing-column", "command.x (mm),command.y (mm)", "joint.d1 (mm),id", 5, None, "joint.d2"),
    bad(
        "excluding-columns",
        GOOD[len(HEAD) :],
        "command.x (mm),command.y (mm),joint.d1 (mm),joint.d2 (mm),x (mm),y (mm)\n"
        "300,200,650,650,1,2\n",
        5,
        None,
        "either",
    ),
    bad(
        "unknown-part",
        "y (mm)\n300,200,1,2\n250,200,3,4",
        "y (mm),temperature.strut.9 (degC)\n300,200,1,2,3",
        5,
        "temperature.strut.9",
        "temperature",
    ),
    bad(
        "wrong-dimension",
        "y (mm)\n",
        "temperature.default (delta_degC)\n",
        5,
        "temperature.default",
    ),
    # rows
    bad("no-rows", "300,200,1,2\n250,200,3,4\n", "", 5, None, "no row"),
    bad("ragged-row", "300,200,1,2", "300,200,1", 6, None, "too few"),
    bad("ragged-row", "300,200,1,2", "300,200,1,5,2", 6, None, "a point, not a comma"),
    bad("not-a-number", "1,2", "one,2", 6, "x", '"one"'),
    bad("not-a-number", "1,2", '"1,5",2', 6, "x", "a point, not a comma"),
    bad("not-a-number", "1,2", "1 mm,2", 6, "x", "a unit stands in the header"),
    bad("not-finite", "1,2", "nan,2", 6, "x", "finite"),
    bad("not-finite", "1,2", "1e400,2", 6, "x", "finite"),
    bad("empty-cell", "1,2", ",2", 6, "x", "camera, needs a value"),
    bad("empty-cell", "300,200", ",200", 6, "command.x"),
    bad("not-a-number", "300,200", "here,200", 6, "command.x"),
    bad("commanded-out-of-reach", "300,200", "9000,200", 6, None, "unreachable", "misses by"),
    bad("commanded-out-of-reach", "300,200", "300,2000", 6, None, "drive", "out of travel"),
    bad(
        "commanded-out-of-reach",
        "command.x (mm),command.y (mm),x (mm),y (mm)\n300,200,1,2\n250,200,3,4",
        "joint.d1 (mm),joint.d2 (mm),x (mm),y (mm)\n650,650,1,2\n650,9000,3,4",
        7,
        "joint.d2",
        "9000 mm",
        "a joint from",
    ),
    bad(
        "commanded-out-of-reach",
        "command.x (mm),command.y (mm),x (mm),y (mm)\n300,200,1,2\n250,200,3,4",
        "joint.d1 (mm),joint.d2 (mm),x (mm),y (mm)\n650,650,1,2\n0,900,3,4",
        7,
        None,
        "no pose at these joints",
    ),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_bad_files(tmp_path: Path, slider: Machine, case: Bad) -> None:
    assert GOOD.count(case.old) >= 1
    found = problems(tmp_path, GOOD.replace(case.old, case.new, 1), slider)
    told = [(p.code, p.line, p.path) for p in found]
    assert any(code == case.code for code, _, _ in told), told
    (problem,) = (p for p in found if p.code == case.code)
    assert problem.file == str(tmp_path / "measured.csv")
    assert (problem.line, problem.path) == (case.line, case.path)
    for word in case.words:
        assert word in str(problem)


ROWS = [
    # a row of the file beside a good one, and what is wrong with it
    ("unknown-instrument", "trakker,300,200,1,2,,,,,,,,,", "instrument", 'did you mean "tracker"?'),
    ("unknown-instrument", "laser,300,200,1,2,,,,,,,,,", "instrument", "#: [instrument.laser]"),
    ("empty-cell", ",300,200,1,2,,,,,,,,,", "instrument", "a word"),
    ("empty-cell", "tracker,300,200,1,,,,,,,,,,", "y", "tracker, needs a value"),
    ("unwanted-value", "tracker,300,200,1,2,,700,,,,,,,", "strut.1.length", "reads one of x, y, z"),
    ("empty-cell", "scales,300,200,,,,,,,,,,,", None, "no reading of the instrument scales"),
    ("not-positive", "scales,300,200,,,,-700,,,,,,,", "strut.1.length", "-700 mm"),
    ("not-positive", "tracker,300,200,1,2,0,,,,,,,,", "x.uncertainty", "0 um"),
    ("not-positive", "tracker,300,200,1,2,-3,,,,,,,,", "x.uncertainty", "-3 um"),
    ("no-uncertainty", "scales,300,200,,,,,700,,,,,,", "strut.2.length", "strut.2.length.unc"),
    ("unwanted-value", "scales,300,200,,,3,700,,,,,,,", "x.uncertainty", "does not have"),
    ("not-a-direction", "eye,300,200,,,,,,0.6,0.7,0,,,", "strut.1.direction", "length 0.92"),
    ("empty-cell", "eye,300,200,,,,,,0.6,0.8,,,,", "strut.1.direction.z", "three components"),
    ("not-positive", "tracker,300,200,1,2,,,,,,,-300,,", "temperature.default", "absolute zero"),
    ("not-a-number", "tracker,300,200,1,2,,,,,,,,warm,", "temperature.strut.1", '"warm"'),
    ("unknown-choice", "tracker,300,200,1,2,,,,,,,,,fitt", "set", 'did you mean "fit"?'),
]


def test_a_file_of_several_instruments(tmp_path: Path, slider: Machine) -> None:
    found = read(tmp_path, several(), slider)
    assert found.instrument.tolist() == [0, 1, 2]
    assert found.row.tolist() == [0, 0, 1, 2, 2, 2]


@pytest.mark.parametrize(("code", "row", "path", "words"), ROWS)
def test_bad_rows(
    tmp_path: Path, slider: Machine, code: str, row: str, path: str | None, words: str
) -> None:
    (problem,) = problems(tmp_path, several(row), slider)
    assert (problem.code, problem.path) == (code, path)
    assert problem.line == len(several().splitlines()) + 1
    assert words in str(problem)
    assert problem.found
    assert problem.expected


def test_all_problems_at_once(tmp_path: Path, slider: Machine) -> None:
    text = several(*(row for _, row, _, _ in ROWS)).replace('"10 um"', '"10 N"')
    found = problems(tmp_path, text.replace('kind = "strut-length"', 'kind = "length"'), slider)
    codes = {problem.code for problem in found}
    assert {"wrong-dimension", "unknown-choice", "unknown-instrument", "not-a-number"} <= codes
    lines = [problem.line for problem in found if problem.line is not None]
    assert lines == sorted(lines)
    text = several(*(row for _, row, _, _ in ROWS))
    found = problems(tmp_path, text, slider)
    assert [p.code for p in found if p.code != "no-uncertainty"] == [
        code for code, _, _, _ in ROWS if code != "no-uncertainty"
    ]


def test_many_problems_of_one_kind_are_counted(tmp_path: Path, slider: Machine) -> None:
    found = problems(tmp_path, HEAD + TABLE + "9000,200,1,\n" * 50, slider)
    for code in ("commanded-out-of-reach", "empty-cell"):
        told = [problem for problem in found if problem.code == code]
        assert len(told) == MOST_PROBLEMS
        assert told[-1].message.endswith("and in 40 more rows")


def test_an_instrument_without_rows_and_one_too_many(tmp_path: Path, slider: Machine) -> None:
    other = HEAD.replace("camera", "other")
    (problem,) = problems(tmp_path, GOOD.replace(HEAD, HEAD + other), slider)
    assert problem.code == "missing-column"
    assert "a column instrument" in str(problem)
    rows = "instrument," + TABLE + "camera,300,200,1,2\n"
    (problem,) = problems(tmp_path, HEAD + other + rows, slider)
    assert (problem.code, problem.line, problem.path) == ("no-rows", 9, None)
    assert "other" in problem.message


def test_a_coordinate_instrument_reads_two_at_most(tmp_path: Path, hexapod: Machine) -> None:
    made = made_measurements(hexapod, "position", poses_within(hexapod, 2))
    text = measurements_text(hexapod, made).replace('"position"', '"coordinate"')
    (problem,) = problems(tmp_path, text, hexapod)
    assert (problem.code, problem.path) == ("unwanted-value", "z")
    assert 'kind "position"' in str(problem)


def test_a_frame_where_none_counts(tmp_path: Path, slider: Machine) -> None:
    text = GOOD.replace('"position"', '"strut-length"').replace("x (mm),y", "strut.1.length (mm),y")
    found = problems(tmp_path, text, slider)
    assert [(p.code, p.line) for p in found] == [("unknown-choice", 3)]
    text = GOOD.replace('"position"', '"joint-angle"').replace(
        "#: unc", "#: axis = [0,0,0]\n#: unc"
    )
    codes = [p.code for p in problems(tmp_path, text, slider)]
    assert codes[0] == "zero-direction"
    text = text.replace("axis = [0,0,0]", "axis = [0,0,1]\n#: zero = [0,0,2]")
    assert problems(tmp_path, text, slider)[0].path == "instrument.camera.zero"


def test_a_file_that_is_not_there(tmp_path: Path, slider: Machine) -> None:
    with pytest.raises(RequestError) as error:
        read_measurements(tmp_path / "none.csv", slider)
    assert [p.code for p in error.value.problems] == ["file-missing"]
    found = problems(tmp_path, GOOD.encode("utf-16"), slider)
    assert [p.code for p in found] == ["not-utf8"]
