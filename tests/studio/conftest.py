"""A browser, and a page of the studio that a file of tests serves as `served`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from browser import opened_browser
from served_studio import ServedStudio
from studio_visit import Visit, visited
from system_package import require_web_kernel


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    require_web_kernel()
    with opened_browser(tmp_path_factory.mktemp("profile")) as context:
        yield context


@pytest.fixture
def visit(browser: Any, served: tuple[ServedStudio, Path]) -> Iterator[Visit]:
    with visited(browser, *served) as visit:
        yield visit
