"""`import truepose` costs nothing, and its names are there when they are used."""

from __future__ import annotations

import subprocess
import sys

import pytest

import truepose

HEAVY = ("numpy", "pydantic", "pint", "xarray", "rich", "truepose._kernel", "truepose.machine")


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = f"import sys, truepose; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", truepose.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(truepose, name) is not None
    assert name in dir(truepose)


def test_a_name_that_is_not_there() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        truepose.nothing  # noqa: B018


def test_the_version_is_that_of_the_package() -> None:
    from importlib.metadata import version

    assert truepose.__version__ == version("truepose")


def test_threads() -> None:
    before = truepose.threads()
    try:
        assert truepose.threads(1) == 1
        assert truepose.threads() == 1
    finally:
        truepose.threads(before)
