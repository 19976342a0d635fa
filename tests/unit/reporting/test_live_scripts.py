"""What a live page works out by itself, without a browser.

Numbers as people read them, the verdict at a pose, and how far each source may go.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from importlib.resources import files
from typing import Any

import numpy as np
import pytest

from node import run_script

SCRIPTS = ("numbers.js", "controls.js", "verdict.js", "ranking.js")

UNITS = {
    "length": {"label": "mm", "si": 1e-3},
    "angle": {"label": "deg", "si": np.pi / 180},
    "small_length": {"label": "µm", "si": 1e-6},
    "small_angle": {"label": "mdeg", "si": np.pi / 180e3},
    "temperature": {"label": "°C", "si": 1.0, "offset": 273.15},
}

# Of a document so much as the table asks for; what is put in a cell is its text.
DOCUMENT = """
function element(name, attributes, ...content) {
  return {attributes, content, dataset: {}, get children() { return this.content; },
          append(...more) { this.content.push(...more); },
          replaceChildren(...rows) { this.content = rows; }};
}
function put(cell, value, text) { cell.text = text; }
"""

Evaluate = Callable[..., Any]


@pytest.fixture(scope="module")
def evaluated() -> Evaluate:
    """A function: what an expression says, whose names are values; `numbers` writes English."""
    folder = files("truepose.reporting.live")
    scripts = "\n".join(folder.joinpath(name).read_text(encoding="utf-8") for name in SCRIPTS)
    english = json.dumps({"units": UNITS, "marks": {"decimal": ".", "group": ","}})
    head = f"{scripts}{DOCUMENT}const numbers = numbersOf({english});\n"

    def evaluate(expression: str, **values: Any) -> Any:
        given = "".join(f"const {name} = {json.dumps(of)};\n" for name, of in values.items())
        return json.loads(
            run_script(f"{head}{{\n{given}console.log(JSON.stringify({expression}));\n}}")
        )

    return evaluate


@pytest.mark.parametrize(
    ("marks", "wanted"),
    [
        (".,", ["0.0", "0.0", "−2.50", "1234.5", "12,345.7", "−1,234,567", "–", "–", "–"]),
        (",.", ["0,0", "0,0", "−2,50", "1234,5", "12.345,7", "−1.234.567", "–", "–", "–"]),
    ],
)
def test_numbers_have_the_marks_of_the_language(
    evaluated: Evaluate, marks: str, wanted: list[str]
) -> None:
    said = evaluated(
        """[[0, 1], [-0.04, 1], [-2.5, 2], [1234.5, 1], [12345.67, 1], [-1234567, 0], [null, 1],
            [NaN, 1], [Infinity, 1]].map(([value, decimals]) => spoken.fixed(value, decimals))
        """.replace("spoken", "numbersOf({units, marks})"),
        units=UNITS,
        marks={"decimal": marks[0], "group": marks[1]},
    )
    assert said == wanted


def test_three_digits_are_shown_and_two_decimals_at_most(evaluated: Evaluate) -> None:
    sizes = [999.4, 100, 99, 10, 9.9, 1, 0.5, 1e-9, 0, -5, None]
    assert evaluated("sizes.map(numbers.decimalsOf)", sizes=sizes) == [
        0, 0, 1, 1, 2, 2, 2, 2, 1, 1, 1,
    ]  # fmt: skip


def test_an_error_is_so_fine_that_it_differs_from_what_is_asked(evaluated: Evaluate) -> None:
    cases = [
        (123.4e-6, "x", None, "123 µm"),
        (-0.05e-6, "z", None, "−0.05 µm"),
        (np.pi / 180e3 * 2.345, "rz", None, "2.35 mdeg"),
        (np.pi / 180e3 * 23.46, "orientation", None, "23.5 mdeg"),
        (None, "x", None, "–"),
        (500e-6, "position", 500e-6, "500 µm"),
        (500.2e-6, "position", 500e-6, "500.2 µm"),
        (499.9996e-6, "position", 500e-6, "499.9996 µm"),
        # Equal within six more decimals: no finer.
        (500.00000001e-6, "position", 500e-6, "500.000000 µm"),
        (0.0, "position", 350e-6, "0.0 µm"),
    ]
    said = evaluated("given.map(one => numbers.error(...one))", given=[case[:3] for case in cases])
    assert said == [case[3] for case in cases]


def test_units_are_shown_and_meant(evaluated: Evaluate) -> None:
    values = {"length": (0.25, 250.0), "angle": (np.pi, 180.0), "temperature": (293.15, 20.0)}
    for name, (si, number) in values.items():
        there, back = evaluated(
            "[numbers.shown(si, unit), numbers.meant(number, unit)]",
            si=si, number=number, unit=UNITS[name],
        )  # fmt: skip
        assert there == pytest.approx(number)
        assert back == pytest.approx(si)
    poses = evaluated("['x', 'z', 'rx'].map(name => numbers.ofPose(name).label)")
    assert poses == ["mm", "mm", "deg"]


def test_sizes_are_of_their_components(evaluated: Evaluate) -> None:
    components = ["x", "y", "z", "rx", "ry"]

    def size(error: list[float | None], quantity: str) -> Any:
        return evaluated(
            "sizeOf(error, components, quantity)",
            error=error, components=components, quantity=quantity,
        )  # fmt: skip

    assert size([3, 4, 12, -6, 8], "position") == 13
    assert size([3, 4, 12, -6, 8], "orientation") == 10
    assert size([3, None, 12, -6, 8], "position") is None
    assert size([3, None, 12, -6, 8], "orientation") == 10
    of = [["x", "y"], ["x", "rz"], ["rx"]]
    assert evaluated("of.map(quantitiesOf)", of=of) == [
        ["position"], ["position", "orientation"], ["orientation"],
    ]  # fmt: skip


def test_round_numbers_are_no_smaller(evaluated: Evaluate) -> None:
    values = [0.3, 1, 1 + 1e-12, 1.1, 2.1, 6, 430, 0]
    rounded = evaluated("values.map(value => roundUp(value))", values=values)
    assert rounded == pytest.approx([0.5, 1, 1, 2, 5, 10, 500, 0])
    assert evaluated("roundUp(11, [1, 1.2, 1.5])") == pytest.approx(12)


def test_places_of_a_sentence_are_filled(evaluated: Evaluate) -> None:
    assert evaluated("filled('{one}, {two} and {one}', {one: 'a', two: 0})") == "a, 0 and a"


PROVEN = {"status": "proven", "magnitude": {"position": 0.5, "orientation": 3.0}}


@pytest.mark.parametrize(
    ("bound", "found", "word"),
    [
        # Asked is 0.5: as much as that is kept.
        (PROVEN, [0.5, 0.4, None], "met"),
        (PROVEN, [0.3, None], "met"),
        (PROVEN | {"magnitude": {"position": 0.4, "orientation": 3.0}}, [0.3], "met"),
        (PROVEN | {"magnitude": {"position": 0.6, "orientation": 0.1}}, [0.4, None], "open"),
        (PROVEN | {"magnitude": {"position": 0.6, "orientation": 0.1}}, [0.4, 0.51], "missed"),
        ({"status": "near_singular"}, [0.4], "open"),
        ({"status": "near_singular"}, [0.51], "missed"),
        (None, [0.4], "computing"),
        (None, [None], "computing"),
        (None, [0.4, 0.51], "missed"),
    ],
)
def test_the_verdict_of_a_quantity(
    evaluated: Evaluate, bound: Any, found: list[float | None], word: str
) -> None:
    expression = "judged(0.5, 'position', bound ?? undefined, found)"
    assert evaluated(expression, bound=bound, found=found) == word


def test_the_worst_quantity_decides(evaluated: Evaluate) -> None:
    # What is computed may become anything yet, but where one is NOT met already.
    worst_first = ["missed", "computing", "open", "met"]
    cases = [some for count in range(1, 5) for some in itertools.permutations(worst_first, count)]
    wanted = [next(word for word in worst_first if word in some) for some in cases]
    assert evaluated("cases.map(together)", cases=cases) == wanted


def test_only_bands_hold_what_is_drawn(evaluated: Evaluate) -> None:
    def within(*kinds: str) -> Any:
        variables = [{"distribution": {"kind": kind}} for kind in kinds]
        return evaluated("allWithin(variables)", variables=variables)

    assert within() is True
    assert within("uniform", "triangular", "arcsine", "two-point", "discrete") is True
    assert within("uniform", "normal") is False


def test_sources_are_ranked_by_how_far_they_may_go(evaluated: Evaluate) -> None:
    rows = evaluated(
        """(() => {
          const host = element("div");
          const table = sourcesTable(host, {
            components: ["x", "rz"], quantities: ["position", "orientation"], sources, words,
            target: {position: 45.6701e-6}, numbers,
          });
          table.show(bySource, reaches, errors);
          return host.content[0].content[1].content.map(row => [
            row.dataset.of, ...row.content.slice(1).map(cell => cell.text)]);
        })()""",
        sources=[
            {"name": name, "doc": "", "live": name != "play"}
            for name in ("small", "large", "play", "lost")
        ],
        words={"quantities": {"position": "position", "orientation": "orientation"},
               "up_to": "{quantity} up to", "source": "", "together": "", "compensated": ""},
        bySource={"small": [-2e-6, 0.0], "large": [1e-6, np.pi / 180e3], "lost": None},
        reaches={
            "small": {"position": 3e-6, "orientation": 0.0},
            "large": {"position": 45.67e-6, "orientation": 2 * np.pi / 180e3},
            "before": {"position": 48e-6, "orientation": 2 * np.pi / 180e3},
        },
        errors={"before": [-1e-6, np.pi / 180e3], "after": None},
    )  # fmt: skip
    assert rows == [
        ["large", "1.0", "1.00", "1.0", "1.00", "45.6700", "2.00"],
        ["small", "−2.0", "0.00", "2.0", "0.00", "3.0", "0.00"],
        ["lost", *["–"] * 6],
        ["before", "−1.0", "1.00", "1.0", "1.00", "48.0", "2.00"],
        ["after", *["–"] * 6],
    ]
