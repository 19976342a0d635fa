"""The store of a study: a Zarr group (format 3), written block by block.

A block's results are on the disk before its variants are `done`, so that whatever ends the process,
what is done is whole, and the rest is evaluated again with the same numbers. The group is made
under a temporary name and gets its own when the plan is in it.
"""

from __future__ import annotations

import errno
import json
import os
import secrets
import shutil
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.arrays import Flags
from truepose.errors import Problem, RequestError
from truepose.files.wording import counted
from truepose.files.writing import uninterrupted
from truepose.runs.dataset import labelled_dataset
from truepose.studies.block import FILL, NOT_COMPUTED, Arrays, schema_of
from truepose.studies.dataset import BLOCK, COORDS, DONE, KEY, PLAN, PLAN_HASH, done_variable
from truepose.studies.plan import StudyPlan

if TYPE_CHECKING:
    import xarray as xr

ENDING = ".zarr"

PLANNED = 10_000
"""Variants of a chunk of a plan that is written at once."""

_FULL = (errno.ENOSPC, errno.EDQUOT)
STILL_WRITTEN = 2.0
"""s that the other writes of one that failed may take."""

_PARTIAL = ".partial"
"""Ending of the files that Zarr has not written whole."""


def require_packages() -> None:
    """Raise `RequestError` (extra-missing) where no store can be written or read."""
    if find_spec("zarr") is None:
        raise RequestError(
            Problem(
                "extra-missing",
                "the store of a study needs a package that is not installed",
                found="no zarr",
                expected="zarr 3",
                hint="pip install 'truepose[study]'",
            )
        )


class StudyStore:
    """A store that is there. Its arrays are opened when they are first asked for."""

    def __init__(self, path: Path) -> None:
        """Raises `RequestError` (output-exists) where something else stands there."""
        import zarr

        self.path = path
        try:
            self._group: Any = zarr.open_group(str(path), mode="r+", use_consolidated=False)
            self.attrs: dict[str, Any] = dict(self._group.attrs)
            self.key: dict[str, Any] = json.loads(self.attrs[KEY])
            self.block = int(self.attrs[BLOCK])
            self._arrays: dict[str, Any] = {}
            self._done = self._array(DONE)
        except (KeyError, OSError, TypeError, ValueError) as failure:
            raise RequestError(
                Problem(
                    "output-exists",
                    "what stands there is no store of a study, and is not written over",
                    file=str(path),
                    found=str(failure).partition("\n")[0] or type(failure).__name__,
                    expected="a name that is free, or the store of this study",
                    hint=f"give another name: --output NAME{ENDING}",
                )
            ) from None

    def __len__(self) -> int:
        return int(self._done.shape[0])

    def _array(self, name: str) -> Any:
        if name not in self._arrays:
            self._arrays[name] = self._group[name]
        return self._arrays[name]

    def done(self) -> Flags:
        """(n_variant,) which variants are evaluated."""
        return np.asarray(self._done[:], np.bool_)

    def plan(self) -> StudyPlan:
        """The plan as it was drawn. Raises `RequestError` (other-study) where it was changed."""
        plan = StudyPlan(
            tuple(map(str, self._array("variable")[:])),
            tuple(map(str, self._array("variable_units")[:])),
            np.array(self._array("setting")[:]).astype(object),
            np.asarray(self._array("value")[:], np.float64),
        )
        if plan.digest != self.attrs[PLAN_HASH]:
            raise RequestError(
                Problem(
                    "other-study",
                    "the plan in the store is not the one that was drawn",
                    file=str(self.path),
                    found=f"SHA-256 {plan.digest}",
                    expected=f"SHA-256 {self.attrs[PLAN_HASH]}",
                    hint="somebody changed it: give another --output",
                )
            )
        return plan

    def write(self, number: int, arrays: Arrays) -> None:
        """Write the results of a block, then that it is done; Ctrl-C waits.

        Raises `RequestError` (output-not-writable), after which the store goes on as before.
        """
        first = number * self.block
        rows = slice(first, min(first + self.block, len(self)))
        with self._refused(), uninterrupted():
            for name, values in arrays.items():
                self._array(name)[rows] = values
                self._on_disk(name, number)
            self._done[rows] = True
            self._on_disk(DONE, number)

    def _on_disk(self, name: str, number: int) -> None:
        """The chunk of a block reaches the disk itself, where the file system can say so."""
        chunk = self.path / name / "c" / str(number)
        for file in [chunk] if chunk.is_file() else chunk.rglob("*"):
            if file.is_file():
                handle = os.open(file, os.O_RDWR)
                try:
                    os.fsync(handle)
                finally:
                    os.close(handle)

    @contextmanager
    def _refused(self) -> Iterator[None]:
        try:
            yield
        except OSError as failure:
            done = f"{int(self.done().sum())} of {counted(len(self), 'variant')}"
            raise not_writable(self.path, failure, f"the same command goes on: {done} done") from (
                failure
            )

    def read(self) -> xr.Dataset:
        """The whole Dataset, in memory."""
        import xarray as xr

        with xr.open_zarr(self.path, consolidated=False) as opened:
            loaded = opened.load()
        # Zarr's strings, whose type depends on the version of NumPy, are Python's.
        variables = {
            str(name): one.astype(object) if one.dtype.kind == "T" else one
            for name, one in loaded.variables.items()
        }
        order = (*schema_of(tuple(self.key["quantities"])), DONE)
        coords = {name: variables[name] for name in COORDS if name in variables}
        data = {name: variables[name] for name in order}
        return labelled_dataset(data, coords, loaded.attrs)

    def sweep(self) -> None:
        """Remove the files that a lost process had not written whole."""
        for file in self.path.rglob(f"*{_PARTIAL}"):
            with suppress(OSError):
                file.unlink()


def created(
    path: Path, labels: xr.Dataset, results: dict[str, xr.Variable], *, planned: int = PLANNED
) -> StudyStore:
    """A new store with a plan in which no variant is done yet.

    `labels`: the plan and the coordinates; `results`: the variables that it will have, of whose
    values only the shape counts; `planned`: variants of a chunk of the plan. Raises
    `RequestError` (output-not-writable).
    """
    import zarr

    temporary = _temporary(path)
    block = int(labels.attrs[BLOCK])
    count = labels.sizes["variant"]
    results = {**results, DONE: done_variable(np.zeros(count, np.bool_))}
    try:
        chunks = {
            name: {"chunks": (min(count, planned if name in PLAN else PLANNED), *one.shape[1:])}
            for name, one in labels.variables.items()
            if one.dims[0] == "variant"
        }
        labels.to_zarr(temporary, mode="w-", zarr_format=3, consolidated=False, encoding=chunks)
        group: Any = zarr.open_group(str(temporary), mode="r+", use_consolidated=False)
        for name, one in results.items():
            group.create_array(
                name,
                shape=one.shape,
                chunks=(min(block, count), *one.shape[1:]),
                dtype=str if one.dtype == object else one.dtype,
                fill_value=NOT_COMPUTED if name == "status" else FILL[_kind(one)],
                dimension_names=one.dims,
                attributes=one.attrs,
            )
        with warnings.catch_warnings():
            # Readers look for it, and warn where there is none.
            warnings.simplefilter("ignore")
            zarr.consolidate_metadata(str(temporary))
        with uninterrupted():
            temporary.rename(path)
    except OSError as failure:
        raise not_writable(path, failure, None) from failure
    finally:
        _remove(temporary)
    return StudyStore(path)


def _remove(folder: Path) -> None:
    """Remove a folder, into which a failed write of Zarr's may still write for a moment."""
    shutil.rmtree(folder, ignore_errors=True)
    ends = time.monotonic() + STILL_WRITTEN
    while folder.exists() and time.monotonic() < ends:
        time.sleep(0.01)
        shutil.rmtree(folder, ignore_errors=True)


def _kind(variable: xr.Variable) -> type:
    return {"O": str, "f": np.float64, "i": np.int64, "b": np.bool_}[variable.dtype.kind]


def _temporary(path: Path) -> Path:
    return path.with_name(f".{path.stem}.{secrets.token_hex(4)}{ENDING}")


def sweep_beside(path: Path) -> None:
    """Remove what a lost process left of a store that it was about to make.

    Only for who has the lock.
    """
    for left in path.parent.glob(f".{path.stem}.????????{ENDING}"):
        shutil.rmtree(left, ignore_errors=True)


def not_writable(path: Path, failure: OSError, hint: str | None) -> RequestError:
    """The problem of a store that the system lets nobody write to."""
    room = failure.errno in _FULL
    return RequestError(
        Problem(
            "output-not-writable",
            "the store of the study could not be written",
            file=str(path),
            found=failure.strerror or str(failure),
            expected="a disk with room" if room else "a place with room that you may write to",
            hint=f"make room, and {hint}" if room and hint else hint,
        )
    )


__all__ = [
    "ENDING",
    "PLANNED",
    "StudyStore",
    "created",
    "not_writable",
    "require_packages",
    "sweep_beside",
]
