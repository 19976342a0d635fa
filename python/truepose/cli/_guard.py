"""The command group: loads a command when it is asked for and turns failures into exit codes."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Mapping
from typing import Any

import click

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells count it (128 + SIGINT)."""
PIPE_CLOSED = 141
"""Exit code when the reader of our output went away (128 + SIGPIPE)."""
BAD_INPUT = 2


class GuardedGroup(click.Group):
    """A click group whose commands are modules, each holding one `command`.

    Problems of the user's input are printed without a traceback and give exit code 2; Ctrl-C and
    a closed pipe end quietly with the codes that shells use.
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

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; every failure that is not a defect becomes an exit code."""
        try:
            result = super().invoke(ctx)
            sys.stdout.flush()
        except KeyboardInterrupt:
            click.echo("Interrupted: no file was changed.", err=True)
            return INTERRUPTED
        except BrokenPipeError:
            # Python flushes stdout once more at exit; send that to nowhere.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return PIPE_CLOSED
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


JSON_ASKED = "truepose.json_asked"
"""Key in the context's shared `meta`: set once `--format json` is parsed."""
