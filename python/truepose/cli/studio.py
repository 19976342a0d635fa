"""`truepose studio`: the live page with the file behind it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from truepose.cli._ending import INTERRUPTED
from truepose.cli._options import language_option, machine_argument, takes

PORT = 8768
"""Where nothing else is said, and nothing was before."""


@click.command("studio")
@takes(
    machine_argument,
    click.option(
        "--host",
        default="127.0.0.1",
        show_default=True,
        metavar="ADDRESS",
        help="Where it listens. Another address than this computer's own lets others in who know "
        "the token, over a connection that is not encrypted.",
    ),
    click.option(
        "--port",
        type=click.IntRange(1, 65535),
        help=f"The port; where another process has it, the next one. Default: that of the last "
        f"time, or {PORT}.",
    ),
    click.option(
        "--open/--no-open",
        "opens",
        default=None,
        help="Open the page in a browser. Default: where the output is a terminal.",
    ),
    language_option,
)
def command(language: str, **options: Any) -> int:
    """Serve the live page with the machine file behind it.

    On the page every number of the file can be changed, undone and saved as another file; the
    verdict over the workspace, what it rests on, and shares follow. The machine file itself is
    never written. The address has a token, without which nothing is served; Ctrl-C ends it.
    """
    from truepose.reporting.drawing_packages import speaking_for

    with speaking_for(language):
        return _serve(**options)


def _serve(machine_file: Path, host: str, port: int | None, opens: bool | None) -> int:
    from truepose.cli._steps import load_machine
    from truepose.files.one_run import is_stdin
    from truepose.reporting.drawing_packages import module_that_draws

    if is_stdin(machine_file):
        raise click.UsageError("studio serves a file, and standard input is none.")
    server: Any = module_that_draws("truepose.studio.server", "studio")
    load_machine(machine_file)  # its problems are told before anything listens

    from truepose.studio.access import Access
    from truepose.studio.shared_state import SharedState
    from truepose.studio.state_file import read_state, state_path

    path = state_path(machine_file)
    kept = read_state(path)
    wanted = port or kept.port or PORT
    try:
        at = server.listening(host, wanted)
    except OSError as failure:
        reason = failure.strerror or str(failure)
        raise click.BadParameter(f"{host}: {reason}", param_hint="--host") from None
    taken = at.getsockname()[1]
    if taken != wanted:
        click.echo(f"Port {wanted} is taken by another process: {taken} instead.", err=True)
    session = SharedState.opened(machine_file, kept.history)
    if session.settings.edits != kept.history.now.edits:
        click.echo("The file does not take the edits of the last time any more.", err=True)
    access = Access(kept.token, host, taken)
    studio = server.Studio(session, access, path)

    def ready() -> None:
        if studio.not_kept:
            click.echo(f"Nothing is kept for the next time: {studio.not_kept}.", err=True)
        click.echo(f"{access.address()}")
        sys.stdout.flush()
        if sys.stdout.isatty() if opens is None else opens:
            import webbrowser

            webbrowser.open(access.address())

    try:
        server.serve(studio, at, ready)
    except KeyboardInterrupt:
        return INTERRUPTED
    return 0
