"""Names of files in the machine's folder, and of no other: links and `..` are followed first."""

from __future__ import annotations

from pathlib import Path

from truepose.errors import Problem, RequestError
from truepose.files.one_run import real_path

LONGEST_SHOWN = 200
"""Characters of a name in a message."""


def to_write(folder: Path, name: str) -> Path:
    """Where a file of that name is written: in the folder itself.

    Raises `RequestError` (output-not-writable) for a name that leads anywhere else.
    """
    target = _target(folder, name)
    if target is None or Path(name).name != name or real_path(target).parent != real_path(folder):
        raise RequestError(
            Problem(
                "output-not-writable",
                "the studio writes into the machine file's folder alone",
                found=name[:LONGEST_SHOWN],
                expected="the name of a file in that folder, such as changed.toml",
            )
        )
    return target


def to_read(folder: Path, name: str) -> Path:
    """A file in the folder, or in one below it.

    Raises `RequestError` (file-missing) for a name that leads anywhere else, as for a file that is
    not there: nothing is told of other folders.
    """
    target = _inside(folder, name)
    if target is None or not target.is_file():
        raise _missing(name, "file", "part.ngc")
    return target


def folder_to_read(folder: Path, name: str) -> Path:
    """A folder in the folder, such as the store of a study, or in one below it. As `to_read`."""
    target = _inside(folder, name)
    if target is None or not target.is_dir() or real_path(target) == real_path(folder):
        raise _missing(name, "store", "study.zarr")
    return target


def _missing(name: str, kind: str, example: str) -> RequestError:
    return RequestError(
        Problem(
            "file-missing",
            f"there is no such {kind} in the machine file's folder",
            found=name[:LONGEST_SHOWN],
            expected=f"the name of a {kind} in that folder, such as {example}",
        )
    )


def _inside(folder: Path, name: str) -> Path | None:
    """The path, unless it leads out of the folder."""
    target = _target(folder, name)
    if target is None or not real_path(target).is_relative_to(real_path(folder)):
        return None
    return target


def _target(folder: Path, name: str) -> Path | None:
    """The path, unless the system has no such names."""
    if not name or "\0" in name:
        return None
    try:
        target = folder / name
        target.lstat()
    except FileNotFoundError:
        return target
    except (OSError, ValueError):
        return None
    return target


__all__ = ["folder_to_read", "to_read", "to_write"]
