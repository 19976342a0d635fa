"""What a test needs of the system: where it is missing, the test is skipped, and fails in CI."""

from __future__ import annotations

import os
from typing import NoReturn

import pytest


def missing(what: str) -> NoReturn:
    """Skip the test; in CI, where `.ci/run` installs what the tests need, fail it."""
    if os.environ.get("TRUEPOSE_CI"):
        pytest.fail(what)
    pytest.skip(what)


def require_web_kernel() -> None:
    """Skip the test where the kernel for pages was not built; in CI, fail it."""
    from truepose.reporting.live import part

    if not part.is_built():
        missing("the kernel for browsers is not built: make web")
