"""Every number of every machine file is a field, and what a field shows is what the file says."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from command_line import MACHINES
from truepose.errors import TrueposeError
from truepose.files.toml_text import TomlError, parse_toml
from truepose.studio.edited_file import OpenedFile
from truepose.studio.fields import NOT_SHOWN, FileField, descriptions, fields_of, refusal

EVERY = sorted(MACHINES.glob("*.toml"))


def fields_in(path: Path) -> dict[str, FileField]:
    file = OpenedFile.read(path)
    return {field.key: field for field in fields_of(file.text, file.machine())}


def numbers(value: Any) -> Iterator[float]:
    if isinstance(value, dict):
        for below in value.values():
            yield from numbers(below)
    elif isinstance(value, list):
        for below in value:
            yield from numbers(below)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield float(value)


@pytest.mark.parametrize("path", EVERY, ids=lambda path: path.stem)
def test_all_fields_set_to_what_they_show_are_the_file(path: Path) -> None:
    file = OpenedFile.read(path)
    fields = fields_of(file.text, file.machine())
    edits = tuple((field.key, field.text) for field in fields)
    assert len(dict(edits)) == len(edits)
    assert all("\n" not in field.text for field in fields)
    assert parse_toml(file.edited(edits)) == parse_toml(file.text)


@pytest.mark.parametrize("path", EVERY, ids=lambda path: path.stem)
def test_no_number_of_the_file_is_missing(path: Path) -> None:
    file = OpenedFile.read(path)
    data = {key: of for key, of in parse_toml(file.text).items() if key not in NOT_SHOWN}
    shown: list[float] = []
    for field in fields_of(file.text, file.machine()):
        try:
            shown += numbers(parse_toml(f"value = {field.text}")["value"])
        except TomlError:  # a quantity with its unit is text in the file, too
            continue
    assert sorted(shown) == sorted(numbers(data))


@pytest.mark.parametrize("path", EVERY, ids=lambda path: path.stem)
def test_every_field_says_what_it_is(path: Path) -> None:
    for field in fields_in(path).values():
        assert descriptions()[field.about], field


def test_units_groups_and_tables() -> None:
    fields = fields_in(MACHINES / "hexapod_all_sources.toml")
    one = fields["strut.2.length"]
    assert (one.text, one.unit, one.dimension, one.group, one.table) == (
        "660", "mm", "length", False, "strut.2",
    )  # fmt: skip
    shared = fields["each.strut.section_area"]
    assert (shared.text, shared.unit, shared.dimension) == ("327 mm^2", "", "area")
    assert (shared.group, shared.table, shared.about) == (
        True,
        "[each.strut]",
        "strut.section_area",
    )
    group = fields["tolerance.strut.*.platform.*"]
    assert (group.unit, group.group, group.table) == ("mm", True, "[tolerance]")
    assert fields["condition.temperature.strut.1"].unit == "degC"
    assert fields["strut.1.base.y"].text == "131.112308"
    assert fields["workspace.grid.x"].text == "[-60, 60, 3]"
    turned = fields_in(MACHINES / "rotary_delta.toml")
    assert turned["drive.a.travel"].unit == "deg", "of a crank"
    assert turned["tolerance.drive.*.offset"].dimension == "angle"


def test_a_word_of_a_few_says_which() -> None:
    fields = fields_in(MACHINES / "hexapod.toml")
    material = fields["strut.1.material"]
    assert (material.text, material.unit, material.group) == ("steel", "", False)
    assert {"steel", "invar", "carbon fibre"} < set(material.choices)
    assert fields["strut.1.stiffness"].choices == ()
    modes = [field for key, field in fields_in(MACHINES / "five_bar.toml").items() if "mode" in key]
    assert [field.choices for field in modes] == [("+", "-")] * 2
    # What a part is, is not changed.
    assert not [key for key in fields_in(MACHINES / "3prs.toml") if key.endswith(".kind")]


def test_what_is_edited_says_what_the_file_has() -> None:
    file = OpenedFile.read(MACHINES / "hexapod.toml")
    edits = (("strut.1.stiffness", "31 N/um"), ("strut.1.mass", "2 kg"))
    own = {field.key: field.text for field in fields_of(file.text, file.machine())}
    fields = fields_of(file.edited(edits), file.machine(edits), own)
    edited = {field.key: (field.text, field.file) for field in fields if field.text != field.file}
    assert edited == {
        "strut.1.stiffness": ("31 N/um", "30 N/um"),
        "strut.1.mass": ("2 kg", None),
    }


@pytest.mark.parametrize(
    ("key", "value", "code", "message"),
    [
        ("condition.temperature", "5 N", "wrong-dimension",
         "condition.temperature: expected a temperature, found a force"),
        ("strut.1.stiffness", "0 N/um", "not-positive",
         "strut.1.stiffness: a stiffness of zero cannot carry a load"),
        ("strut.9.length", "3", "bad-setting", "there is no such strut"),
        ("strut.1.lenght", "3", "unknown-key", "strut.1.lenght: unknown key"),
    ],
)  # fmt: skip
def test_refusals_are_in_the_files_words(key: str, value: str, code: str, message: str) -> None:
    file = OpenedFile.read(MACHINES / "hexapod.toml")
    with pytest.raises(TrueposeError) as failure:
        file.edited(((key, value),))
    (problem,) = refusal(failure.value)
    assert (problem["code"], problem["message"]) == (code, message)
    assert problem["path"] == key
    assert problem["expected"]
