"""A text file on disk -> its bytes and its text, or the problem that says why not."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from truepose.errors import MachineFileError, Problem


@dataclass(frozen=True)
class FileKind:
    """What is wanted: `phrase` for people, and the ending that its files most often have."""

    phrase: str
    ending: str


def read_text(path: Path, kind: FileKind) -> tuple[bytes, str]:
    """Bytes and UTF-8 text of a file, without a byte order mark.

    Raises `MachineFileError` (file-missing, file-is-directory, file-unreadable, not-utf8).
    """
    file = str(path)
    try:
        content = path.read_bytes()
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
    return content, _decoded(content, file)


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
    others = {other.stem: other for other in folder}  # the ending makes no two names alike
    near = get_close_matches(path.stem, others, n=1)
    return Problem(
        "file-missing",
        f"there is no file {path}",
        str(path),
        found="nothing",
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
