"""Write a file, or several that belong together, whole or not at all.

What is written has a temporary name beside its target until all of it is on the disk; then the
files take their names, one directly after the other. So after a failure, Ctrl-C or a lost process
each file is the old one or the new one.
"""

from __future__ import annotations

import errno
import os
import secrets
import signal
import stat
import threading
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from types import FrameType

from truepose.errors import Fault, RequestError
from truepose.files.one_run import has_written, real_path, require_not_read
from truepose.files.wording import one_of

LONGEST_STEM = 40
"""Characters of a name that a temporary file has too: names may be long, and it has ten more."""


def require_writable(path: Path, endings: Collection[str], inputs: Collection[Path] = ()) -> None:
    """Refuse an output path before the work is done, not after.

    `endings` are those that can be written (".json", ...); `inputs` are files that must survive.
    Raises `RequestError` (codes `output-ending`, `output-not-writable`, `output-is-input`).
    """
    with _refused(path):
        _require_writable(path, endings, inputs)


def _require_writable(path: Path, endings: Collection[str], inputs: Collection[Path]) -> None:
    _require_place(path, endings)
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
    _require_ordinary(path)
    _require_open(path)


def _require_place(path: Path, endings: Collection[str]) -> None:
    """Refuse a name that cannot be one, or another ending, or a folder that is not there."""
    if "\0" in str(path):
        raise OSError(errno.EINVAL, "a name with a null character")
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


def _require_open(path: Path) -> None:
    """Refuse a name in a folder that nothing may be written into."""
    folder = Path(os.path.realpath(path)).parent
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


def require_own_place(path: Path, ending: str) -> None:
    """Refuse the name of a store, which is a folder, before the work is done.

    Raises `RequestError` (codes `output-ending`, `output-not-writable`).
    """
    with _refused(path):
        _require_place(path, [ending])
        if (path.exists() or path.is_symlink()) and not path.is_dir():
            raise _refusal(
                Fault(
                    "output-not-writable",
                    "what stands there is a file, and a store is a folder",
                    found=kind_of(path.stat().st_mode) or "a file",
                    expected="a name that is free, or a store",
                ),
                path,
            )
        _require_open(path)


def require_new(path: Path) -> None:
    """Refuse a path where something stands. Raises `RequestError` (code `output-exists`)."""
    with _refused(path):
        there = path.exists() or path.is_symlink()
    if there:
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
        with _refused(path / name):
            _require_ordinary(path / name)


def require_own_folder(path: Path, is_own: Callable[[str], bool], option: str) -> None:
    """Make a folder for files of one kind, or refuse one that holds any other (by `is_own`).

    Raises `RequestError` (codes `output-exists`, `output-not-writable`).
    """
    with _refused(path):
        names = sorted(one.name for one in path.iterdir()) if path.is_dir() else []
    others = [name for name in names if not is_own(name)]
    if others:
        raise _refusal(
            Fault(
                "output-exists",
                "the folder holds other files, and nothing is written between them",
                found=one_of(others[:3]) if len(others) <= 3 else f"{others[0]}, and others",
                expected="a folder that is empty, that is not there, or of an earlier report",
                hint=f"give another name: {option} FOLDER",
            ),
            path,
        )
    require_folder(path)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file beside `path` that takes its place when the block ends well.

    The block writes to the path it is given. On any failure, Ctrl-C included, the temporary file
    is removed and what stood at `path` is unchanged. Mode and owner of what stood there are kept.
    Inside `written_together` it takes its place with the others. Raises `RequestError` (codes
    `output-not-writable`; `output-is-input` where this run has read it).
    """
    with written_together() as files, _refused(path):
        try:
            yield files.temporary(path)
        except BaseException:
            files.leave_out(path)
            raise


class FileSet:
    """Files that are being written: the temporary one of each, by its target, links followed."""

    def __init__(self) -> None:
        self._temporary: dict[Path, Path] = {}
        self._asked: dict[Path, Path] = {}

    def temporary(self, path: Path) -> Path:
        """Where to write what will be `path`; what was written for it before in the set is gone."""
        require_not_read(path)
        _require_ordinary(path)
        target = real_path(path)
        other = self._asked.get(target, path)
        if other != path:
            message = f"{other} and {path} are one file"
            found = f"links to {target}"
            raise _refusal(Fault("output-twice", message, found, "a file for each"), path)
        # The ending is kept: some writers choose their form by it.
        name = f".{target.stem[:LONGEST_STEM]}.{secrets.token_hex(4)}{target.suffix}"
        self._drop(target)
        self._temporary[target], self._asked[target] = target.with_name(name), path
        return self._temporary[target]

    def standing_for(self, path: Path) -> Path:
        """Where the content of `path` is: with the name it has as yet, if it is of the set."""
        return self._temporary.get(real_path(path), path)

    def take_places(self) -> None:
        """All files get their names. Raises `RequestError` (output-not-writable)."""
        for target, temporary in self._temporary.items():
            with _refused(self._asked[target]):
                _on_disk(temporary, os.O_RDWR)
                _take_over(temporary, target)
        with uninterrupted():
            self._rename()
        for folder in {target.parent for target in self._temporary}:
            with suppress(OSError):  # not every file system can
                _on_disk(folder, os.O_RDONLY)

    def _rename(self) -> None:
        """One after the other; where one is refused, those before it get back what stood there."""
        before = {target: _Before(target) for target in self._temporary}
        done: list[Path] = []
        try:
            for target, temporary in self._temporary.items():
                try:
                    with _refused(self._asked[target]):
                        temporary.replace(target)
                except RequestError:
                    for other in done:
                        before[other].come_back()
                    raise
                done.append(target)
            for target in done:
                has_written(self._asked[target])
        finally:
            for earlier in before.values():
                earlier.forget()

    def leave_out(self, path: Path) -> None:
        """Write nothing to `path` after all."""
        self._drop(real_path(path))

    def remove(self) -> None:
        """No temporary file stays."""
        for target in list(self._temporary):
            self._drop(target)

    def _drop(self, target: Path) -> None:
        self._asked.pop(target, None)
        temporary = self._temporary.pop(target, None)
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink()


_SET: ContextVar[FileSet | None] = ContextVar("files that are written together", default=None)


@contextmanager
def written_together() -> Iterator[FileSet]:
    """Files that are written inside by `replacing` take their places when the block ends well.

    All of them, or on any failure none; a set inside of another is part of that.
    """
    outer = _SET.get()
    if outer is not None:
        yield outer
        return
    files = FileSet()
    token = _SET.set(files)
    try:
        yield files
        files.take_places()
    finally:
        _SET.reset(token)
        files.remove()


def standing_for(path: Path) -> Path:
    """Where to read `path`: in a set that is being written, what was written for it."""
    files = _SET.get()
    return path if files is None else files.standing_for(path)


def _require_ordinary(path: Path) -> None:
    """Refuse a target that is no ordinary file, or that may not be changed."""
    try:
        state = path.stat()
    except FileNotFoundError:
        return
    kind = kind_of(state.st_mode)
    if kind is None and path.is_absolute() and path.parts[1:2] in (("dev",), ("proc",)):
        kind = "a stream of the system"
    if kind is not None:
        raise _refusal(
            Fault(
                "output-not-writable",
                f"the output path is {kind}",
                found=kind,
                expected="a file name",
            ),
            path,
        )
    # Whoever may do everything is not stopped by the mode; it still says what is meant.
    if not state.st_mode & 0o222 or not os.access(path, os.W_OK):
        raise _refusal(
            Fault(
                "output-not-writable",
                "the output file is there and may not be changed",
                found="a file that is read-only",
                expected="a file that may be written, or another name",
                hint=f"chmod u+w {path}",
            ),
            path,
        )


def kind_of(mode: int) -> str | None:
    """What something is that is no ordinary file, by its mode."""
    kinds = (
        (stat.S_ISDIR, "a folder"),
        (stat.S_ISFIFO, "a pipe"),
        (stat.S_ISSOCK, "a socket"),
        (stat.S_ISCHR, "a device"),
        (stat.S_ISBLK, "a device"),
    )
    return next((name for is_kind, name in kinds if is_kind(mode)), None)


class _Before:
    """What stands at a target, by a second name with which it can come back."""

    def __init__(self, target: Path) -> None:
        self._target = target
        self._there = target.exists()
        name = target.with_name(f".{target.stem[:LONGEST_STEM]}.{secrets.token_hex(4)}.before")
        self._name: Path | None = name
        try:
            os.link(target, name)
        except OSError:  # nothing is there, or the file system has no second names
            self._name = None

    def come_back(self) -> None:
        """What stood there stands there again, as far as it can."""
        with suppress(OSError):
            if self._name is not None:
                self._name.replace(self._target)
            elif not self._there:
                self._target.unlink()

    def forget(self) -> None:
        """No second name stays."""
        if self._name is not None:
            with suppress(OSError):
                self._name.unlink()


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Ctrl-C waits until the block is done, which takes some microseconds."""
    if threading.current_thread() is not threading.main_thread():
        yield  # it goes to the main thread only
        return
    asked: list[FrameType | None] = []
    handler = signal.signal(signal.SIGINT, lambda _, frame: asked.append(frame))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
    if asked and callable(handler):
        handler(signal.SIGINT, asked[0])


def _take_over(temporary: Path, target: Path) -> None:
    """Give a file the mode and the owner of the one whose place it takes."""
    try:
        old = target.stat()
    except FileNotFoundError:
        return
    new = temporary.stat()
    if (new.st_uid, new.st_gid) != (old.st_uid, old.st_gid):
        try:
            os.chown(temporary, old.st_uid, old.st_gid)
        except PermissionError:
            raise PermissionError(0, "a file of another user, who would lose it") from None
    temporary.chmod(stat.S_IMODE(old.st_mode))


def _on_disk(path: Path, how: int) -> None:
    handle = os.open(path, how)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def _refused(path: Path) -> Iterator[None]:
    """What the system refuses, as a problem of the output."""
    try:
        yield
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


def _refusal(fault: Fault, path: Path) -> RequestError:
    return RequestError(fault.at(str(path)))
