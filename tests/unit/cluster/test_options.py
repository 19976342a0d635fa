"""What may be asked for, and how what may not is told."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import truepose as tp
from command_line import PLANAR, call
from truepose.cluster.instruction_sets import (
    SETS,
    best_instruction_set,
    computing_with,
    has,
    least,
)
from truepose.cluster.options import ClusterOptions, requested_cluster
from truepose.errors import RequestError

ADDRESS = "tcp://127.0.0.1:8786"


def test_nothing_asked_for_is_this_process() -> None:
    assert requested_cluster(None, None, None) is None


def test_workers_here_or_a_scheduler_elsewhere(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    assert requested_cluster(2, None, None) == ClusterOptions(2)
    for address in (ADDRESS, "tcp://node-1.cluster:8786", "tcp://[::1]:8786"):
        assert requested_cluster(None, address, None) == ClusterOptions(None, address)
    for name in ("ca.pem", "cert.pem", "key.pem"):
        (tmp_path / name).write_text("")
    secure = requested_cluster(None, "tls://host:8786", str(tmp_path))
    assert secure == ClusterOptions(None, "tls://host:8786", tmp_path)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ((0, None, None), "a whole number from 1 to 1024"),
        ((-2, None, None), "to compute in this process: leave --workers out"),
        ((1025, None, None), "a whole number from 1 to 1024"),
        ((2, ADDRESS, None), "--workers or --scheduler"),
        ((None, "", None), "tcp://HOST:PORT"),
        ((None, "127.0.0.1:8786", None), "tcp://HOST:PORT"),
        ((None, "http://127.0.0.1:8786", None), "tcp://HOST:PORT"),
        ((None, "tcp://127.0.0.1", None), "tcp://HOST:PORT"),
        ((None, "tls://host:8786", None), "needs both"),
        ((None, ADDRESS, "keys"), "needs both"),
        ((None, "tls://host:8786", "keys"), "no ca.pem, no cert.pem, no key.pem"),
        ((2, None, "keys"), "is for a scheduler"),
    ],
)
def test_bad_input(asked: tuple[int | None, str | None, str | None], said: str) -> None:
    workers, scheduler, tls = asked
    with pytest.raises(RequestError, match=r"bad-workers") as caught:
        tp.study(
            PLANAR, ["condition.temperature=20,30 degC"],
            workers=workers, scheduler=scheduler, tls=tls,
        )  # fmt: skip
    assert said in str(caught.value)


def test_no_worker_of_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    outcome = call(
        capsys, "study", PLANAR, "--vary", "condition.temperature=20,30 degC",
        "--workers", "0", "--output", tmp_path / "study.zarr",
    )  # fmt: skip
    assert (outcome.code, outcome.codes, outcome.out) == (2, ["bad-workers"], "")
    assert list(tmp_path.iterdir()) == []


def test_workers_without_their_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("truepose.cluster.options.find_spec", lambda _: None)
    with pytest.raises(RequestError, match=r"truepose\[cluster\]"):
        requested_cluster(2, None, None)


def test_without_workers_nothing_of_a_cluster_is_imported() -> None:
    before = set(sys.modules)
    tp.study(PLANAR, ["condition.temperature=20,30 degC"], quantities=["error"])
    assert not {"distributed", "dask"} & (set(sys.modules) - before)


def test_the_least_instruction_set() -> None:
    assert least(["avx512", "avx2"]) == "avx2"
    assert least(["portable", "avx512", "avx2"]) == "portable"
    best = best_instruction_set()
    for name in SETS:
        if has(best, name):
            with computing_with(name):
                assert best_instruction_set() == best
        else:
            with pytest.raises(RuntimeError), computing_with(name):
                pass
    assert not has(best, "avx1024")
    with pytest.raises(ValueError, match="none of"), computing_with("avx1024"):
        pass
