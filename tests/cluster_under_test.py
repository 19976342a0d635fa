"""A scheduler and workers of dask.distributed in processes of their own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

LIMIT = 250.0
"""s; what hangs does so for good."""

PATH = os.pathsep.join(str(Path(folder).resolve()) for folder in sys.path if folder)
ENVIRONMENT = os.environ | {"PYTHONPATH": PATH, "TRUEPOSE_THREADS": "1"}


@contextmanager
def started(words: list[str], **more: str) -> Iterator[subprocess.Popen[str]]:
    """A process with its own children, which are all gone afterwards."""
    process = subprocess.Popen(
        words, env=ENVIRONMENT | more, text=True, start_new_session=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        yield process
    finally:
        with suppress(ProcessLookupError):  # whoever was left by one that ended
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                stream.close()


class Cluster:
    """A scheduler in a process of its own, and the workers that it is given."""

    def __init__(self, folder: Path, stack: ExitStack, tls: Path | None = None) -> None:
        """`tls`: a folder with ca.pem, cert.pem and key.pem, with which all are encrypted."""
        self._folder, self._stack = folder, stack
        files = {"ca-file": "ca.pem", "cert": "cert.pem", "key": "key.pem"}
        self._encrypted: list[str] = []
        if tls is not None:
            for option, name in files.items():
                self._encrypted += [f"--tls-{option}", str(tls / name)]
        file = folder / "scheduler.json"
        self.scheduler = stack.enter_context(
            started(
                [
                    sys.executable,
                    "-m",
                    "distributed.cli.dask_scheduler",
                    "--host",
                    "127.0.0.1",
                    "--port",
                    "0",
                    "--dashboard-address",
                    "127.0.0.1:0",
                    "--no-dashboard",
                    "--scheduler-file",
                    str(file),
                    *(["--protocol", "tls", *self._encrypted] if tls else []),
                ],
            )
        )
        begun = time.monotonic()
        while not file.exists() or not file.read_text().strip():
            assert time.monotonic() - begun < LIMIT, "the scheduler does not start"
            time.sleep(0.05)
        self.address: str = json.loads(file.read_text())["address"]

    def worker(self, name: str, *scripts: str, nanny: bool = False, **more: str) -> None:
        preloads = []
        for number, script in enumerate(scripts):
            path = self._folder / f"{name}_{number}.py"
            path.write_text(script)
            preloads += ["--preload", str(path)]
        words = [self.address, "--name", name, "--nthreads", "1", "--no-dashboard"]
        words += self._encrypted
        words += ["--nanny" if nanny else "--no-nanny"]
        words += ["--local-directory", str(self._folder / name), *preloads]
        self._start("worker", words, **more)

    def _start(self, what: str, words: list[str], **more: str) -> None:
        module = f"distributed.cli.dask_{what}"
        process = started([sys.executable, "-m", module, *words], **more)
        self._stack.enter_context(process)
