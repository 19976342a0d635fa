"""The workers of a cluster: found, asked who they are, and taken or refused by their names."""

from __future__ import annotations

import logging
import time
import warnings
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from typing import TYPE_CHECKING, Any

from truepose._kernel import instruction_set
from truepose.cluster.in_worker import Greeting, greet, versions
from truepose.cluster.instruction_sets import has, least
from truepose.cluster.options import TLS_FILES, ClusterOptions, RefusedWorkerWarning
from truepose.errors import Problem, RequestError
from truepose.files.wording import counted

if TYPE_CHECKING:
    from distributed import Client, Future

PATIENCE = 60.0
"""s to wait for a worker while there is none that may compute."""

GREETING = 30.0
"""s to wait for workers that do not say who they are, once one may compute."""

ANSWER = 10.0
"""s to wait for a scheduler."""

NAMED = 8
"""Workers that a message names."""

_NOISY = ("distributed", "tornado", "asyncio")
"""Packages that log what an error of ours tells."""

_FAILURES = (OSError, RuntimeError, TypeError, ValueError)
"""What dask.distributed raises where nobody answers, or not as it should."""


class Workers:
    """Who may compute. `look` keeps it true: workers come and go while others compute.

    `usable`: greetings by address; `refused`: sentences by address.
    """

    def __init__(self, client: Client, place: str) -> None:
        """`place`: what the scheduler is called in messages."""
        self.client = client
        self.place = place
        self.usable: dict[str, Greeting] = {}
        self.refused: dict[str, str] = {}
        self.lost: dict[str, str] = {}
        self._untold: list[str] = []
        self._asked: dict[str, Future] = {}
        self._required: str | None = None
        self._since = time.monotonic()

    def begun_with(self) -> str:
        """The least instruction set that this process and the workers present have.

        Raises as `wait_for_one`.
        """
        self.wait_for_one()
        sets = (one.instruction_set for one in self.usable.values())
        return least([instruction_set(), *sets])

    def wait_for_one(self) -> None:
        """Wait for a worker that may compute, and for what others present say of themselves.

        Raises `RequestError`: no-worker where none comes, or all present are refused; no-scheduler.
        """
        begun: float | None = None
        while True:
            self.look()
            now = time.monotonic()
            if self.usable:
                begun = now if begun is None else begun
                if not self._asked or now - begun > GREETING:
                    return
            elif self.refused and not self._asked:
                raise self._none()
            time.sleep(0.05)

    def require(self, instructions: str) -> None:
        """Take those only that have an instruction set."""
        self._required = instructions
        for address, greeting in list(self.usable.items()):
            why = self._unfit(greeting)
            if why:
                del self.usable[address]
                self._refuse(address, greeting.name, why)
        self._tell()

    def look(self) -> list[str]:
        """Who is there -> addresses of those that may compute no more.

        Raises `RequestError`: no-scheduler where it is gone, no-worker where none that may compute
        was there for long.
        """
        try:
            there = set(self.client.nthreads())
        except _FAILURES as failure:
            raise gone(self.place, failure) from failure
        lost = [address for address in self.usable if address not in there]
        for address in lost:
            self.lost[self.usable.pop(address).name] = address
        for address in [*self._asked.keys() - there]:
            self.lost[address] = address
            del self._asked[address]
        for address in self.refused.keys() - there:
            del self.refused[address]
        for address in sorted(there - self.usable.keys() - self.refused.keys()):
            if address not in self._asked:
                self._asked[address] = self._ask(address)
        self._hear()
        now = time.monotonic()
        if self.usable:
            self._since = now
        elif now - self._since > PATIENCE:
            raise self._none()
        return lost

    def _ask(self, address: str) -> Future:
        return self.client.submit(
            greet, workers=[address], allow_other_workers=False, pure=False, priority=100
        )

    def _hear(self) -> None:
        """Take or refuse those that have answered."""
        for address, future in list(self._asked.items()):
            if future.status == "pending":
                continue
            del self._asked[address]
            try:
                greeting = future.result(timeout=ANSWER)
            except Exception as failure:  # a worker may lack anything, truepose itself too
                self._refuse(address, None, f"it cannot say who it is ({_short(failure)})")
                continue
            why = self._unfit(greeting)
            if why:
                self._refuse(address, greeting.name, why)
            else:
                self.usable[address] = greeting
        self._tell()

    def _unfit(self, greeting: Greeting) -> str:
        """Why a worker may not compute, or nothing."""
        own = versions()
        other = [
            f"{name} {greeting.versions.get(name, 'unknown')}, not {value}"
            for name, value in own.items()
            if greeting.versions.get(name) != value
        ]
        if other:
            return f"it has {', '.join(other)}"
        if self._required is not None and not has(greeting.instruction_set, self._required):
            return (
                f"its processor has {greeting.instruction_set} at most, and this was begun with "
                f"{self._required}"
            )
        return ""

    def _refuse(self, address: str, name: str | None, why: str) -> None:
        called = f"worker {address}" if name in (None, address) else f"worker {name} at {address}"
        self.refused[address] = f"{called}: {why}"
        self._untold.append(self.refused[address])

    def _tell(self) -> None:
        """Name the refused, once there is one that may compute; an error names them otherwise."""
        if self.usable:
            for said in self._untold:
                warnings.warn(f"no work is given to {said}", RefusedWorkerWarning, stacklevel=2)
            self._untold.clear()

    def _none(self) -> RequestError:
        """The error where nobody may compute."""
        said = list(self.refused.values())
        said += [f"worker {name} was lost" for name in self.lost if name not in self.usable]
        waiting = [f"worker {address} does not answer" for address in self._asked]
        said += waiting
        more = f"; and {counted(len(said) - NAMED, 'more')}" if len(said) > NAMED else ""
        return RequestError(
            Problem(
                "no-worker",
                f"{self.place} has no worker that may compute",
                found="; ".join(said[:NAMED]) + more if said else "no worker",
                expected="workers with "
                + ", ".join(f"{name} {value}" for name, value in versions().items()),
                hint="start workers of this installation: dask worker ADDRESS --nthreads 1"
                if not said
                else None,
            )
        )


@contextmanager
def connected(options: ClusterOptions) -> Iterator[Workers]:
    """Workers that are started for what is done inside, or those of a scheduler.

    Raises `RequestError`: no-scheduler, no-worker.
    """
    import dask
    import distributed  # noqa: F401  first: as it comes it completes the configuration set here

    quiet: dict[str, Any] = {
        "distributed.comm.timeouts.connect": f"{ANSWER:g}s",
        "distributed.scheduler.http.routes": [],
        "distributed.worker.http.routes": [],
        "distributed.nanny.environ": {"TRUEPOSE_THREADS": "1"},
        # Not given back to the system after every array: that takes as long as half of the work.
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
    }
    with ExitStack() as stack:
        stack.enter_context(_silent())
        stack.enter_context(dask.config.set(quiet))
        if options.scheduler is None:
            assert options.workers is not None
            client = stack.enter_context(_started(options.workers))
            place = f"the cluster of {counted(options.workers, 'worker')}"
        else:
            client = stack.enter_context(_answering(options))
            place = f"the scheduler {options.scheduler}"
        yield Workers(client, place)


@contextmanager
def _silent() -> Iterator[None]:
    """What goes wrong is told once, by an error of ours."""
    # Each by its name: some of those below have levels of their own.
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] in _NOISY]
    loggers = [logging.getLogger(name) for name in {*names, *_NOISY}]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", RefusedWorkerWarning)
        try:
            yield
        finally:
            for logger, level in zip(loggers, before, strict=True):
                logger.setLevel(level)


@contextmanager
def _started(count: int) -> Iterator[Client]:
    """A client of so many new processes; nobody else can reach them.

    They listen on this computer alone, and take nobody who has not the key that is made here.
    """
    from distributed import Client, LocalCluster
    from distributed.security import Security

    security = Security.temporary()
    try:
        cluster: Any = LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            protocol="tls://",
            security=security,
            dashboard_address="127.0.0.1:0",
            worker_dashboard_address=None,
            scheduler_kwargs={"dashboard": False},
            memory_limit=0,
            preload=["truepose.cluster.in_worker"],
            silence_logs=logging.CRITICAL + 1,
        )
    except _FAILURES as failure:
        raise RequestError(
            Problem(
                "no-worker",
                f"{counted(count, 'worker')} could not be started",
                found=_short(failure),
                expected="processes that this computer starts",
                hint="a script that calls truepose with workers has its calls below "
                'if __name__ == "__main__":',
            )
        ) from failure
    try:
        with Client(cluster, timeout=ANSWER, set_as_default=False) as client:
            yield client
    finally:
        with suppress(*_FAILURES):
            cluster.close(timeout=ANSWER)


@contextmanager
def _answering(options: ClusterOptions) -> Iterator[Client]:
    from distributed import Client
    from distributed.security import Security

    security: Mapping[str, Any] = {}
    if options.tls is not None:
        ca, certificate, key = (str(options.tls / name) for name in TLS_FILES.values())
        security = {"tls_ca_file": ca, "tls_client_cert": certificate, "tls_client_key": key}
    assert options.scheduler is not None
    try:
        client = Client(
            options.scheduler,
            timeout=ANSWER,
            set_as_default=False,
            security=Security(require_encryption=True, **security) if security else None,
        )
    except _FAILURES as failure:
        raise gone(f"the scheduler {options.scheduler}", failure) from failure
    try:
        yield client
    finally:
        with suppress(*_FAILURES):
            client.close(timeout=ANSWER)


def gone(place: str, failure: BaseException) -> RequestError:
    """The error of a scheduler that does not answer, or no more."""
    return RequestError(
        Problem(
            "no-scheduler",
            f"{place} does not answer",
            found=_short(failure),
            expected="a scheduler of dask.distributed that can be reached from here",
            hint="start one: dask scheduler, and workers for it",
        )
    )


def _short(failure: BaseException) -> str:
    """The last cause of a failure, on one line."""
    while failure.__cause__ is not None:
        failure = failure.__cause__
    text = " ".join(str(failure).split()) or type(failure).__name__
    return text if len(text) <= 200 else f"{text[:197]}..."


__all__ = ["Workers", "connected", "gone"]
