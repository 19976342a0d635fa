"""Studies on a cluster: the bits of one process, whoever comes, goes or is refused meanwhile.

Nothing of dask.distributed runs in the process of the tests: each cluster is a command's own, or a
scheduler and workers that are started here. What a worker is not supposed to be it is made by a
script that it preloads.
"""

from __future__ import annotations

import random
import re
import signal
import sys
import time
from pathlib import Path
from typing import Any

import pytest

import truepose as tp
from cluster_under_test import LIMIT, Cluster, started
from command_line import PLANAR
from sweeps import long_member
from truepose.cluster.instruction_sets import computing_with
from truepose.studies.lock import lock_file
from truepose.studies.store import StudyStore

pytest.importorskip("distributed")
pytest.importorskip("zarr")

VARY = ["strut.*.length=380:520:4 mm", "condition.temperature=20:35:3 degC"]
pytestmark = pytest.mark.timeout(600)

OTHER_VERSION = """
from truepose.cluster import in_worker

def dask_setup(worker):
    in_worker.versions = lambda: {"truepose": "0.0.9", "Python": "3.11"}
"""

LITTLE = """
from truepose.cluster import in_worker

def dask_setup(worker):
    in_worker.best_instruction_set = lambda: "portable"
"""

SLOW = """
import time
from truepose.studies import block

def slowly(task, evaluate=block.evaluate_block):
    time.sleep(0.25)
    return evaluate(task)

block.evaluate_block = slowly
"""

TELLING = """
import os
from truepose.studies import block

def telling(task, evaluate=block.evaluate_block):
    open(os.environ["TOLD"], "w").close()
    return evaluate(task)

block.evaluate_block = telling
"""

MORTAL = """
import os, signal
from truepose.studies import block

block.evaluate_block = lambda task: os.kill(os.getpid(), signal.SIGKILL)
"""


def arguments(store: Path, *more: str) -> list[str]:
    vary = [word for one in VARY for word in ("--vary", one)]
    return [
        sys.executable, "-m", "truepose", "study", str(PLANAR), *vary, "--output", str(store), *more
    ]  # fmt: skip


def codes(err: str) -> list[str]:
    """Of the errors that a command told."""
    return re.findall(r"error\[([a-z-]+)\]", err)


def same_content(one: Any, other: Any) -> None:
    """The same arrays, coordinates, plan and key, to the last bit."""
    assert set(one.variables) == set(other.variables)
    for name, variable in one.variables.items():
        values, others = variable.values, other.variables[name].values
        assert values.dtype == others.dtype, name
        if values.dtype == object:
            assert values.tolist() == others.tolist(), name
        else:
            assert values.tobytes() == others.tobytes(), name
    for name in ("plan_hash", "study"):
        assert one.attrs[name] == other.attrs[name]


@pytest.fixture(scope="module")
def whole() -> Any:
    """The study in this process."""
    return tp.study(PLANAR, VARY)


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return tmp_path / "study.zarr"


KILLING = """
import sys
import truepose as tp

if __name__ == "__main__":
    import psutil

    machine, store, *vary = sys.argv[1:]
    killed = []

    def progress(done, total):
        if not killed:
            own = [p for p in psutil.Process().children() if "spawn_main" in " ".join(p.cmdline())]
            killed.append(own[0].pid)
            own[0].kill()

    tp.study(machine, vary, output=store, workers=2, progress=progress)
    print("killed", len(killed))
"""


def test_a_worker_that_is_killed_changes_nothing(tmp_path: Path, store: Path, whole: Any) -> None:
    script = tmp_path / "script.py"
    script.write_text(KILLING)
    words = [sys.executable, str(script), str(PLANAR), str(store), *VARY]
    with started(words) as process:
        out, err = process.communicate(timeout=LIMIT)
    assert (process.returncode, out.strip()) == (0, "killed 1"), err
    same_content(whole, StudyStore(store).read())


@pytest.mark.parametrize("kills", [2, long_member(20)])
def test_a_killed_command_goes_on_to_the_same_content(kills: int, store: Path, whole: Any) -> None:
    chance = random.Random(kills)  # noqa: S311
    first = store / "done" / "c"
    for _ in range(kills):
        with started(arguments(store, "--workers", "2")) as process:
            begun, before = time.monotonic(), len(list(first.glob("*")))
            while process.poll() is None and time.monotonic() - begun < LIMIT:
                if len(list(first.glob("*"))) > before:
                    break
                time.sleep(0.01)
            time.sleep(0.3 * chance.random())
            process.send_signal(signal.SIGKILL)
            process.wait()
    with started(arguments(store, "--workers", "2")) as process:
        _, err = process.communicate(timeout=LIMIT)
    assert process.returncode == 0, err
    same_content(whole, StudyStore(store).read())
    assert not lock_file(store).exists()


def test_a_scheduler_elsewhere(cluster: Cluster, store: Path, tmp_path: Path) -> None:
    """Its least worker says the instruction set; one is refused by name; one comes late."""
    cluster.worker("little", LITTLE, SLOW)
    cluster.worker("older", OTHER_VERSION)
    told = tmp_path / "told"
    with started(arguments(store, "--scheduler", cluster.address)) as process:
        begun = time.monotonic()
        while not (store / "done" / "c").exists() and process.poll() is None:
            assert time.monotonic() - begun < LIMIT
            time.sleep(0.02)
        cluster.worker("late", TELLING, TOLD=str(told))
        _, err = process.communicate(timeout=LIMIT)
    assert process.returncode == 0, err
    assert told.exists(), "the late worker got no work"
    assert "no work is given to worker older at tcp://127.0.0.1:" in err
    assert f"it has truepose 0.0.9, not {tp.__version__}" in err
    found = StudyStore(store)
    assert found.key["instruction_set"] == "portable"
    with computing_with("portable"):
        same_content(tp.study(PLANAR, VARY), found.read())


def test_workers_of_another_version_alone_are_named(cluster: Cluster, store: Path) -> None:
    cluster.worker("older", OTHER_VERSION)
    with started(arguments(store, "--scheduler", cluster.address)) as process:
        out, err = process.communicate(timeout=LIMIT)
    assert (process.returncode, out) == (2, "")
    assert codes(err) == ["no-worker"]
    assert "worker older at tcp://127.0.0.1:" in err
    assert "truepose 0.0.9" in err
    assert not store.exists()


def test_a_worker_without_the_instructions_of_a_store(cluster: Cluster, store: Path) -> None:
    def interrupted(done: int, _: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    tp.study(PLANAR, VARY, output=store, progress=interrupted)
    begun_with = StudyStore(store).key["instruction_set"]
    if begun_with in ("scalar", "portable"):
        pytest.skip("this processor has no more than every other")
    cluster.worker("little", LITTLE)
    with started(arguments(store, "--scheduler", cluster.address)) as process:
        _, err = process.communicate(timeout=LIMIT)
    assert process.returncode == 2
    assert codes(err) == ["no-worker"]
    assert "worker little at tcp://" in err
    assert f"its processor has portable at most, and this was begun with {begun_with}" in err


def test_a_worker_that_dies_at_each_task_ends_the_study(cluster: Cluster, store: Path) -> None:
    cluster.worker("mortal", MORTAL, nanny=True)
    with started(arguments(store, "--scheduler", cluster.address)) as process:
        out, err = process.communicate(timeout=LIMIT)
    assert (process.returncode, out) == (2, "")
    assert codes(err) == ["worker-lost"]
    assert "lost: mortal" in err
    assert not StudyStore(store).done().any()
    assert not lock_file(store).exists()


def test_a_scheduler_that_does_not_answer(store: Path) -> None:
    with started(arguments(store, "--scheduler", "tcp://127.0.0.1:9")) as process:
        out, err = process.communicate(timeout=LIMIT)
    assert (process.returncode, out) == (2, "")
    assert codes(err) == ["no-scheduler"]
    assert "the scheduler tcp://127.0.0.1:9 does not answer" in err
    assert "Traceback" not in err
    assert not store.exists()
