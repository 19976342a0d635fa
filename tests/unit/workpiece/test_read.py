"""Parts as they are shipped and as the page has them, with the kinds of features that there are."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from truepose.errors import PartError
from truepose.workpiece.propose import propose_features
from truepose.workpiece.read import read_part
from truepose.workpiece.tables import DatumTable, FeatureTable, PartTable

ROOT = Path(__file__).parent.parent.parent.parent
SQUARE = ROOT / "examples" / "part" / "square.ngc"
EXAMPLES = {"square": "linear_delta", "pocket": "hexapod"}
PAGE = (ROOT / "docs" / "part_file.md").read_text("utf-8")


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_examples_are_parts_that_the_machine_can_make(name: str) -> None:
    machine = tp.load(MACHINES / f"{EXAMPLES[name]}.toml")
    files = [ROOT / "examples" / "part" / f"{name}.{ending}" for ending in ("ngc", "toml")]
    part = read_part(machine, *files)
    assert len(part.features) == {"square": 5, "pocket": 7}[name]
    batches = list(part.path())
    points = np.concatenate([batch.points[batch.element >= 0] for batch in batches])
    assert len(points) == part.n_point
    for element in part.elements:
        np.testing.assert_array_equal(points[element.place], element.points)
    for feature in part.features:
        every = [element.points[np.newaxis] for element in (*feature.elements, *feature.datums)]
        (values,) = feature.values(every)
        for value, quantity in zip(values, feature.quantities, strict=True):
            # What is programmed is nominal; a hole is 16 mm, in the middle of its limits or not.
            assert value == pytest.approx(quantity.nominal, abs=1e-12)


@pytest.mark.parametrize("name", EXAMPLES)
def test_what_is_found_in_the_examples_can_be_read(name: str, tmp_path: Path) -> None:
    machine = tp.load(MACHINES / f"{EXAMPLES[name]}.toml")
    program, file = ROOT / "examples" / "part" / f"{name}.ngc", tmp_path / "found.toml"
    file.write_text(propose_features(machine, program))
    found = [feature.kind for feature in read_part(machine, program, file).features]
    assert (
        found
        == {"square": ["circle", "size", "size"], "pocket": ["circle"] * 4 + ["size"] * 2}[name]
    )


def test_the_comments_of_the_page_are_a_part(tmp_path: Path) -> None:
    *_, comments = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)
    program = tmp_path / "part.ngc"
    program.write_text(f"G21 G17 G90 G94 F900\nG0 X-50 Y-50 Z10\n{comments}M2\n")
    part = read_part(tp.load(MACHINES / "linear_delta.toml"), program)
    found = {feature.name: feature for feature in part.features}
    assert {name: feature.kind for name, feature in found.items()} == {
        "depth": "size",
        "width": "size",
        "corner": "perpendicularity",
        "hole": "circle",
    }
    assert found["width"].quantities[0].upper == pytest.approx(0.1001, rel=1e-12)
    (datum,) = found["corner"].datums
    np.testing.assert_array_equal(datum.place, found["depth"].elements[0].place)


def test_the_page_has_every_key() -> None:
    tables = (PartTable, DatumTable, FeatureTable)
    keys = {name for table in tables for name in table.model_fields}
    assert sorted(key for key in keys if f"`{key}`" not in PAGE) == []


@pytest.mark.parametrize(
    ("order", "found"),
    [('["A", "B"]', "B does not say anything"), ('["A"]', "A does not say where the part is")],
)
def test_datums_of_the_part_that_are_no_frame_are_refused_with_their_line(
    tmp_path: Path, order: str, found: str
) -> None:
    file = tmp_path / "part.toml"
    file.write_text(
        f'schema = 1\n[part]\nalignment = "datums"\ndatums = {order}\n'
        '[[datum]]\nname = "A"\nn = "N20"\n[[datum]]\nname = "B"\nn = "N40"\n'
        '[[feature]]\nname = "a"\nkind = "straightness"\nn = "N30"\nzone = "0.1 mm"\n'
    )
    with pytest.raises(PartError, match=found) as refusal:
        read_part(tp.load(MACHINES / "linear_delta.toml"), SQUARE, file)
    (problem,) = refusal.value.problems
    assert (problem.code, problem.file, problem.line) == ("feature-datums", str(file), 4)
