"""Options of commands that other processes may compute for."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from truepose.cli._options import WholeNumber
from truepose.cluster.options import RefusedWorkerWarning

cluster_options = (
    click.option(
        "--workers",
        type=WholeNumber(),
        metavar="N",
        help="Let N processes of this computer work, one thread each; the numbers are the same.",
    ),
    click.option(
        "--scheduler",
        metavar="ADDRESS",
        help="Let the workers of a dask.distributed scheduler work: tcp://HOST:PORT, or "
        "tls://HOST:PORT with --tls.",
    ),
    click.option(
        "--tls",
        "tls",
        metavar="FOLDER",
        type=click.Path(path_type=Path),
        help="Folder with ca.pem, cert.pem and key.pem for a scheduler at tls://.",
    ),
)


@contextmanager
def telling() -> Iterator[None]:
    """Say on stderr, inside, which workers are given no work."""

    def tell(message: Warning | str, *_: Any) -> None:
        click.echo(f"warning: {message}", err=True)

    with warnings.catch_warnings():
        warnings.simplefilter("always", RefusedWorkerWarning)
        shown = warnings.showwarning
        warnings.showwarning = lambda message, kind, *where: (
            tell(message)
            if issubclass(kind, RefusedWorkerWarning)
            else shown(message, kind, *where)
        )
        yield
