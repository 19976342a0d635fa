"""Tasks handed to workers one by one, and their results as they come.

Who gets which task is said here and not by the scheduler: a worker that is refused gets none, one
that comes late gets some, and what a lost worker had is given to another. So many tasks are under
way as keep all workers busy, and no more: what is kept here does not grow with the tasks.
"""

from __future__ import annotations

import pickle
import queue
import time
from collections import defaultdict, deque
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from truepose.cluster.in_worker import Function, hold, perform
from truepose.cluster.workers import Workers
from truepose.errors import Problem, RequestError
from truepose.files.wording import counted

if TYPE_CHECKING:
    from distributed import Future

AHEAD = 2
"""Tasks that a worker has: one that it computes, one that waits for it."""

LOOK = 0.5
"""s between two looks at who is there."""

RESULT = 30.0
"""s to wait for a result that is computed."""

MOST_LOSSES = 3
"""Workers that a task may lose, or times that a worker may be lost, before it ends all."""


def results(
    workers: Workers,
    function: Function,
    shared: Any,
    tasks: Iterator[tuple[int, Any]],
    instructions: str,
) -> Iterator[tuple[int, Any]]:
    """(number, `function(shared, own)`) of every task (number, own), computed by the workers.

    As they come. Numbers are all different; `function` is one that a worker can import. Raises
    `RequestError`: worker-lost, no-worker, no-scheduler, and what the function raises.
    """
    workers.require(instructions)
    workers.wait_for_one()
    handing = _HandingOut(workers, (function, shared), instructions)
    try:
        yield from handing.run(tasks)
    finally:
        handing.end()


class _Given:
    """A task that a worker has."""

    def __init__(self, own: bytes, address: str, future: Future) -> None:
        self.own, self.address, self.future = own, address, future


class _HandingOut:
    """One piece of work: what is under way, and what is to be given again."""

    def __init__(self, workers: Workers, work: tuple[Function, Any], instructions: str) -> None:
        self._workers = workers
        self._shared = pickle.dumps(work)
        self._instructions = instructions
        self._under_way: dict[int, _Given] = {}
        self._again: deque[tuple[int, bytes]] = deque()
        self._doing: defaultdict[str, set[int]] = defaultdict(set)
        self._held: dict[str, Future] = {}
        self._lost_with: defaultdict[int, list[str]] = defaultdict(list)
        self._deaths: defaultdict[str, int] = defaultdict(int)
        self._names: dict[str, str] = {}
        self._ready: queue.SimpleQueue[tuple[int, Future]] = queue.SimpleQueue()
        self._looked = -LOOK

    def run(self, tasks: Iterator[tuple[int, Any]]) -> Iterator[tuple[int, Any]]:
        """Results as they come."""
        more = True
        while True:
            self._look()
            more = self._give(tasks) and more
            if not (self._under_way or self._again or more):
                return
            ended = dict(self._ended())
            fetched = self._fetched(ended)
            for number, given in ended.items():
                if number in fetched:
                    yield self._done(number, given, fetched[number])
                elif self._under_way.get(number) is given:
                    yield from self._taken(number, given)

    def _look(self, *, now: bool = False) -> None:
        """See who is there, once in a while, and take back what the lost ones had."""
        if not now and time.monotonic() - self._looked < LOOK:
            return
        for address in self._workers.look():
            self._held.pop(address, None)
            numbers = self._doing.pop(address, set())
            if numbers:
                self._note_lost(self._names[address], address, numbers)
        self._looked = time.monotonic()

    def _give(self, tasks: Iterator[tuple[int, Any]]) -> bool:
        """Give every worker what it is short of -> whether there are more tasks."""
        for depth in range(AHEAD):
            for address in self._workers.usable:
                if len(self._doing[address]) > depth:
                    continue
                if self._again:
                    number, own = self._again.popleft()
                else:
                    try:
                        number, argument = next(tasks)
                    except StopIteration:
                        return False
                    own = pickle.dumps(argument)
                self._submit(number, own, address)
        return True

    def _submit(self, number: int, own: bytes, address: str) -> None:
        client = self._workers.client
        there: dict[str, Any] = {
            "workers": [address],
            "allow_other_workers": False,
            "pure": False,
        }
        if address not in self._held:
            self._held[address] = client.submit(hold, self._shared, priority=10, **there)
        future = client.submit(perform, self._held[address], self._instructions, own, **there)
        self._under_way[number] = _Given(own, address, future)
        self._doing[address].add(number)
        self._names[address] = self._workers.usable[address].name
        future.add_done_callback(lambda done: self._ready.put((number, done)))

    def _ended(self) -> Iterator[tuple[int, _Given]]:
        """Tasks that have ended; none after a while in which none has."""
        wait: float | None = LOOK
        while True:
            try:
                number, future = self._ready.get(wait is not None, wait)
            except queue.Empty:
                return
            given = self._under_way.get(number)
            if given is not None and given.future is future:
                yield number, given
            wait = None

    def _fetched(self, ended: Mapping[int, _Given]) -> dict[int, Any]:
        """The results of tasks that have ended, in one question; none where one is not there.

        A question costs the client as much as all else of a task.
        """
        from distributed import CancelledError

        futures = {
            number: given.future
            for number, given in ended.items()
            if given.future.status == "finished"
        }
        if len(futures) < 2:
            return {}
        client = self._workers.client

        async def gathered() -> list[Any]:
            values: list[Any] = await client.gather(
                list(futures.values()), errors="skip", asynchronous=True
            )
            return values

        try:
            values = client.sync(gathered, callback_timeout=RESULT)
        except (OSError, CancelledError):
            return {}
        if len(values) < len(futures):
            return {}
        return dict(zip(futures, values, strict=True))

    def _done(self, number: int, given: _Given, result: Any) -> tuple[int, Any]:
        """A task is done: its number and its result."""
        del self._under_way[number]
        self._doing[given.address].discard(number)
        self._lost_with.pop(number, None)
        self._deaths.pop(self._names[given.address], None)
        return number, result

    def _taken(self, number: int, given: _Given) -> Iterator[tuple[int, Any]]:
        """The result of a task that has ended, or nothing where it is to be computed again."""
        from distributed import CancelledError, KilledWorker

        status = given.future.status
        if status == "error":
            failure = given.future.exception(timeout=RESULT)
            if not isinstance(failure, KilledWorker):
                raise failure
            address = given.address
            name = self._names[address]
            self._note_lost(name, address, {number})
            return
        if status == "finished":
            try:
                result = given.future.result(timeout=RESULT)
            except (OSError, CancelledError):  # its worker went with it
                pass
            else:
                yield self._done(number, given, result)
                return
        self._look(now=True)
        if self._under_way.get(number) is given:  # the worker is there, and has it no more
            self._take_back(number, given)

    def _take_back(self, number: int, given: _Given) -> None:
        del self._under_way[number]
        self._doing[given.address].discard(number)
        self._again.append((number, given.own))

    def _note_lost(self, name: str, address: str, numbers: set[int]) -> None:
        """A worker was lost with some tasks, which another gets. Raises `RequestError`."""
        self._deaths[name] += 1
        for number in sorted(numbers):
            given = self._under_way.get(number)
            if given is not None and given.address == address:
                self._take_back(number, given)
            self._lost_with[number].append(name)
        most = max((self._lost_with[number] for number in numbers), key=len)
        if self._deaths[name] >= MOST_LOSSES or len(most) >= MOST_LOSSES:
            names = list(dict.fromkeys(most))
            raise RequestError(
                Problem(
                    "worker-lost",
                    "workers are lost at their tasks again and again",
                    found=f"{counted(len(names), 'worker')} lost: {', '.join(names)}",
                    expected="workers that live longer than a task",
                    hint="see what ended them (memory, the time they may run); a study goes on "
                    "with what is done",
                )
            )

    def end(self) -> None:
        """Nothing is under way any more."""
        client = self._workers.client
        futures = [given.future for given in self._under_way.values()] + [*self._held.values()]
        self._under_way.clear()
        self._held.clear()
        if futures and client.status == "running":
            with suppress(OSError, RuntimeError):
                client.cancel(futures, force=True)


__all__ = ["results"]
