"""A text file on disk -> its bytes and its text, or the problem that says why not."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from tempfile import TemporaryDirectory

from truepose.errors import MachineFileError, Problem, RequestError
from truepose.files.limits import LARGEST_FILE
from truepose.files.one_run import has_read, is_stdin, once, reads
from truepose.files.writing import kind_of, standing_for


@dataclass(frozen=True)
class FileKind:
    """What is wanted: `phrase` for people, and the ending that its files most often have."""

    phrase: str
    ending: str


_HELD: ContextVar[Mapping[str, bytes] | None] = ContextVar("files that are held", default=None)


@contextmanager
def held(contents: Mapping[str, bytes]) -> Iterator[None]:
    """Inside, files at these paths have these contents, whatever is on the disk, if anything is.

    So what was read once is evaluated again, also where its files are not.
    """
    token = _HELD.set(contents)
    try:
        yield
    finally:
        _HELD.reset(token)


def read_text(path: Path, kind: FileKind) -> tuple[bytes, str]:
    """Bytes and UTF-8 text of a file, without a byte order mark.

    Inside of a set of files that is being written, one of these is read as it will be; standard
    input is read once, however often it is asked for, and what is `held` not at all. Raises
    `MachineFileError` (file-missing, file-is-directory, file-unreadable, file-too-large, not-utf8),
    `RequestError` (output-is-input) for a file that this run is to write.
    """
    file = str(path)
    kept = (_HELD.get() or {}).get(file)
    if kept is not None:
        return kept, _decoded(kept, file)
    stands = standing_for(path)
    if stands == path and not is_stdin(path):
        reads(path)
    try:
        content = _content(stands)
    except (FileNotFoundError, NotADirectoryError):
        raise MachineFileError(_missing(path, kind)) from None
    except IsADirectoryError:
        raise MachineFileError(
            Problem(
                "file-is-directory",
                f"{file} is a directory",
                file,
                found="a directory",
                expected=kind.phrase,
                hint=_files_in(path, kind),
            )
        ) from None
    except (OSError, ValueError) as error:  # ValueError: a null character in the path
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise MachineFileError(_unreadable(file, reason)) from None
    has_read(path, content)
    return content, _decoded(content, file)


@contextmanager
def on_disk(path: Path) -> Iterator[Path]:
    """A file for what opens files itself: the path, or what came out of standard input.

    Raises as `read_text` does of standard input.
    """
    if not is_stdin(path):
        yield path
        return
    with TemporaryDirectory(prefix="truepose") as folder:
        copy = Path(folder) / "stdin"
        copy.write_bytes(_content(path))
        yield copy


def require_input(path: Path, kind: FileKind) -> None:
    """Refuse, before any work, what is no ordinary file that may be read, and note it as an input.

    Raises `RequestError` (file-missing, file-is-directory, file-unreadable, output-is-input).
    """
    if is_stdin(path):
        return
    try:
        found = kind_of(path.stat().st_mode)
    except (FileNotFoundError, NotADirectoryError):
        raise RequestError(_missing(path, kind)) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise RequestError(_unreadable(str(path), reason)) from None
    if found is not None:
        code = "file-is-directory" if found == "a folder" else "file-unreadable"
        message = f"{path} is {found}"
        raise RequestError(Problem(code, message, str(path), found=found, expected=kind.phrase))
    reads(path)
    if not os.access(path, os.R_OK):
        raise RequestError(_unreadable(str(path), "no permission to read"))


def _content(path: Path) -> bytes:
    """All of it, up to `LARGEST_FILE`: a pipe may never come to an end."""

    def read() -> bytes:
        if stdin:
            return sys.stdin.buffer.read(LARGEST_FILE + 1)
        with path.open("rb") as file:
            return file.read(LARGEST_FILE + 1)

    stdin = is_stdin(path)
    kind = "a pipe" if stdin else kind_of(path.stat().st_mode)
    if kind in ("a device", "a socket"):
        raise MachineFileError(_unreadable(str(path), kind))
    content = once(path, read) if kind == "a pipe" else read()
    if len(content) > LARGEST_FILE:
        raise MachineFileError(
            Problem(
                "file-too-large",
                f"{path} is too large",
                str(path),
                found=f"more than {LARGEST_FILE // 1_000_000} MB",
                expected=f"at most {LARGEST_FILE // 1_000_000} MB",
            )
        )
    return content


def _unreadable(file: str, reason: str) -> Problem:
    return Problem(
        "file-unreadable",
        f"cannot read {file}: {reason}",
        file,
        found=reason,
        expected="a file that may be read",
    )


def _missing(path: Path, kind: FileKind) -> Problem:
    folder = sorted(path.parent.glob(f"*{kind.ending}")) if path.parent.is_dir() else []
    others = {
        other.stem: other for other in folder if other != path
    }  # the ending makes no two names alike
    near = get_close_matches(path.stem, others, n=1)
    return Problem(
        "file-missing",
        f"there is no file {path}",
        str(path),
        found="a link to nothing" if path.is_symlink() else "nothing",
        expected=kind.phrase,
        hint=f"did you mean {others[near[0]]}?" if near else None,
    )


def _files_in(path: Path, kind: FileKind) -> str | None:
    names = sorted(other.name for other in path.glob(f"*{kind.ending}"))
    return f"{kind.ending} files in it: {', '.join(names[:10])}" if names else None


def _decoded(content: bytes, file: str) -> str:
    try:
        return content.decode("utf-8").removeprefix("\N{ZERO WIDTH NO-BREAK SPACE}")
    except UnicodeDecodeError as error:
        utf16 = content.startswith((b"\xff\xfe", b"\xfe\xff"))
        raise MachineFileError(
            Problem(
                "not-utf8",
                "the file is not UTF-8 text",
                file,
                content.count(b"\n", 0, error.start) + 1,
                found="UTF-16 text" if utf16 else f"the byte 0x{content[error.start]:02x}",
                expected="UTF-8 text",
                hint="save the file as UTF-8",
            )
        ) from None
