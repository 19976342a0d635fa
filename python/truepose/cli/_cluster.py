"""Options of commands that other processes may compute for."""

from __future__ import annotations

from pathlib import Path

import click

from truepose.cli._options import WholeNumber

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


def told(text: str) -> None:
    """Say who is given no work."""
    click.echo(f"warning: {text}", err=True)
