"""Answers and tables on stdout, in colour on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from truepose.reporting import terminal

if TYPE_CHECKING:
    from truepose.machine import Machine
    from truepose.plausibility import Oddity
    from truepose.reporting.table import Table
    from truepose.verdict.answer import Answer


def show_tables(tables: Iterable[Table]) -> None:
    """Print tables for people."""
    for table in tables:
        _print(terminal.tables_text([table], terminal=sys.stdout.isatty()))


def show_described(
    title: str, header: tuple[str, ...], rows: Iterable[tuple[str, str, Mapping[str, Any]]]
) -> None:
    """A table of what there is: a name, what it is, and what it takes, each with its `doc`."""
    from truepose.reporting.table import Table

    described = tuple(
        (name, doc, "; ".join(f"{key}: {told.doc}" for key, told in options.items()))
        for name, doc, options in rows
    )
    show_tables([Table(title.lower(), title, header, described, words=len(header))])


def show_oddities(oddities: Iterable[Oddity], *, err: bool = False) -> None:
    """Print what looks odd, a paragraph each: above the answers, or with a failure on stderr."""
    if err:
        for oddity in oddities:
            click.echo(f"{terminal.LOOKS_ODD}[{oddity.code}]: {oddity.sentence}", err=True)
        return
    _print(terminal.oddities_text(oddities, terminal=sys.stdout.isatty()))


def show_answers(machine: Machine, answers: Sequence[Answer]) -> None:
    """Print for which poses the answers are, then each, before anything else.

    At the end what compensation gains.
    """
    _print(terminal.answers_text(machine, answers, terminal=sys.stdout.isatty()))


def show_lines(lines: Iterable[tuple[str, str, str]]) -> None:
    """Print answers, each its word, the name of its colour, and what it says."""
    _print(terminal.lines_text(lines, terminal=sys.stdout.isatty()))


def _print(text: str) -> None:
    sys.stdout.write(text)
