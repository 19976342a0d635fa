"""What an adapter writes, as files in a folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import truepose as tp
from truepose.machine import Machine


def written(
    machine: Machine,
    adapter: str,
    folder: Path,
    ending: str,
    options: Mapping[str, str] | None = None,
) -> Path:
    """Writes all files of an export; the path of the one with an ending."""
    files = tp.export(machine, adapter, options or {}).files
    for name, text in files.items():
        (folder / name).write_text(text, "utf-8")
    (path,) = (folder / name for name in files if name.endswith(ending))
    return path
