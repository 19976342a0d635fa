"""Show the problems of the user's input: on stderr for people, on stdout as JSON for programs."""

from __future__ import annotations

import json
import sys

import click

from truepose.errors import Problem, TrueposeError

MOST_EXPLAINED = 20
"""Problems whose codes a person is pointed to the explanations of."""


def show_problems(failure: TrueposeError, *, as_json: bool) -> None:
    """Print all problems that `failure` carries.

    They always go to stderr (on a terminal with colour, and how to read more of them); with
    `as_json` they are also printed on stdout as `{"problems": [{"code": ..., ...}]}`.
    """
    if sys.stderr.isatty():
        _show_on_terminal(failure.problems)
    else:
        click.echo(str(failure), err=True)
    if as_json:
        problems = [problem.to_dict() for problem in failure.problems]
        click.echo(json.dumps({"problems": problems}, indent=1, ensure_ascii=False))


def _show_on_terminal(problems: tuple[Problem, ...]) -> None:
    from rich.console import Console
    from rich.text import Text

    console = Console(stderr=True, highlight=False)
    for problem in problems:
        place = ":".join(problem.place)
        head = Text.assemble(
            (f"{place}: " if place else "", "bold"),
            ("error", "bold red"),
            (f"[{problem.code}] ", "red"),
            problem.message,
        )
        console.print(head)
        for label in ("found", "expected", "hint"):
            value = getattr(problem, label)
            if value not in (None, ""):
                console.print(Text.assemble((f"  {label + ':':<10}", "cyan"), str(value)))
    codes = " ".join(dict.fromkeys(problem.code for problem in problems[:MOST_EXPLAINED]))
    console.print(Text(f"More, with an example: truepose explain {codes}", style="dim"))
