"""Budgets, samples, bounds and parts on a cluster: the bits of one process, whoever comes or goes.

As in `test_study`, nothing of dask.distributed runs in the process of the tests.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from build_machine import MACHINES
from cluster_under_test import ENVIRONMENT, LIMIT, Cluster, started
from machine_texts import with_workspace

pytest.importorskip("distributed")
pytestmark = pytest.mark.timeout(600)

POCKET = MACHINES.parent / "examples" / "part"
PART = (str(POCKET / "pocket.ngc"), "--features", str(POCKET / "pocket.toml"))
PLANAR, HEXAPOD = MACHINES / "planar_two_slider.toml", MACHINES / "hexapod.toml"

COMMANDS: dict[str, tuple[str, ...]] = {
    "budget": ("budget", "FINE", "--summary"),
    "samples": ("montecarlo", str(HEXAPOD), "--samples", "300"),
    "as many samples as it takes": ("montecarlo", str(PLANAR), "--digits", "1"),
    "sobol": ("montecarlo", str(PLANAR), "--samples", "256", "--sampling", "sobol"),
    "bounds": ("bounds", str(PLANAR)),
    "part": ("part", str(HEXAPOD), *PART, "--samples", "600"),
    "exact part": ("part", str(HEXAPOD), *PART, "--samples", "300", "--exact"),
}

NOT_MET = ("part", "exact part")
"""Commands whose exit code is 1: a quantity is NOT met."""

OLDER = """
from truepose.cluster import in_worker

def dask_setup(worker):
    in_worker.versions = lambda: {"truepose": "0.0.9", "Python": "3.11"}
"""

SLOW = """
import os, time
from truepose.uncertainty_analysis import monte_carlo

done = []

def slowly(asked, part, sampled=monte_carlo._sampled):
    if len(done) == 9:
        open(os.environ["TOLD"], "w").close()
    done.append(part)
    time.sleep(0.5)
    return sampled(asked, part)

monte_carlo._sampled = slowly
"""

MORTAL = """
import os, signal
from truepose.error_budget import summary
from truepose.workpiece import samples

summary._summarised = samples._drawn = lambda *task: os.kill(os.getpid(), signal.SIGKILL)
"""

TWICE = """
import sys, warnings
import truepose as tp

if __name__ == "__main__":
    machine = tp.load(sys.argv[1])
    alone = tp.budget(machine, summary=True)
    for number in range(2):
        there = tp.budget(machine, summary=True, workers=1)
        assert alone.identical(there), number
    print("twice")
"""

WARNED = """
import sys, warnings
import truepose as tp

if __name__ == "__main__":
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        tp.budget(tp.load(sys.argv[1]), summary=True, scheduler=sys.argv[2])
    print([str(each.message) for each in caught if "no work" in str(each.message)])
"""


KEPT = """
import os
from truepose.cluster.options import ClusterOptions
from truepose.cluster.workers import connected

if __name__ == "__main__":
    with connected(ClusterOptions(1)) as workers:
        workers.wait_for_one()
        names = "MALLOC_TRIM_THRESHOLD_", "OPENBLAS_NUM_THREADS", "TRUEPOSE_THREADS"
        print([list(workers.client.run(os.environ.get, name).values()) for name in names])
"""


@pytest.fixture
def fine(tmp_path: Path) -> Path:
    """The planar machine with 120,000 poses: 15 blocks."""
    grid = "grid = { x = [100, 500, 400], y = [50, 400, 300] }"
    return with_workspace("planar_two_slider", tmp_path, grid)


def of(name: str, fine: Path) -> tuple[str, ...]:
    """The words of a command of `COMMANDS`."""
    return tuple(str(fine) if word == "FINE" else word for word in COMMANDS[name])


def words(*of_command: str) -> list[str]:
    return [sys.executable, "-m", "truepose", *of_command, "--format", "json"]


def told(*of_command: str, code: int = 0) -> str:
    """What a command prints that ends with an exit code."""
    done = subprocess.run(
        words(*of_command),
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )
    assert (done.returncode, done.stderr) == (code, ""), done.stderr
    return done.stdout


@contextmanager
def sampling(cluster: Cluster, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A command whose slow worker samples the tenth of 22 parts."""
    tenth = folder / "tenth"
    cluster.worker("slow", SLOW, TOLD=str(tenth))
    command = words("montecarlo", str(HEXAPOD), "--samples", "50")
    begun = time.monotonic()
    with started([*command, "--scheduler", cluster.address]) as process:
        while not tenth.exists():
            assert time.monotonic() - begun < LIMIT, "no tenth part is begun"
            time.sleep(0.05)
        yield process


@pytest.mark.parametrize("name", COMMANDS)
def test_workers_give_the_bits_of_one_process(name: str, fine: Path, cluster: Cluster) -> None:
    command = of(name, fine)
    cluster.worker("one")
    cluster.worker("two")
    code = 1 if name in NOT_MET else 0
    here = told(*command, code=code)
    assert told(*command, "--scheduler", cluster.address, code=code) == here


def test_workers_of_this_computer_do_as_well(fine: Path) -> None:
    command = ("budget", str(fine), "--summary")
    assert told(*command, "--workers", "2") == told(*command)


def test_a_second_cluster_in_one_process(fine: Path, tmp_path: Path) -> None:
    script = tmp_path / "twice.py"
    script.write_text(TWICE)
    done = subprocess.run(
        [sys.executable, str(script), str(fine)],
        env=ENVIRONMENT, capture_output=True, text=True, timeout=LIMIT, check=False,
    )  # fmt: skip
    assert done.stdout == "twice\n", done.stderr


def test_workers_have_one_thread_and_keep_the_memory_of_arrays(tmp_path: Path) -> None:
    script = tmp_path / "kept.py"
    script.write_text(KEPT)
    done = subprocess.run(
        [sys.executable, str(script)],
        env=ENVIRONMENT, capture_output=True, text=True, timeout=LIMIT, check=False,
    )  # fmt: skip
    assert done.stdout == "[[None], ['1'], ['1']]\n", done.stderr


def test_a_worker_that_is_refused_is_named_in_python(
    fine: Path, tmp_path: Path, cluster: Cluster
) -> None:
    script = tmp_path / "warned.py"
    script.write_text(WARNED)
    cluster.worker("good")
    cluster.worker("older", OLDER)
    done = subprocess.run(
        [sys.executable, str(script), str(fine), cluster.address],
        env=ENVIRONMENT, capture_output=True, text=True, timeout=LIMIT, check=False,
    )  # fmt: skip
    assert "no work is given to worker older" in done.stdout, done.stderr


@pytest.mark.parametrize("name", ["budget", "part"])
def test_a_worker_that_dies_at_every_task_ends_it_with_its_name(
    name: str, fine: Path, cluster: Cluster
) -> None:
    """So it is the worker that computes."""
    cluster.worker("mortal", MORTAL, nanny=True)
    command = words(*of(name, fine), "--scheduler", cluster.address)
    with started(command) as process:
        out, err = process.communicate(timeout=LIMIT)
    assert process.returncode == 2, err
    (problem,) = json.loads(out)["problems"]
    assert problem["code"] == "worker-lost"
    assert problem["found"] == "1 worker lost: mortal"


def test_an_encrypted_cluster(fine: Path, tmp_path: Path) -> None:
    security = pytest.importorskip("distributed.security").Security.temporary()
    tls, folder = tmp_path / "tls", tmp_path / "cluster"
    tls.mkdir()
    folder.mkdir()
    (tls / "ca.pem").write_text(security.tls_ca_file)
    (tls / "cert.pem").write_text(security.tls_client_cert)
    (tls / "key.pem").write_text(security.tls_client_key)
    command = ("budget", str(fine), "--summary")
    with ExitStack() as stack:
        cluster = Cluster(folder, stack, tls)
        assert cluster.address.startswith("tls://")
        cluster.worker("one")
        assert told(*command, "--scheduler", cluster.address, "--tls", str(tls)) == told(*command)


def test_a_scheduler_that_dies_on_the_way_ends_it(cluster: Cluster, tmp_path: Path) -> None:
    with sampling(cluster, tmp_path) as process:
        cluster.scheduler.kill()
        out, err = process.communicate(timeout=LIMIT)
    assert process.returncode == 2, err
    assert [problem["code"] for problem in json.loads(out)["problems"]] == ["no-scheduler"]
    assert "Traceback" not in err


def test_ctrl_c_gives_what_is_sampled_by_then(cluster: Cluster, tmp_path: Path) -> None:
    with sampling(cluster, tmp_path) as process:
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=LIMIT)
    assert process.returncode == 130, err
    assert "Traceback" not in err
    found = json.loads(out)
    assert found["attributes"]["interrupted"] == 1
    numbers = found["coordinates"]["pose"]["values"]
    assert 0 < len(numbers) < 675
    whole = json.loads(told("montecarlo", str(HEXAPOD), "--samples", "50"))
    mean = whole["variables"]["mean"]["values"]
    assert found["variables"]["mean"]["values"] == [mean[number] for number in numbers]
