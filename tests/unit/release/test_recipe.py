"""Conda's recipe asks for what the package does."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from release import ROOT
from release.conda import recipe, recipe_text, spaced
from release.names import names

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))


def test_the_recipe_is_made_of_the_project() -> None:
    made = recipe(PROJECT, "https://example.org/doe/truepose", "0" * 64)
    assert made["context"]["version"] == PROJECT["project"]["version"]
    assert made["source"]["url"].startswith("https://example.org/doe/truepose/releases/download/v$")
    run = made["requirements"]["run"]
    assert run[0] == "python >=3.11"
    assert [one.replace(" ", "") for one in run[1:]] == PROJECT["project"]["dependencies"]
    assert "maturin >=1.16,<2" in made["requirements"]["host"]
    assert made["extra"]["recipe-maintainers"] == ["doe"]


def test_versions_are_spaced() -> None:
    assert spaced("numpy>=1.26,<3") == "numpy >=1.26,<3"
    assert spaced("numpy") == "numpy"


def test_no_recipe_is_made_with_placeholders(tmp_path: Path) -> None:
    if not names().missing:
        pytest.skip("all names exist by now")
    with pytest.raises(ValueError, match="repository-code"):
        recipe_text(ROOT, tmp_path)
