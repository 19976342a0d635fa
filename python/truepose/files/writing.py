"""Write a file whole or not at all."""

from __future__ import annotations

import os
import secrets
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from truepose.errors import Fault, RequestError
from truepose.files.wording import one_of


def require_writable(path: Path, endings: Collection[str], inputs: Collection[Path] = ()) -> None:
    """Refuse an output path before the work is done, not after.

    `endings` are those that can be written (".json", ...); `inputs` are files that must survive.
    Raises `RequestError` (codes `output-ending`, `output-not-writable`, `output-is-input`).
    """
    ending = path.suffix.lower()
    folder = Path(os.path.realpath(path)).parent
    if ending not in endings:
        raise _refusal(
            Fault(
                "output-ending",
                "the ending of the output file is not one that can be written",
                found=ending or "no ending",
                expected=one_of(sorted(endings)),
            ),
            path,
        )
    if not folder.is_dir():
        raise _refusal(
            Fault(
                "output-not-writable",
                "the folder of the output file does not exist",
                found=str(folder),
                expected="a folder that exists",
                hint=f"create it first: mkdir -p {folder}",
            ),
            path,
        )
    if any(path.exists() and source.exists() and path.samefile(source) for source in inputs):
        raise _refusal(
            Fault(
                "output-is-input",
                "the output would write over the machine file",
                found=str(path),
                expected="another file",
            ),
            path,
        )
    if path.is_dir():
        raise _refusal(
            Fault(
                "output-not-writable",
                "the output path is a folder",
                found="a folder",
                expected="a file name",
            ),
            path,
        )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise _refusal(
            Fault(
                "output-not-writable",
                "nothing may be written into the folder of the output file",
                found=f"no write permission for {folder}",
                expected="a folder that you may write into",
            ),
            path,
        )


def require_new(path: Path) -> None:
    """Refuse a path where something stands. Raises `RequestError` (code `output-exists`)."""
    if path.exists() or path.is_symlink():
        raise _refusal(
            Fault(
                "output-exists",
                "the file exists already and is not overwritten",
                found=str(path),
                expected="a name that is free",
                hint="give another name: --output FILE",
            ),
            path,
        )


def require_folder(path: Path, names: Collection[str] = ()) -> None:
    """Make a folder that files `names` can be written into, or refuse it before the work is done.

    Raises `RequestError` (code `output-not-writable`).
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise _refusal(
            Fault(
                "output-not-writable",
                "the output folder cannot be made",
                found="a file, or a link to nothing"
                if isinstance(failure, FileExistsError)
                else failure.strerror or str(failure),
                expected="a folder that you may write into, or a name that is free",
            ),
            path,
        ) from failure
    if not os.access(path, os.W_OK | os.X_OK):
        raise _refusal(
            Fault(
                "output-not-writable",
                "nothing may be written into the output folder",
                found="no write permission",
                expected="a folder that you may write into",
            ),
            path,
        )
    for name in names:
        if (path / name).is_dir():
            raise _refusal(
                Fault(
                    "output-not-writable",
                    "a folder stands where a file is to be written",
                    found="a folder",
                    expected="a file, or a name that is free",
                ),
                path / name,
            )


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file beside `path` that takes its place when the block ends well.

    The block writes to the path it is given. On any failure, Ctrl-C included, the temporary file
    is removed and what stood at `path` is unchanged. Raises `RequestError` (code
    `output-not-writable`) when the system refuses.
    """
    target = Path(os.path.realpath(path))  # a link stays a link; its target is replaced
    # The ending is kept: some writers choose their form by it.
    temporary = target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")
    try:
        yield temporary
        temporary.replace(target)
    except OSError as failure:
        raise _refusal(
            Fault(
                "output-not-writable",
                "the output file could not be written",
                found=failure.strerror or str(failure),
                expected="a place with room that you may write to",
            ),
            path,
        ) from failure
    finally:
        with suppress(OSError):
            temporary.unlink()


def _refusal(fault: Fault, path: Path) -> RequestError:
    return RequestError(fault.at(str(path)))
