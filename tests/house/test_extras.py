"""What the package asks for besides, by extra."""

from __future__ import annotations

import tomllib
from pathlib import Path

PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))
EXTRAS: dict[str, list[str]] = PROJECT["project"]["optional-dependencies"]


def test_the_studio_asks_for_what_its_page_is_made_with() -> None:
    assert set(EXTRAS["report"]) < set(EXTRAS["studio"])


def test_no_extra_is_made_of_the_package_itself() -> None:
    # maturin hands the extras' packages to pip, which would look for truepose in the index
    name = PROJECT["project"]["name"]
    assert not [one for asked in EXTRAS.values() for one in asked if one.startswith(name)]
