"""A release is refused while something stands against it, and not otherwise."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from release import ROOT
from release.check import objections
from release.names import CITATION, names, write

PLACEHOLDERS = [
    "authors[0].family-names",
    "authors[0].given-names",
    "contact[0].name",
    "contact[0].email",
    "repository-code",
]
REAL = {
    "family-names: PLACEHOLDER": "family-names: Doe",
    "given-names: PLACEHOLDER": "given-names: Jane",
    "name: PLACEHOLDER": "name: Jane Doe",
    "contact@placeholder.invalid": "jane@example.org",
    "https://placeholder.invalid/truepose": "https://example.org/doe/truepose/",
}


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """What a release is judged by, of a checkout that is ready for 0.1.0 but for its names."""
    for name in (CITATION, "pyproject.toml", "Cargo.toml", "CHANGELOG.md"):
        shutil.copy(ROOT / name, tmp_path / name)
    (tmp_path / "tests" / "archive" / "0.1").mkdir(parents=True)
    edit(
        tmp_path / "CHANGELOG.md", {"## [Unreleased]": "## [Unreleased]\n\n## [0.1.0] - 2027-01-31"}
    )
    for name, pattern in (("pyproject.toml", "version = "), (CITATION, "version: ")):
        text = (tmp_path / name).read_text("utf-8")
        text = re.sub(rf'^({pattern}"?)[\d.]+', r"\g<1>0.1.0", text, count=1, flags=re.MULTILINE)
        (tmp_path / name).write_text(text, "utf-8")
    return tmp_path


def edit(path: Path, changes: dict[str, str]) -> None:
    text = path.read_text("utf-8")
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text, "utf-8")


@pytest.mark.parametrize("place", PLACEHOLDERS)
def test_every_name_to_come_stands_against_a_release(checkout: Path, place: str) -> None:
    if place not in names(checkout).missing:
        pytest.skip("the name exists by now")
    assert f"{CITATION}: {place} is a placeholder or missing" in objections(checkout)


def test_names_are_not_written_while_a_placeholder_stands(checkout: Path) -> None:
    if not names(checkout).missing:
        pytest.skip("all names exist by now")
    before = (checkout / "pyproject.toml").read_text("utf-8")
    with pytest.raises(ValueError, match="repository-code"):
        write(checkout)
    assert (checkout / "pyproject.toml").read_text("utf-8") == before


@pytest.fixture
def ready(checkout: Path) -> Path:
    """The same, with names."""
    if names(checkout).missing:
        edit(checkout / CITATION, REAL)
    write(checkout)
    return checkout


def test_nothing_stands_against_a_release_that_is_ready(ready: Path) -> None:
    assert objections(ready) == []
    assert objections(ready, "v0.1.0") == []


def test_one_placeholder_is_enough(ready: Path) -> None:
    edit(ready / CITATION, {"type: software": "type: software\nabstract: PlaceHolder of one"})
    assert objections(ready) == [f"{CITATION}: abstract is a placeholder or missing"]


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("CITATION.cff", "version: 0.1.0", "version: 0.2.0", "CITATION.cff has version 0.2.0"),
        ("Cargo.toml", 'version = "', 'version = "9', "Cargo.toml has version 9"),
        ("CHANGELOG.md", "## [0.1.0] - 2027-01-31", "", "CHANGELOG.md has no section"),
        ("CITATION.cff", "repository-code: ", "repository-code: https://other/", "project.urls"),
        ("CITATION.cff", "\nauthors:", "\nother:", "authors is a placeholder or missing"),
    ],
)
def test_what_differs_is_said(ready: Path, file: str, old: str, new: str, said: str) -> None:
    edit(ready / file, {old: new})
    found = objections(ready)
    assert len(found) == 1
    assert said in found[0]


@pytest.mark.parametrize("tag", ["0.1.0", "v0.1.1"])
def test_a_tag_that_is_not_the_version_s_is_refused(ready: Path, tag: str) -> None:
    assert len(objections(ready, tag)) == 1


def test_an_archive_is_wanted(ready: Path) -> None:
    (ready / "tests" / "archive" / "0.1").rmdir()
    assert objections(ready) == ["no tests/archive/0.1; run: python tests/make_archive.py 0.1"]
