"""The version that is installed, which every result and every written file carries."""

from __future__ import annotations

from functools import cache
from importlib import metadata


@cache
def version() -> str:
    """The installed version of truepose."""
    return metadata.version("truepose")
