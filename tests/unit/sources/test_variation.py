"""What a variable varies with: the defaults of the sources, and the key that overrides them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from machine_texts import PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError, RequestError
from truepose.machine import Envelope
from truepose.runs.run import Run
from truepose.runs.variables import Variables
from truepose.sources import ARCSINE, UNIFORM, Deviation, normal
from truepose.sources.variation import (
    WITH_DIRECTION,
    WITH_MACHINE,
    WITH_RUN,
    WITH_VISIT,
    Ripple,
    Rounding,
    Variation,
    with_position,
)

POSES = np.array([[0.25, 0.1], [0.3, 0.2], [0.35, 0.15]])

TABLE = "target (mm), direction, deviation (um)\n" + "".join(
    f"{target}, {way}, {value}\n"
    for target in (0, 900)
    for way, values in (("+", (1, 2, 4)), ("-", (6, 8, 9)))
    for value in values
)

AXIAL = '{ kind = "revolute", axis = [0, 0, 1], clearance = "8 um" }'


def of_drive(given: str, drive: str = "d1") -> tuple[str, str]:
    return f'name = "{drive}"', f'name = "{drive}"\n{given}'


def of_strut(given: str) -> tuple[str, str]:
    return 'name = "1"', f'name = "1"\n{given}'


def of_tolerance(given: str) -> tuple[str, str]:
    return "[condition]", f"[tolerance]\n{given}\n[condition]"


CLEARANCE = (of_strut(f"base_joint = {AXIAL}"), ("force = { x = 1200, y = -1500 }", ""))
ENVELOPE = "force = { x = 1200, y = -1500 }"


def variables_of(folder: Path, source: str, *edits: tuple[str, str]) -> dict[str, Variation]:
    """What the variables of one source vary with, by the variables' names."""
    (folder / "d.csv").write_text(TABLE, encoding="utf-8")
    machine = load_text(folder, edited(PLANAR, *edits))
    ((_, variables),) = Run(machine, POSES).with_variables()
    return {
        name: variation
        for name, owner, variation in zip(
            variables.names, variables.sources, variables.variations, strict=True
        )
        if owner == source
    }


@pytest.mark.parametrize(
    ("source", "edits", "expected"),
    [
        ("tolerance", (), [WITH_MACHINE]),
        ("tolerance", (of_tolerance('"drive.d1.offset" = 0.1'),), [WITH_MACHINE] * 2),
        (
            "tolerance",
            (of_tolerance('"drive.d1.offset" = { band = 0.1, varies = "visit" }'),),
            [WITH_MACHINE, WITH_VISIT],
        ),
        (
            "tolerance",
            (of_tolerance('"drive.d1.offset" = { band = 0.1, varies = "run" }'),),
            [WITH_MACHINE, WITH_RUN],
        ),
        (
            "sensor",
            (of_drive('sensor = { resolution = "5 um", scale_error = "+-12 ppm" }'),),
            [WITH_MACHINE, with_position(Rounding(0, 5e-6))],
        ),
        (
            "sensor",
            (of_drive('sensor = { resolution = "5 um" }', "d2"),),
            [with_position(Rounding(1, 5e-6))],
        ),
        (
            "sensor",
            (
                of_drive(
                    'sensor = { resolution = "5 um", varies = "visit", scale_error = "+-12 ppm", '
                    'scale_error_varies = "run" }'
                ),
            ),
            [WITH_RUN, WITH_VISIT],
        ),
        (
            "sensor",
            (of_drive('sensor = { resolution = "5 um", varies = "machine" }'),),
            [WITH_MACHINE],
        ),
        (
            "actuator",
            (of_drive('actuator = { periodic = { amplitude = "2 um", period = 5 } }', "d2"),),
            [with_position(Ripple(1, 5e-3))],
        ),
        (
            "actuator",
            (
                of_drive(
                    'actuator = { lead_error = "+-66 ppm", varies = "run", periodic = '
                    '{ amplitude = "2 um", period = 5, varies = "machine" } }'
                ),
            ),
            [WITH_RUN, WITH_MACHINE],
        ),
        ("actuator", (of_drive('actuator = { lead_error = "+-66 ppm" }'),), [WITH_MACHINE]),
        ("actuator", (of_drive('actuator = { table = "d.csv" }'),), [WITH_VISIT, WITH_DIRECTION]),
        (
            "actuator",
            (of_drive('actuator = { table = "d.csv", varies = "machine" }'),),
            [WITH_MACHINE, WITH_DIRECTION],
        ),
        (
            "backlash",
            (of_drive('backlash = { play = "10 um", threshold = "9 kN" }'),),
            [WITH_DIRECTION],
        ),
        (
            "backlash",
            (of_drive('backlash = { play = "10 um", threshold = "9 kN", varies = "visit" }'),),
            [WITH_VISIT],
        ),
        ("clearance", CLEARANCE, [WITH_VISIT]),
        (
            "clearance",
            (*CLEARANCE, ("[accuracy]", '[clearance]\nvaries = "machine"\n[accuracy]')),
            [WITH_MACHINE],
        ),
        (
            "guideway",
            (
                of_drive(
                    'guideway = { squareness = { band = "20 um/m", varies = "run" }, straightness '
                    '= [{ direction = [1, 0, 0], amplitude = "5 um", shape = "bow" }, '
                    '{ direction = [1, 0, 0], amplitude = "5 um", shape = "s", '
                    'varies = "visit" }], parallelism = "20 um/m" }'
                ),
            ),
            [WITH_MACHINE, WITH_VISIT, WITH_RUN, WITH_RUN, WITH_MACHINE, WITH_MACHINE],
        ),
        ("loads", ((ENVELOPE, 'envelope = { force = "300 N" }'),), [WITH_RUN] * 3),
        (
            "loads",
            ((ENVELOPE, 'envelope = { force = "300 N", normal = [0, 0, 1], varies = "visit" }'),),
            [WITH_VISIT] * 2,
        ),
    ],
)
def test_what_varies_with_what(
    tmp_path: Path, source: str, edits: tuple[tuple[str, str], ...], expected: list[Variation]
) -> None:
    assert list(variables_of(tmp_path, source, *edits).values()) == expected


@pytest.mark.parametrize(
    ("edit", "fragment", "code", "words"),
    [
        (
            of_drive('sensor = { scale_error = "12 ppm", varies = "visit" }'),
            "sensor =",
            "excluding-keys",
            "no resolution",
        ),
        (
            of_drive('sensor = { resolution = 0, varies = "visit" }'),
            "sensor =",
            "excluding-keys",
            "no resolution",
        ),
        (
            of_drive('sensor = { resolution = "1 um", scale_error_varies = "run" }'),
            "sensor =",
            "excluding-keys",
            "no scale_error",
        ),
        (
            of_drive('sensor = { scale_error = "12 ppm", scale_error_varies = "run" }'),
            "sensor =",
            "excluding-keys",
            "a scale_error that is known",
        ),
        (
            of_drive('sensor = { resolution = "1 um", varies = "direction" }'),
            "sensor =",
            "unknown-choice",
            "position",
        ),
        (
            of_drive(
                'actuator = { periodic = { amplitude = "2 um", period = 5, phase = 30, '
                'varies = "position" } }'
            ),
            "actuator =",
            "excluding-keys",
            "varies and phase",
        ),
        (
            of_drive('actuator = { lead_error = "66 ppm", varies = "run" }'),
            "actuator =",
            "excluding-keys",
            "a lead_error that is known",
        ),
        (
            of_drive(
                'actuator = { periodic = { amplitude = "2 um", period = 5 }, varies = "run" }'
            ),
            "actuator =",
            "excluding-keys",
            "no lead_error and no table",
        ),
        (
            of_drive('actuator = { table = "d.csv", varies = "position" }'),
            "actuator =",
            "unknown-choice",
            "visit",
        ),
        (
            of_drive('backlash = { play = "10 um", varies = "position" }'),
            "backlash =",
            "unknown-choice",
            "direction",
        ),
        (
            ("[accuracy]", '[clearance]\nvaries = "direction"\n[accuracy]'),
            "varies =",
            "unknown-choice",
            "visit",
        ),
        (
            of_drive(
                'guideway = { straightness = [{ direction = [1, 0, 0], amplitude = "5 um", '
                'shape = "bow", known = true, varies = "run" }] }'
            ),
            "guideway =",
            "excluding-keys",
            "known = true",
        ),
        (
            of_drive('guideway = { squareness = { band = 0, varies = "run" } }'),
            "guideway =",
            "excluding-keys",
            "the angle is known",
        ),
        (
            (ENVELOPE, 'envelope = { force = "300 N", varies = "position" }'),
            "envelope =",
            "unknown-choice",
            "run",
        ),
        (
            of_tolerance('"drive.d1.offset" = { band = 0.1, varies = "position" }'),
            '"drive.d1.offset"',
            "unknown-choice",
            '"machine", "run", "visit"',
        ),
        (
            of_tolerance('"drive.d1.offset" = { band = 0.1, varies = 3 }'),
            '"drive.d1.offset"',
            "wrong-type",
            "visit",
        ),
        (
            of_tolerance(
                '"drive.d1.offset" = { band = 0.1, group = "g" }\n'
                '"drive.d2.offset" = { band = 0.1, group = "g", varies = "run" }'
            ),
            '"drive.d2.offset"',
            "excluding-keys",
            "vary together",
        ),
        (
            of_tolerance(
                '"drive.d1.offset" = 0.1\n'
                '"drive.d2.offset" = { band = 0.1, varies = "visit" }\n'
                '[[correlation]]\nbetween = ["drive.*.offset"]\ncoefficient = 0.5'
            ),
            "[[correlation]]",
            "excluding-keys",
            "not drawn together",
        ),
    ],
)
def test_what_varies_with_nothing_is_refused(
    tmp_path: Path, edit: tuple[str, str], fragment: str, code: str, words: str
) -> None:
    (tmp_path / "d.csv").write_text(TABLE, encoding="utf-8")
    text = edited(PLANAR, edit)
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    (problem,) = caught.value.problems
    assert (problem.code, problem.line) == (code, line_of(text, fragment))
    assert words in str(problem)
    assert problem.found
    assert problem.expected


def test_correlated_tolerances_may_vary_with_the_same(tmp_path: Path) -> None:
    edit = of_tolerance(
        '"drive.*.offset" = { band = 0.1, varies = "visit" }\n'
        '[[correlation]]\nbetween = ["drive.*.offset"]\ncoefficient = 0.5'
    )
    assert list(variables_of(tmp_path, "tolerance", edit).values()) == [
        WITH_MACHINE,
        WITH_VISIT,
        WITH_VISIT,
    ]


def test_an_envelope_varies_with_no_direction() -> None:
    assert Envelope(300.0).varies == "run"
    with pytest.raises(RequestError, match="envelope"):
        Envelope(300.0, varies="direction")


class TestBacklash:
    """The flank comes from the way, unless the play is said to vary with something else."""

    @staticmethod
    def variables(folder: Path, given: str) -> Variables:
        text = edited(
            PLANAR,
            of_drive(f'backlash = {{ play = "10 um", threshold = "9 kN"{given} }}'),
            ("length_tolerance = [-0.3, 0.3]\n", ""),
            (
                "grid = { x = [200, 400, 5], y = [100, 300, 3] }",
                "path = { points = [[300, 100], [300, 200], [300, 150]] }",
            ),
        )
        ((_, variables),) = Run(load_text(folder, text)).with_variables()
        return variables

    def test_by_the_way_only_the_first_pose_has_a_band(self, tmp_path: Path) -> None:
        variables = self.variables(tmp_path, "")
        assert variables.half_width[:, 0] == pytest.approx([5e-6, 0.0, 0.0])
        assert not variables.varies_along.any()
        parameters, shift = variables.shift
        at = shift[:, np.flatnonzero(parameters == variables.columns[0])[0]]
        assert at == pytest.approx([0.0, -5e-6, 5e-6])

    def test_with_each_visit_every_pose_has_one(self, tmp_path: Path) -> None:
        variables = self.variables(tmp_path, ', varies = "visit"')
        assert variables.half_width[:, 0] == pytest.approx([5e-6] * 3)
        assert variables.varies_along.all()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"variation": [WITH_VISIT]}, "1 variations, expected 2"),
        ({"groups": [0, 0], "variation": [WITH_VISIT, WITH_RUN]}, "varies in two ways"),
        ({"variation": with_position(Ripple(0, 1.0))}, "has not the distribution"),
        (
            {"distribution": ARCSINE, "variation": with_position(Rounding(0, 1.0))},
            "has not the distribution",
        ),
        (
            {
                "groups": [0, 1],
                "distribution": ARCSINE,
                "directions": [[0, 1]],
                "variation": [WITH_VISIT, WITH_RUN],
            },
            "one direction",
        ),
        (
            {
                "groups": [0, 1],
                "distribution": ARCSINE,
                "directions": [[0, 1]],
                "variation": with_position(Ripple(0, 1.0)),
            },
            "one direction",
        ),
        (
            {"correlation": [[1.0, 0.5], [0.5, 1.0]], "variation": [WITH_VISIT, WITH_RUN]},
            "correlate",
        ),
        (
            {
                "correlation": [[1.0, 0.5], [0.5, 1.0]],
                "variation": with_position(Rounding(0, 1.0)),
            },
            "correlate",
        ),
    ],
)
def test_a_deviation_varies_in_one_way(given: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Deviation.of([0, 1], half=1e-3, **given)  # type: ignore[arg-type]


def test_a_deviation_varies_with_the_machine_unless_it_says_so() -> None:
    assert Deviation.of([0, 1], half=1e-3).variation == (WITH_MACHINE,) * 2
    given = Deviation.of(
        [0, 1],
        half=1e-3,
        distribution=[normal(2.0), UNIFORM],
        variation=[WITH_VISIT, with_position(Rounding(0, 1e-6))],
    )
    assert [one.along_the_way for one in given.variation] == [True, True]
