"""Which workers compute: asked for by a number, or by the address of their scheduler."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from truepose.errors import Problem, RequestError
from truepose.files.limits import MOST_WORKERS
from truepose.files.wording import one_of

TLS_FILES = {"ca": "ca.pem", "certificate": "cert.pem", "key": "key.pem"}
"""Files of the folder of `--tls`: whom this computer believes, who it is, how it proves that."""

_ADDRESS = re.compile(r"(tcp|tls)://(\[[0-9A-Fa-f:]+\]|[\w.-]+):\d{1,5}")


class RefusedWorkerWarning(UserWarning):
    """A worker is given no work; the text says which, and why."""


@dataclass(frozen=True)
class ClusterOptions:
    """So many `workers` on this computer, or those of a `scheduler`; `tls`: the folder for it."""

    workers: int | None = None
    scheduler: str | None = None
    tls: Path | None = None


def requested_cluster(
    workers: int | None, scheduler: str | None, tls: str | Path | None
) -> ClusterOptions | None:
    """What is asked for, or None where this process computes.

    Raises `RequestError`: bad-workers, extra-missing.
    """
    if workers is None and scheduler is None and tls is None:
        return None
    folder = None if tls is None else Path(tls)
    problems = [*_of_number(workers, scheduler), *_of_address(scheduler, folder)]
    if folder is not None:
        problems += _of_folder(folder)
    if problems:
        raise RequestError(*problems)
    if find_spec("distributed") is None:
        raise RequestError(
            Problem(
                "extra-missing",
                "workers need a package that is not installed",
                found="no distributed",
                expected="dask.distributed",
                hint="pip install 'truepose[cluster]'",
            )
        )
    return ClusterOptions(workers, scheduler, folder)


def _of_number(workers: int | None, scheduler: str | None) -> list[Problem]:
    if workers is not None and scheduler is not None:
        return [
            Problem(
                "bad-workers",
                "workers are started here, or a scheduler has its own",
                found=f"{workers} and {scheduler}",
                expected="--workers or --scheduler",
            )
        ]
    if workers is not None and not 1 <= workers <= MOST_WORKERS:
        return [
            Problem(
                "bad-workers",
                "so many workers cannot be started",
                found=f"{workers}",
                expected=f"a whole number from 1 to {MOST_WORKERS}",
                hint="to compute in this process: leave --workers out" if workers < 1 else None,
            )
        ]
    return []


def _of_address(scheduler: str | None, tls: Path | None) -> list[Problem]:
    if scheduler is None:
        if tls is None:
            return []
        return [
            Problem(
                "bad-workers",
                "the folder of --tls is for a scheduler",
                found=str(tls),
                expected="--scheduler tls://HOST:PORT with it",
            )
        ]
    address = _ADDRESS.fullmatch(scheduler)
    if address is None:
        return [
            Problem(
                "bad-workers",
                "this is no address of a scheduler",
                found=scheduler or "nothing",
                expected="tcp://HOST:PORT, or tls://HOST:PORT",
            )
        ]
    if (address[1] == "tls") is not (tls is not None):
        return [
            Problem(
                "bad-workers",
                "an encrypted connection needs both, a tls:// address and the folder of --tls",
                found=scheduler if tls is None else f"{scheduler} and --tls {tls}",
                expected=f"tls://HOST:PORT and a folder with {', '.join(TLS_FILES.values())}",
            )
        ]
    return []


def _of_folder(folder: Path) -> list[Problem]:
    missing = [name for name in TLS_FILES.values() if not (folder / name).is_file()]
    if not missing:
        return []
    return [
        Problem(
            "bad-workers",
            "the folder of --tls lacks what it should have",
            file=str(folder),
            found=f"no {', no '.join(missing)}",
            expected=one_of(TLS_FILES.values()).replace("one of ", "the files "),
        )
    ]


def refuse_workers(cluster: ClusterOptions, why: str, asked: str, expected: str) -> RequestError:
    """The error (bad-workers) where what is asked for is not shared by workers; `asked`: what."""
    return RequestError(
        Problem(
            "bad-workers",
            why,
            found=f"{cluster.workers or cluster.scheduler} {asked}",
            expected=expected,
        )
    )


__all__ = [
    "TLS_FILES",
    "ClusterOptions",
    "RefusedWorkerWarning",
    "refuse_workers",
    "requested_cluster",
]
