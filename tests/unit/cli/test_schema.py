"""`truepose schema`: the schema of the documentation, which the template names for editors."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from build_machine import machine_files
from command_line import call
from truepose.machine.library import SCHEMA_FILE, SCHEMA_LINE

DOCS = Path(__file__).parents[3] / "docs"
Capture = pytest.CaptureFixture[str]


def test_it_is_the_schema_of_the_documentation(capsys: Capture, tmp_path: Path) -> None:
    written = (DOCS / "machine_file.schema.json").read_text("utf-8")
    assert call(capsys, "schema").out == written
    file = tmp_path / SCHEMA_FILE
    outcome = call(capsys, "schema", "-o", file)
    assert (outcome.code, outcome.out, outcome.err) == (0, "", f"wrote {file}\n")
    assert file.read_text("utf-8") == written


def test_another_ending_is_refused(capsys: Capture, tmp_path: Path) -> None:
    outcome = call(capsys, "schema", "-o", tmp_path / "schema.toml")
    assert (outcome.code, outcome.codes) == (2, ["output-ending"])


def test_a_template_names_it_and_shipped_machines_do_not(capsys: Capture, tmp_path: Path) -> None:
    file = tmp_path / "m.toml"
    assert call(capsys, "init", "hexapod", "-o", file).code == 0
    assert f"#:schema {SCHEMA_FILE}\n" == SCHEMA_LINE
    assert file.read_text("utf-8").startswith(SCHEMA_LINE)
    for shipped in machine_files():
        assert "#:schema" not in shipped.read_text("utf-8")


def test_it_says_what_json_schema_is_written_in(capsys: Capture) -> None:
    schema = json.loads(call(capsys, "schema").out)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"


@pytest.fixture(scope="module")
def validator() -> Any:
    """Another's reading of the schema, as an editor has one."""
    schema = json.loads((DOCS / "machine_file.schema.json").read_text("utf-8"))
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


@pytest.mark.parametrize("file", machine_files(), ids=lambda file: file.stem)
def test_every_shipped_machine_is_valid_by_it(file: Path, validator: Any) -> None:
    faults = [error.message for error in validator.iter_errors(tomllib.loads(file.read_text()))]
    assert faults == []


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        ("length = 333.000181", "lenght = 333.000181", "lenght"),
        ('kind = "slider"', 'kind = "slyder"', "slyder"),
        ("axis = [0, 0, 1]", "axis = [0, 0]", "[0, 0]"),
        ("[machine]", "[[machine]]", "machine"),
    ],
)
def test_what_an_editor_is_to_mark_is_invalid_by_it(
    before: str, after: str, told: str, validator: Any
) -> None:
    text = (Path(machine_files()[0]).parent / "linear_delta.toml").read_text("utf-8")
    assert before in text
    faults = list(validator.iter_errors(tomllib.loads(text.replace(before, after, 1))))
    assert any(told in f"{error.message} {list(error.absolute_path)}" for error in faults)
