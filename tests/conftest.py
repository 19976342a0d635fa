"""What all tests share: golden files, what was collected, and one folder for what they compile."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

import results_file
from sweeps import COLLECTED, member_of, skip_beyond_time

GOLDEN = Path(__file__).parent / "golden"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write the golden files of tests/golden anew; read the difference before you commit",
    )
    parser.addoption("--results", metavar="FILE", help="write what the tests found to FILE (JSON)")


def pytest_configure(config: pytest.Config) -> None:
    results_file.start(config)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    config.stash[COLLECTED] = [member_of(item) for item in items]


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    skip_beyond_time(item)


@pytest.fixture(scope="session")
def builds(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of this run, for all workers, in which compiled programs are kept."""
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "builds"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Callable[[str, str], str]:
    """A function (name, found) -> text of the golden file, refreshed with `found` if asked."""

    def expected(name: str, found: str) -> str:
        path = GOLDEN / name
        if request.config.getoption("--update-golden"):
            path.write_text(found, encoding="utf-8")
        assert path.exists(), f"no golden file {name}: run pytest --update-golden"
        return path.read_text(encoding="utf-8")

    return expected
