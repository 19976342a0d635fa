"""Killed at random moments, a study goes on, and in the end has what an undisturbed one has.

That is the same hash over all decoded arrays, coordinates and the plan. Moments are drawn from a
seed: any moment of half a run, and moments within the milliseconds in which a block is written,
which the command tells us. `make test` kills six times, all tests twenty times more.
"""

from __future__ import annotations

import hashlib
import os
import random
import select
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from command_line import PLANAR
from sweeps import long_member
from truepose.studies.lock import lock_file

xr = pytest.importorskip("xarray")
pytest.importorskip("zarr")

ARGUMENTS = [
    "study", str(PLANAR), "--vary", "strut.*.length=380:520:16 mm",
    "--vary", "condition.temperature=20:35:4 degC", "--output",
]  # fmt: skip

TELLING = """
import os
from truepose.studies.store import StudyStore
from truepose.cli import main

write = StudyStore.write

def telling(self, number, arrays):
    os.write(int(os.environ["TELLS"]), b"!")
    write(self, number, arrays)

StudyStore.write = telling
main()
"""
"""The command line, which tells a pipe when a block is about to be written."""

MOMENTS = 30e-3
"""s after that within which it is killed."""

PATH = os.pathsep.join(str(Path(folder).resolve()) for folder in sys.path if folder)


def content_hash(store: Path) -> str:
    """SHA-256 over every variable, decoded, with its name, dims and attributes, and the plan."""
    with xr.open_zarr(store, consolidated=False) as opened:
        dataset = opened.load()
    told = hashlib.sha256(str(dataset.attrs["study"]).encode())
    for name in sorted(map(str, dataset.variables)):
        variable = dataset.variables[name]
        told.update(f"{name} {variable.dims} {sorted(variable.attrs.items())}".encode())
        if variable.dtype.kind in "TO":
            told.update("\0".join(map(str, variable.values.ravel().tolist())).encode())
        else:
            told.update(variable.dtype.str.encode() + variable.values.tobytes())
    return told.hexdigest()


def started(store: Path, tells: int) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-c", TELLING, *ARGUMENTS, str(store)],
        pass_fds=(tells,),
        env=os.environ | {"TELLS": str(tells), "PYTHONPATH": PATH},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )


def finished(store: Path) -> float:
    """A run to the end -> how long it took, s."""
    null = os.open(os.devnull, os.O_WRONLY)
    begun = time.monotonic()
    process = started(store, null)
    os.close(null)
    _, errors = process.communicate()
    assert process.returncode == 0, errors.decode()
    return time.monotonic() - begun


def killed(store: Path, chance: random.Random, seconds: float, *, aimed: bool) -> bool:
    """Start it, and kill it -> whether it was alive."""
    ears, mouth = os.pipe()
    process = started(store, mouth)
    os.close(mouth)
    if aimed:
        for _ in range(chance.randint(1, 2)):
            select.select([ears], [], [], 120.0)
            os.read(ears, 1)  # nothing where it ended before
        time.sleep(MOMENTS * chance.random())
    else:
        time.sleep(0.5 * seconds * chance.random())
    alive = process.poll() is None
    process.send_signal(signal.SIGKILL)
    process.communicate()
    os.close(ears)
    return alive


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, float]:
    """The store of a run that nothing disturbs, and how long it takes."""
    store = tmp_path_factory.mktemp("undisturbed") / "study.zarr"
    return store, finished(store)


@pytest.mark.parametrize("kills", [6, long_member(20)])
def test_a_killed_study_goes_on_to_the_same_content(
    kills: int, undisturbed: tuple[Path, float], tmp_path: Path
) -> None:
    whole, seconds = undisturbed
    store = tmp_path / "study.zarr"
    chance = random.Random(kills)  # noqa: S311
    alive = 0
    for number in range(kills):
        alive += killed(store, chance, seconds, aimed=number % 2 == 1)
        if store.exists():  # whatever its moment, what stands can be read
            content_hash(store)
    assert alive >= kills // 3, "the kills came before the end"
    finished(store)
    assert content_hash(store) == content_hash(whole)
    assert not list(store.rglob("*.partial"))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["study.zarr"]
    assert not lock_file(store).exists()


def test_another_content_has_another_hash(undisturbed: tuple[Path, float], tmp_path: Path) -> None:
    import zarr

    store = tmp_path / "study.zarr"
    shutil.copytree(undisturbed[0], store)
    expected = content_hash(store)
    assert content_hash(undisturbed[0]) == expected
    group = zarr.open_group(str(store), mode="r+")
    known = float(group["known"][63, 0])
    group["known"][63, 0] = known + np.spacing(known)
    assert content_hash(store) != expected
