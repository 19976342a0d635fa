"""What runs in a worker: it says who it is, takes what all tasks share, and computes.

What tasks share is handed to a worker once, so that a task is as small as what is its own.
"""

from __future__ import annotations

import hashlib
import math
import os
import pickle
import platform
import signal
import socket
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy import ma  # noqa: F401  here, and not by two threads of a worker at once

from truepose._kernel import threads
from truepose.cluster.instruction_sets import best_instruction_set, computing_with
from truepose.version import version

Function = Callable[[Any, Any], Any]
"""What computes: (what all tasks share, what is this task's own) -> result."""

_COMPUTING = threading.Lock()
"""The instruction set is the process's, so a worker of many threads computes one task at a time."""


@dataclass(frozen=True)
class Greeting:
    """Who a worker is: its `name`, where it runs, the versions of what computes, its processor."""

    name: str
    host: str
    process: int
    versions: Mapping[str, str]
    instruction_set: str


def greet() -> Greeting:
    """Who this worker is."""
    from distributed import get_worker

    threads(1)
    name = str(get_worker().name)
    return Greeting(name, socket.gethostname(), os.getpid(), versions(), best_instruction_set())


@cache
def versions() -> dict[str, str]:
    """What has to be the same for results to have the same bits."""
    return {
        "truepose": version(),
        "Python": ".".join(platform.python_version_tuple()[:2]),
        "NumPy": np.__version__,
        "rounding": rounding()[:12],
    }


def rounding() -> str:
    """SHA-256 of what NumPy and the C library make of some numbers, to the last bit.

    NumPy takes other instructions, and rounds otherwise, on another processor.
    """
    x = np.linspace(0.05, 0.95, 576)
    square = x.reshape(24, 24) + np.eye(24)
    plain = (np.sin, np.cos, np.tan, np.arcsin, np.arccos, np.arctan, np.exp, np.log, np.sqrt)
    told = hashlib.sha256()
    for function in plain:
        told.update(function(x).tobytes())
    for pair in (np.arctan2(x, 1.0 - x), np.hypot(x, 1.0 - x), np.power(x, 1.7)):
        told.update(pair.tobytes())
    for table in (
        square @ square.T,
        np.einsum("ij,jk->ik", square, square),
        np.linalg.solve(square, square.T),
        np.linalg.norm(square, axis=1),
        np.linalg.svd(square, compute_uv=False),
        square.sum(axis=0),
    ):
        told.update(np.ascontiguousarray(table).tobytes())
    plain_numbers = [
        function(value)
        for function in (math.sin, math.exp, math.erf, math.lgamma)
        for value in x[::97].tolist()
    ]
    told.update(np.array(plain_numbers).tobytes())
    return told.hexdigest()


def hold(shared: bytes) -> tuple[Function, Any]:
    """What tasks share, a pickled (function, argument): a result that stays in this worker."""
    function, argument = pickle.loads(shared)  # noqa: S301  as all that a worker is handed
    return function, argument


def perform(held: tuple[Function, Any], instructions: str, own: bytes) -> Any:
    """The result of one task, computed with an instruction set on one thread.

    `own`: its pickled own argument. Raises as `computing_with` and as the function.
    """
    function, shared = held
    with _COMPUTING:
        threads(1)
        with computing_with(instructions):
            return function(shared, pickle.loads(own))  # noqa: S301


def dask_setup(_: object) -> None:
    """Begin as a worker of `--workers`: Ctrl-C of a terminal goes to the command alone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threads(1)


__all__ = ["Function", "Greeting", "dask_setup", "greet", "hold", "perform", "versions"]
