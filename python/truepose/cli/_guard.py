"""The command group: loads a command when it is asked for and turns failures into exit codes."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Mapping
from typing import Any

import click

from truepose.cli._ending import BAD_INPUT, INTERRUPTED, PipeClosedError


class GuardedGroup(click.Group):
    """A click group whose commands are modules, each holding one `command`.

    Problems of the user's input are printed without a traceback and give exit code 2; Ctrl-C ends
    with the code that shells use. What else fails is left to `ending`.
    """

    def __init__(self, *args: Any, modules: Mapping[str, str], **settings: Any) -> None:
        super().__init__(*args, **settings)
        self._modules = modules

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of the registry, which is the order of work."""
        return list(self._modules)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the module of one command."""
        if cmd_name not in self._modules:
            return None
        command: click.Command = importlib.import_module(self._modules[cmd_name]).command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """As click, with the nearest name suggested for one that is unknown."""
        if args and args[0] not in self._modules and not args[0].startswith("-"):
            from difflib import get_close_matches

            near = get_close_matches(args[0], self._modules, n=1)
            hint = f" Did you mean '{near[0]}'?" if near else ""
            raise click.UsageError(f"No such command '{args[0]}'.{hint}", ctx)
        return super().resolve_command(ctx, args)

    def get_help(self, ctx: click.Context) -> str:
        """As click, never wider than the page that was written before (`truepose.__main__`)."""
        formatter = click.HelpFormatter()
        self.format_help(ctx, formatter)
        return formatter.getvalue().rstrip("\n")

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """As click, which already prints help here."""
        try:
            return super().make_context(info_name, args, parent, **extra)
        except BrokenPipeError as closed:
            raise PipeClosedError from closed

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; a problem of its input becomes an exit code."""
        from truepose.files.one_run import one_run

        try:
            with one_run():
                return self._guarded(ctx)
        except BrokenPipeError as closed:
            raise PipeClosedError from closed

    def _guarded(self, ctx: click.Context) -> Any:
        try:
            result = super().invoke(ctx)
            sys.stdout.flush()
        except KeyboardInterrupt:
            from truepose.files.one_run import written

            names = ", ".join(str(path) for path in written())
            click.echo(
                f"Interrupted after {names} was written." if names else INTERRUPTED_UNCHANGED,
                err=True,
            )
            return INTERRUPTED
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except Exception as failure:
            # Only now is the error type needed: importing it earlier would slow `--help`.
            from truepose.errors import TrueposeError

            if not isinstance(failure, TrueposeError):
                raise
            from truepose.cli._problems import show_problems

            show_problems(failure, as_json=ctx.find_root().meta.get(JSON_ASKED, False))
            return BAD_INPUT
        return result


INTERRUPTED_UNCHANGED = "Interrupted: no file was changed."

JSON_ASKED = "truepose.json_asked"
"""Key in the context's shared `meta`: set once `--format json` is parsed."""
