"""Answers worked out in a process of its own, which a newer question may end.

One evaluation runs and at most one waits: who asks again while one waits takes its place. A newer
question is seen by the process between its steps and between blocks of poses; where a step takes
longer than `GRACE` the process is ended and another takes over. Where the system can fork, that one
is there within milliseconds, with all of truepose imported already.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from typing import Any

from truepose.errors import Problem
from truepose.language import speaking
from truepose.studio.answers import KNOWN
from truepose.studio.jobs import Asked, Given, Job, answer

GRACE = 0.1
"""s that a step may go on after a newer question, before its process is ended."""
PATIENCE = 0.2
"""s that the first answer may take though a newer question waits: numbers then follow a slider."""

NICER = 5
"""How much the process stands back behind the browser, which draws on the same computer."""

WARM = ("truepose.studio.evaluation", "truepose.studio.rehearsal")
"""What a process that forks has imported."""

STOP = None
"""What the server sends to have a job end, and the process where it has ended."""


def work(connection: Connection) -> None:
    """What the process does: answers jobs until nobody listens."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server
    if hasattr(os, "nice"):
        os.nice(NICER)
    try:
        while True:
            job: Job | None = connection.recv()
            if job is STOP:  # of one that had ended by itself
                continue
            with speaking(job.language):
                for given in answer(job, connection.poll):
                    connection.send(given)
            connection.send(STOP)
    except (EOFError, OSError):
        return


def context() -> Any:
    """How processes are started: forked from one that is warm, where the system can."""
    forks = "forkserver" in multiprocessing.get_all_start_methods()
    chosen: Any = multiprocessing.get_context("forkserver" if forks else "spawn")
    if forks:
        chosen.set_forkserver_preload(list(WARM))
    return chosen


def by_itself(
    function: Callable[..., None], *arguments: object, started: Callable[[Any], None]
) -> Any:
    """What a process of its own sends over the connection that it gets before its arguments.

    `started` is called with the process, so that another thread can end it. Raises `EOFError` where
    it is ended before.
    """
    of = context()
    ours, theirs = of.Pipe(duplex=False)
    process = of.Process(target=function, args=(theirs, *arguments), daemon=True)
    process.start()
    started(process)
    theirs.close()
    try:
        with ours:
            return ours.recv()
    finally:
        process.kill()
        process.join()


class Evaluator:
    """The process that answers, and the thread that talks with it.

    `tell` is called from that thread with every answer.
    """

    def __init__(self, tell: Callable[[Given], None]) -> None:
        self._tell = tell
        self._context = context()
        self._lock = threading.Lock()
        self._waiting: Job | None = None
        self._closed = False
        self._bell, self._ring = multiprocessing.Pipe(duplex=False)
        self._process: Any = None
        self._connection: Connection | None = None
        self._thread = threading.Thread(target=self._run, name="evaluation", daemon=True)
        self._thread.start()

    def ask(self, job: Job) -> None:
        """Answer a job; one that waits is forgotten, one that runs ends."""
        with self._lock:
            self._waiting = job
        self._ring.send_bytes(b"!")

    def close(self) -> None:
        """End the process. What runs is not answered any more."""
        self._closed = True
        self._ring.send_bytes(b"!")
        self._thread.join()
        self._end()

    @property
    def process(self) -> int | None:
        """The number of the process that answers, if there is one."""
        process = self._process
        return None if process is None else process.pid

    # --- inside: the thread

    def _run(self) -> None:
        with suppress(EOFError, OSError):  # who asks is told
            self._begin()  # so that the first question need not wait for it
        while not self._closed:
            job = self._taken()
            if job is None:
                self._listen(None, None)
            else:
                self._answer(job)

    def _answer(self, job: Job) -> None:
        """Let a job be answered until the end, or until a newer one has to go first."""
        missing = list(job.asked)
        try:
            connection = self._begin()
            connection.send(job)
            patient = time.monotonic() + PATIENCE if missing and missing[0] == KNOWN else 0.0
            while not self._closed:
                left = patient - time.monotonic()
                if self._newer() and left <= 0.0:
                    self._stop(connection)
                    return
                self._listen(connection, left if self._newer() else None)
                while connection.poll():
                    given = connection.recv()
                    if given is STOP:
                        return
                    self._tell(given)
                    if given.last:
                        missing.remove(given.asked)
                    patient = 0.0
        except (EOFError, OSError):
            self._end()
            for asked in missing:
                self._tell(_died(job, asked))

    def _stop(self, connection: Connection) -> None:
        """Have what runs end: by itself, or else with its process."""
        connection.send(STOP)
        until = time.monotonic() + GRACE
        while connection.poll(max(0.0, until - time.monotonic())):
            given = connection.recv()
            if given is STOP:
                return
            self._tell(given)
        self._end()

    def _listen(self, connection: Connection | None, timeout: float | None) -> None:
        """Wait for an answer, or for somebody who asks."""
        wait([self._bell] if connection is None else [self._bell, connection], timeout)
        while self._bell.poll():
            self._bell.recv_bytes()

    def _newer(self) -> bool:
        with self._lock:
            return self._waiting is not None

    def _taken(self) -> Job | None:
        with self._lock:
            job, self._waiting = self._waiting, None
        return job

    def _begin(self) -> Connection:
        """The connection to the process, which is started where there is none."""
        if self._connection is None or not self._process.is_alive():
            self._end()
            ours, theirs = self._context.Pipe()
            process = self._context.Process(target=work, args=(theirs,), daemon=True)
            try:
                process.start()
            except BaseException:
                ours.close()
                raise
            finally:
                theirs.close()
            self._connection, self._process = ours, process
        return self._connection

    def _end(self) -> None:
        """End the process, whatever it does."""
        if self._connection is not None:
            self._connection.close()
            self._process.kill()
            self._process.join()
            self._process.close()
        self._connection = self._process = None


def _died(job: Job, asked: Asked) -> Given:
    """What is told of an answer whose process was ended by the system."""
    problem = Problem(
        "too-large",
        "the process that worked this out was ended, most likely for want of memory",
        found="no answer",
        expected="fewer poses",
    )
    return Given(job.number, asked, problems=[problem.to_dict()])


__all__ = ["Evaluator", "by_itself", "work"]
