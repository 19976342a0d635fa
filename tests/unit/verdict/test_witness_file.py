"""A witness as a machine file: its budget at the one pose is the witness."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import machine_files
from machine_texts import PLANAR, edited, load_text
from made_source import MadeSource, with_sources
from random_machines import DRAWN, DrawnMachine
from sweeps import thinned
from truepose._kernel import STATUS
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.runs.displacement import displacement
from truepose.runs.poses import OK, PoseRun, is_path
from truepose.runs.variables import variables_at
from truepose.sources import Deviation, acting
from truepose.verdict.witness import AFTER, BEFORE, Witness
from truepose.verdict.witness_file import write_witness

N_POSE = 3
QUICK = {"planar_two_slider", "hexapod_all_sources", "3prs"}


def witnesses(machine: Machine, poses: np.ndarray, random: np.random.Generator) -> list[Witness]:
    """In both states at each pose a corner and a point inside the domain, by the exact error."""
    found = []
    condition = machine.condition
    sources = acting(machine, condition)
    (block,) = PoseRun(machine, poses, condition, path=is_path(machine))
    moves = variables_at(machine, block, sources)
    corrected, _, status = machine.kernel.corrected(poses[block.indices], *moves.shift)
    assert (status == OK).all()
    after = dataclasses.replace(block, joints=corrected)
    for state, each in ((BEFORE, block), (AFTER, after)):
        unknown = variables_at(machine, each, sources)
        for pose in range(block.indices.size):
            of_pose = unknown.at(pose)
            domain = of_pose.domain
            corner = domain.most_along(random.normal(size=domain.lower.size))
            inside = random.uniform(domain.lower, domain.upper)
            for members in domain.directions:
                inside[members] *= 0.5
            for t in (corner, inside):
                error, status = displacement(
                    machine,
                    each.joints[[pose]],
                    block.placements[[pose]],
                    of_pose.parameters_moved(t[np.newaxis]),
                )
                name = STATUS[status[0]]
                for quantity in ("position", "orientation"):
                    at = [c in "xyz" for c in machine.components]
                    if quantity == "orientation":
                        at = [not c for c in at]
                    if not any(at):
                        continue
                    fine = name == "ok"
                    found.append(
                        Witness(
                            state=state,
                            quantity=quantity,
                            machine=machine,
                            pose=poses[block.indices[pose]],
                            number=int(block.indices[pose]),
                            joints=each.joints[pose],
                            spread=of_pose,
                            t=t,
                            error=error[0] if fine else None,
                            size=float(np.linalg.norm(error[0][at])) if fine else np.inf,
                            status=name,
                        )
                    )
    return found


def assert_same(machine: Machine, witness: Witness, path: Path, original: Path) -> Machine:
    """Write it, read it back by the public door, and let the budget say its size."""
    write_witness(machine, witness, path, original=original)
    written = tp.load(path)
    if witness.state == BEFORE and not machine.replaced:
        assert np.array_equal(written.nominal, machine.nominal)
    if witness.status != "ok":
        with pytest.raises(RequestError) as refused:
            tp.budget(written)
        (problem,) = refused.value.problems
        assert problem.code == "no-pose-left"
        assert witness.status.replace("_", " ") in (problem.found or "")
        return written
    budget = tp.budget(written)
    assert np.allclose(written.poses(), [witness.pose], rtol=1e-14, atol=1e-15)
    names = list("xyz") if witness.quantity == "position" else ["rx", "ry", "rz"]
    kept = [name for name in names if name in written.components]
    error = budget.overall_error.sel(component=kept).values[0]
    assert np.linalg.norm(error) == pytest.approx(witness.size, rel=1e-9)
    # One machine: nothing of it is unknown.
    assert not budget.reach.values.any()
    return written


def some(machine: Machine, random: np.random.Generator) -> np.ndarray:
    poses = machine.poses()
    return poses[random.choice(len(poses), min(N_POSE, len(poses)), replace=False)]


@pytest.mark.parametrize(
    "original",
    thinned(machine_files(), [path for path in machine_files() if path.stem in QUICK]),
    ids=lambda path: path.stem,
)
def test_the_file_of_a_machine_shipped_is_its_witness(original: Path, tmp_path: Path) -> None:
    machine, random = tp.load(original), np.random.default_rng(3)
    for witness in witnesses(machine, some(machine, random), random):
        assert_same(machine, witness, tmp_path / "witness.toml", original)


@pytest.mark.parametrize("drawn", thinned(DRAWN), ids=lambda each: each.name)
def test_the_file_of_a_machine_drawn_is_its_witness(drawn: DrawnMachine, tmp_path: Path) -> None:
    machine, random = tp.load(drawn.path), np.random.default_rng(drawn.number)
    for witness in witnesses(machine, some(machine, random)[:2], random):
        assert_same(machine, witness, tmp_path / "witness.toml", drawn.path)


LEANING = """\
backlash = { play = "4 um" }
sensor = { resolution = "1 um", scale_error = ["-3 ppm", "8 ppm"], zero_at = 100 }
actuator = { lead_error = "+-20 um / 300 mm", periodic = { amplitude = "2 um", period = 5 } }
[drive.guideway]
# how straight
straightness = [
    { direction = [1, 0, 0], amplitude = "5 um", shape = "bow" },
    { direction = [1, 0, 0], amplitude = "2 um", shape = "s", known = true },
]
squareness = { band = ["-3 um/m", "20 um/m"], direction = [1, 0, 0] }
"""
"""Of the first drive, which ends with this table."""

FULL = edited(
    PLANAR,
    ('working_mode = "+"\n', 'working_mode = "+"\n' + LEANING),
    (
        "[condition]",
        "[each.drive]\nbacklash = { play = 0.002 } # both\n[clearance]\nthreshold = 2\n[condition]",
    ),
    ("section_area", 'base_joint = { clearance = "4 um" }\nsection_area'),
    ("force = {", "envelope = { force = 300, normal = [0, 0, 1] } # anywhere\nforce = {"),
    (
        "[workspace]",
        """[tolerance]
# of the frame
"drive.*.origin.x" = { band = [-0.1, 0.3], group = "rails" } # bored together
"strut.2.length" = { values = [-0.1, 0.02, 0.05] }
"*.scale" = { standard_deviation = 2e-5 }
[[correlation]]
between = ["rails", "strut.2.length"]
coefficient = 0.5
[workspace]""",
    ),
)

VARYING = edited(
    FULL,
    ("zero_at = 100 }", 'zero_at = 100, varies = "visit", scale_error_varies = "run" }'),
    ("period = 5 } }", 'period = 5, varies = "machine" }, varies = "run" }'),
    ('play = "4 um" }', 'play = "4 um", varies = "visit" }'),
    ("threshold = 2", 'threshold = 2\nvaries = "machine"'),
    ("normal = [0, 0, 1] }", 'normal = [0, 0, 1], varies = "visit" }'),
    ('shape = "bow" }', 'shape = "bow", varies = "run" }'),
    ("direction = [1, 0, 0] }\n[", 'direction = [1, 0, 0], varies = "run" }\n['),
    ("standard_deviation = 2e-5 }", 'standard_deviation = 2e-5, varies = "visit" }'),
)


def both_states(
    machine: Machine, folder: Path, seed: int = 1
) -> list[tuple[Witness, Machine, str]]:
    """Witnesses of a machine whose file is in `folder`, as written, and their texts."""
    random, found = np.random.default_rng(seed), []
    for witness in witnesses(machine, some(machine, random), random):
        path = folder / "witness.toml"
        written = assert_same(machine, witness, path, folder / "machine.toml")
        found.append((witness, written, path.read_text(encoding="utf-8")))
    return found


@pytest.mark.parametrize("full", [FULL, VARYING], ids=["full", "varying"])
def test_every_form_of_a_band_becomes_one_value_and_comments_stay(
    tmp_path: Path, full: str
) -> None:
    machine = load_text(tmp_path, full)
    for witness, written, text in both_states(machine, tmp_path):
        words = ("resolution", "backlash", "periodic", "clearance", "correlation", "group")
        for word in (*words, "varies"):
            assert word not in text.replace("resolution) is", ""), word
        for comment in ("# how straight", "# of the frame", "# bored together", "# anywhere"):
            assert (comment in text) == (comment != "# anywhere"), comment
        assert written.condition.envelope is None
        assert 'shape = "s", known = true' in text
        assert "squareness" not in text
        # What is written as one value of a key is the value that the machine has.
        (sensor,) = (each for each in written.sources if each.name == "sensor")
        (reading,) = sensor.readings  # type: ignore[attr-defined]
        at = machine.parameters.index("drive.d1.scale")
        assert reading.scale_error.half == 0.0
        assert reading.scale_error.shift == pytest.approx(
            witness.by_source["sensor"][at], rel=1e-12
        )


@pytest.mark.parametrize(
    ("name", "content", "edit"),
    [
        (
            "d1.csv",
            "target (mm), direction, deviation (um)\n"
            + "".join(
                f"{at}, {way}, {value}\n"
                for at in (0, 450, 900)
                for way, value in (("+", 3), ("+", 5), ("-", 9), ("-", 10))
            ),
            ('name = "d1"', 'name = "d1"\nactuator = { table = "d1.csv" }'),
        ),
        (
            "rail.csv",
            "position (mm), level (um)\n0, 1\n400, -7\n900, 3\n",
            (
                'name = "d1"',
                'name = "d1"\nguideway = { table = "rail.csv", directions = { level = [1, 0, 0] },'
                ' squareness = "20 um/m" }',
            ),
        ),
        (
            "log.csv",
            "time (min), default (degC), strut.1 (degC)\n0, 20, 20\n10, 24, 40\n",
            ("temperature = 35\n", 'temperature_log = "log.csv"\n'),
        ),
        (
            "made.csv",
            "deviation (um)\n-3\n5\n11\n",
            ("[workspace]", '[tolerance]\n"strut.2.length" = { data = "made.csv" }\n[workspace]'),
        ),
    ],
)
@pytest.mark.parametrize("way", ["grid", "path"])
def test_files_of_data_stay_where_they_are(
    tmp_path: Path, name: str, content: str, edit: tuple[str, str], way: str
) -> None:
    (tmp_path / name).write_text(content, encoding="utf-8")
    text = edited(PLANAR, edit)
    if way == "path":
        grid = "grid = { x = [200, 400, 5], y = [100, 300, 3] }"
        text = edited(
            text,
            (grid, "path = { points = [[200, 100], [400, 250], [300, 300]], step = 50 }"),
            ('name = "d2"', 'name = "d2"\nbacklash = { play = "5 um", threshold = 5000 }'),
        )
    machine = load_text(tmp_path, text)
    away = tmp_path / "elsewhere"
    away.mkdir()
    random = np.random.default_rng(5)
    for witness in witnesses(machine, machine.poses(), random)[::3]:
        written = assert_same(machine, witness, away / "witness.toml", tmp_path / "machine.toml")
        stays = name in ("rail.csv", "log.csv")
        assert written.data_files == ({f"../{name}": machine.data_files[name]} if stays else {})


def test_a_machine_that_cannot_be_assembled_has_its_status(tmp_path: Path) -> None:
    text = edited(PLANAR, ("length_tolerance = [-0.3, 0.3]", "length_tolerance = [-400, 0.3]"))
    machine = load_text(tmp_path, edited(text, ("[200, 400, 5]", "[200, 200, 1]")))
    poses = machine.poses()[:1]
    (block,) = PoseRun(machine, poses, machine.condition)
    of_pose = variables_at(machine, block, acting(machine, machine.condition)).at(0)
    moved = of_pose.parameters_moved(-np.ones((1, 1)))
    _, status = displacement(machine, block.joints, block.placements, moved)
    witness = Witness(
        BEFORE, "position", machine, poses[0], 7, block.joints[0], of_pose, -np.ones(1), None,
        np.inf, STATUS[status[0]],
    )  # fmt: skip
    assert witness.status != "ok"
    assert_same(machine, witness, tmp_path / "witness.toml", tmp_path / "machine.toml")
    assert witness.as_data()["size"] is None
    json.dumps(witness.as_data(), allow_nan=False)
    assert witness.words()[1] == "strut.1.length at its lower end (-400 mm)"


def test_a_condition_of_the_run_becomes_part_of_the_deviations(tmp_path: Path) -> None:
    filed = load_text(tmp_path, FULL)
    machine = filed.with_condition(
        filed.condition.replace(temperature=300.0, force=[10.0, 20.0, 0.0])
    )
    for _, written, text in both_states(machine, tmp_path):
        assert "What temperatures, forces and all else do there is in the tolerances." in text
        assert [source.name for source in acting(written)] == ["tolerance"]


def test_settings_and_replaced_parameters_are_in_the_file(tmp_path: Path) -> None:
    machine = load_text(tmp_path, FULL, "strut.1.length=501", "tolerance.strut.2.length=0.4")
    machine = machine.replace({"strut.2.length": 0.5005, "drive.d2.origin.y": 0.001})
    for witness, written, text in both_states(machine, tmp_path):
        if witness.state == BEFORE:
            assert np.array_equal(written.nominal, machine.nominal)
        assert "machine.toml, strut.1.length=501, tolerance.strut.2.length=0.4 (SHA-256" in text


def test_before_compensation_nominal_values_stay_to_the_bit(tmp_path: Path) -> None:
    machine = load_text(tmp_path, FULL)
    states = set()
    for witness, written, _ in both_states(machine, tmp_path):
        states.add(witness.state)
        other = written.nominal != machine.nominal
        changed = {written.parameters[at] for at in np.flatnonzero(other)}
        # After it only the command differs: by the offsets of the drives.
        assert changed == (
            set() if witness.state == BEFORE else {"drive.d1.offset", "drive.d2.offset"}
        )
        assert np.allclose(written.home, machine.home, rtol=1e-15, atol=0.0)
        joints = written.inverse(written.poses()[0])
        assert np.allclose(joints, witness.joints, rtol=0.0, atol=1e-15)
    assert states == {BEFORE, AFTER}


def test_the_actual_machine_is_the_witness(tmp_path: Path) -> None:
    """The other road: nominal values and all deviations of the file, added by hand."""
    machine = load_text(tmp_path, FULL)
    for witness, written, _ in both_states(machine, tmp_path):
        columns, values = witness.moved
        wanted = np.array(machine.nominal)
        wanted[columns] += values[0]
        found = np.array(written.nominal)
        (block,) = PoseRun(written, written.poses(), written.condition)
        for source in acting(written):
            deviation = source.deviation(written, written.condition, block)
            np.add.at(found, deviation.parameters, deviation.shift[0])
        assert np.allclose(found, wanted, rtol=1e-15, atol=1e-16)


def test_what_is_told_of_it_to_people(tmp_path: Path) -> None:
    machine = load_text(tmp_path, FULL)
    random = np.random.default_rng(2)
    witness = witnesses(machine, machine.poses()[:1], random)[0]
    t = np.array(witness.spread.domain.upper)
    (members,) = witness.spread.directions
    t[members] = [0.6, -0.8]
    witness = dataclasses.replace(witness, t=t)
    words = witness.words(most=20)
    assert words[0] == "before compensation, at x = 200 mm, y = 100 mm"
    assert "force of 300 N along (0.600, -0.800, 0.000)" in words
    assert "strut.1.length at its upper end (+300 µm)" in words
    assert "drive.d1.origin.x and 1 that vary with it at its upper end (+300 µm)" in words
    assert "strut.2.length at its upper end (+50 µm)" in words
    assert "drive.d1.scale at +3 standard deviations (+60 ppm)" in words
    assert any(word.startswith("drive.d1.scale and 1 that vary with it (sensor)") for word in words)
    assert witness.words(most=2)[-1] == f"and {len(words) - 3} more"
    data = json.loads(json.dumps(witness.as_data(), allow_nan=False))
    assert data["force"] == {"value": [180.0, -240.0, 0.0], "unit": "N"}
    assert data["pose"]["x"] == {"value": 200.0, "unit": "mm"}
    columns, values = witness.moved
    at = machine.parameters.index("strut.1.length")
    total = float(values[0, columns.tolist().index(at)])
    assert data["parameters"]["strut.1.length"]["value"] == pytest.approx(total * 1e3, rel=1e-12)


def test_the_most_important_cause_comes_first(tmp_path: Path) -> None:
    """Against the error without each: by exact solutions, not by slopes."""
    machine = load_text(tmp_path, PLANAR)
    text = edited(PLANAR, ("[workspace]", '[tolerance]\n"drive.*.offset" = 0.11\n[workspace]'))
    machine = load_text(tmp_path, text)
    witness = witnesses(machine, machine.poses()[4:5], np.random.default_rng(8))[0]
    assert witness.error is not None
    along = witness.error / witness.size
    lost = {}
    for variable, name in enumerate(witness.spread.names):
        t = witness.t.copy()
        t[variable] = 0.0
        without, _ = displacement(
            machine,
            witness.joints[np.newaxis],
            witness.block.placements,
            witness.spread.parameters_moved(t[np.newaxis]),
        )
        lost[name] = float(along @ (witness.error - without[0])) / witness.size
    causes = witness.causes()
    order = sorted(lost, key=lambda name: -abs(lost[name]))
    assert [cause.parameter for cause in causes] == order
    for cause in causes:
        assert cause.share == pytest.approx(lost[cause.parameter], abs=2e-3)


def one(folder: Path) -> tuple[Machine, Witness, Path]:
    machine = load_text(folder, PLANAR)
    witness = witnesses(machine, machine.poses()[:1], np.random.default_rng(0))[0]
    return machine, witness, folder / "machine.toml"


@pytest.mark.parametrize(
    ("name", "code"),
    [
        ("machine.toml", "output-is-input"),
        ("missing/witness.toml", "output-not-writable"),
        ("witness.json", "output-ending"),
    ],
)
def test_bad_places(tmp_path: Path, name: str, code: str) -> None:
    machine, witness, original = one(tmp_path)
    before = original.read_bytes()
    with pytest.raises(RequestError) as refused:
        write_witness(machine, witness, tmp_path / name, original=original)
    assert [problem.code for problem in refused.value.problems] == [code]
    assert original.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["machine.toml"]


def test_a_file_that_changed_since_it_was_read(tmp_path: Path) -> None:
    machine, witness, original = one(tmp_path)
    original.write_text(PLANAR + "# edited\n", encoding="utf-8")
    with pytest.raises(RequestError) as refused:
        write_witness(machine, witness, tmp_path / "witness.toml", original=original)
    assert refused.value.problems[0].code == "machine-file-changed"


def test_a_number_that_the_file_does_not_give_is_not_written(tmp_path: Path) -> None:
    machine, witness, original = one(tmp_path)
    wrong = dataclasses.replace(witness, size=witness.size * (1.0 + 1e-8))
    with pytest.raises(RequestError) as refused:
        write_witness(machine, wrong, tmp_path / "witness.toml", original=original)
    assert refused.value.problems[0].code == "witness-not-written"
    assert [path.name for path in tmp_path.iterdir()] == ["machine.toml"]


def test_where_a_source_alone_cannot_be_assembled_all_is_one_source(tmp_path: Path) -> None:
    """A budget leaves out a pose that one source alone takes out of reach."""
    text = edited(
        PLANAR,
        ("[-0.3, 0.3]", "[-400, 0.3]"),
        ("1.1e-5 1/K", "1e-2 1/K"),
        ("[200, 400, 5], y = [100, 300, 3]", "[200, 200, 1], y = [100, 100, 1]"),
    )
    machine = load_text(tmp_path, text)
    (block,) = PoseRun(machine, machine.poses(), machine.condition)
    of_pose = variables_at(machine, block, acting(machine)).at(0)
    moved = of_pose.parameters_moved(-np.ones((1, 1)))
    error, status = displacement(machine, block.joints, block.placements, moved)
    assert status[0] == OK
    witness = Witness(
        BEFORE, "position", machine, block.requested[0], 0, block.joints[0], of_pose, -np.ones(1),
        error[0], float(np.linalg.norm(error[0])),
    )  # fmt: skip
    alone = {"strut.1.length": float(witness.by_source["tolerance"][moved[0][0]])}
    assert alone["strut.1.length"] == pytest.approx(-0.4)
    written = assert_same(machine, witness, tmp_path / "witness.toml", tmp_path / "machine.toml")
    assert [source.name for source in acting(written)] == ["tolerance"]
    assert np.array_equal(written.nominal, machine.nominal)


def test_a_direction_replaced_and_a_source_of_ones_own_are_deviations(tmp_path: Path) -> None:
    machine = load_text(tmp_path, FULL).replace({"drive.d1.axis.u": 2e-4, "drive.d2.scale": 1.0001})
    column = machine.parameters.index("drive.d2.origin.x")
    own = MadeSource("made", Deviation.of([column], 1e-5, 2e-5))
    both_states(with_sources(machine, *machine.sources, own), tmp_path)


GRID = "[workspace]\ngrid = { x = [200, 400, 5], y = [100, 300, 3] }"
FORCE = "force = { x = 1200, y = -1500 }"
DOTTED = 'tolerance."strut.2.length" = 0.1\ntolerance."drive.*.offset" = [0.01, 0.02]\n'
STRUT = 'base = [0, 0, 0], platform = [0, 0, 0], length = 500, section_area = "28 mm^2"'

FORMS = {
    "dotted keys": edited(
        PLANAR,
        (
            'name = "d1"',
            'name = "d1"\nsensor.resolution = "1 um"\nsensor.scale_error = "+-3 ppm"\n'
            "backlash.play = 0.003",
        ),
        (GRID, "[workspace]\ngrid.x = [200, 400, 5]\ngrid.y = [100, 300, 3]"),
    ),
    "tables of tables": edited(
        PLANAR,
        (GRID, "[workspace.grid]\nx = [200, 400, 5]\ny = [100, 300, 3]\n[workspace.home]\nx = 300"),
        (FORCE, "[condition.force]\nx = 1200\n[condition.envelope]\nforce = 9\nnormal = [0, 0, 1]"),
        (
            "[condition]",
            '[each.drive.sensor]\nresolution = "2 um"\nscale_error = ["1 ppm", "4 ppm"]\n'
            '[each.strut.base_joint]\nclearance = "3 um"\n[tolerance."strut.2.length"]\n'
            'band = 0.1\ndistribution = "triangular"\n[condition]',
        ),
    ),
    "dotted tolerances": DOTTED + PLANAR,
    "inline tolerances": 'tolerance = { "strut.2.length" = 0.1, "*.scale" = [0, 1e-6] }\n' + PLANAR,
    "inline each": "each = { drive = { sensor = { resolution = 0.001, scale_error = 1e-6 } } }\n"
    + PLANAR,
    "inline rows": 'strut = [\n  { name = "1", drive = "d1", length_tolerance = "IT7", '
    + STRUT
    + ', material = "steel" }, # first\n  { name = "2", drive = "d2", '
    "base_joint = { clearance = 0.01 }, "
    + STRUT
    + ', material = "steel" },\n]\n'
    + PLANAR[: PLANAR.index("[[strut]]")]
    + PLANAR[PLANAR.index("[condition]") :],
    "cutting data": edited(
        PLANAR,
        (
            FORCE,
            'envelope = { force = "1 kN", normal = [0, 0, 1] }\n[condition.kienzle]\n'
            'specific_force = "2000 MPa"\nexponent = 0.25\nchip_thickness = 0.1\nwidth = 2\n'
            "direction = [1, 0.5, 0]",
        ),
    ),
    "lines of Windows": PLANAR.replace("\n", "\r\n"),
}


@pytest.mark.parametrize("form", thinned(FORMS, ["tables of tables", "cutting data"]))
def test_every_form_of_text(tmp_path: Path, form: str) -> None:
    (tmp_path / "machine.toml").write_text(FORMS[form], encoding="utf-8", newline="")
    machine = tp.load(tmp_path / "machine.toml")
    for witness, written, text in both_states(machine, tmp_path):
        assert "What temperatures" not in text
        force = np.array(machine.condition.force)
        wanted = force if witness.force is None else force + witness.force
        assert np.allclose(written.condition.force, wanted, rtol=1e-14, atol=0.0)
