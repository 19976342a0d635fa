"""A browser, and a page of the studio that a file of tests serves as `served`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from browser import opened_browser
from served_studio import ServedStudio
from studio_visit import Visit, visited
from system_package import missing
from truepose.reporting.live import part


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    if not part.is_built():
        missing("the kernel for browsers is not built: make web")
    with opened_browser(tmp_path_factory.mktemp("profile"), live=True) as context:
        yield context


@pytest.fixture
def visit(browser: Any, served: tuple[ServedStudio, Path]) -> Iterator[Visit]:
    with visited(browser, *served) as visit:
        yield visit
