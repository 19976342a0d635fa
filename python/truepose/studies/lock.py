"""One writer of a store at a time.

The lock is the system's own (flock) on a file beside the store, which has the writer's process
written in it: whoever dies loses it, so what a dead process left is taken over by the next.
"""

from __future__ import annotations

import errno
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from truepose.errors import Problem, RequestError

_HELD_BY_OTHERS = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)

_BEHIND = 4096
"""Where Windows locks a byte, which nobody else reads then: behind all that is written."""


def lock_file(store: Path) -> Path:
    """The file beside a store that its writer has locked."""
    return store.with_name(f".{store.name}.lock")


@contextmanager
def only_writer(store: Path) -> Iterator[None]:
    """Nobody else writes to the store inside.

    Raises `RequestError`: store-in-use, with the process that writes to it; output-not-writable
    where nothing can be locked.
    """
    path = lock_file(store)
    handle = _locked(path, store)
    try:
        os.ftruncate(handle, 0)
        os.lseek(handle, 0, os.SEEK_SET)
        os.write(handle, f"{os.getpid()} {socket.gethostname()}\n".encode())
        yield
    finally:
        with suppress(OSError):
            path.unlink()
        os.close(handle)


def _locked(path: Path, store: Path) -> int:
    while True:
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as failure:
            raise _cannot_lock(store, failure.strerror or str(failure)) from failure
        try:
            _lock(handle)
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(handle), path.stat()):
                    return handle
        except OSError as failure:
            writer = _writer(handle)
            os.close(handle)
            if failure.errno in _HELD_BY_OTHERS:
                raise _in_use(store, writer) from None
            raise _cannot_lock(store, failure.strerror or str(failure)) from failure
        os.close(handle)  # its writer removed it meanwhile: it is nobody's


def _lock(handle: int) -> None:
    """Raises `OSError` where another process has it."""
    if sys.platform == "win32":
        import msvcrt

        os.lseek(handle, _BEHIND, os.SEEK_SET)
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _writer(handle: int) -> str:
    """Which process has the lock, as it has written there."""
    with suppress(OSError):
        os.lseek(handle, 0, os.SEEK_SET)
        words = os.read(handle, 1000).decode("utf-8", "replace").split()
        if len(words) == 2:
            return f"process {words[0]} on {words[1]}"
    return "another process"


def _in_use(store: Path, writer: str) -> RequestError:
    return RequestError(
        Problem(
            "store-in-use",
            "another process writes to this store",
            file=str(store),
            found=writer,
            expected="one writer at a time",
            hint="wait until it is done; the same command then goes on where it ended",
        )
    )


def _cannot_lock(store: Path, why: str) -> RequestError:
    return RequestError(
        Problem(
            "output-not-writable",
            "the store cannot be locked against a second writer",
            file=str(store),
            found=why,
            expected="a folder that may be written to, on a file system with locks",
        )
    )


__all__ = ["lock_file", "only_writer"]
