"""Files for programs, one format a file: `write(result, path)`; text formats have `text(result)`.

To add a format: write the module and name its ending in `FORMATS`.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path

from truepose.files.writing import replacing
from truepose.reporting.result import Result

FORMATS: dict[str, str] = {
    ".json": "truepose.reporting.formats.json_text",
    ".csv": "truepose.reporting.formats.csv_text",
    ".nc": "truepose.reporting.formats.netcdf",
}
"""Ending of a file -> module that writes it."""


def text(result: Result, ending: str) -> Iterator[str]:
    """The pieces of a result as text in the format of `ending`."""
    pieces: Iterator[str] = importlib.import_module(FORMATS[ending]).text(result)
    return pieces


def write(result: Result, path: Path) -> None:
    """Write a result in the format of the path's ending, whole or not at all."""
    module = importlib.import_module(FORMATS[path.suffix.lower()])
    with replacing(path) as temporary:
        module.write(result, temporary)
