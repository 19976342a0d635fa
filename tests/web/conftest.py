"""One module for all tests of a worker, and machines with their bundles."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from web_kernel import WebKernel, web_kernel


@pytest.fixture(scope="session")
def kernel() -> Iterator[WebKernel]:
    with web_kernel() as running:
        yield running
