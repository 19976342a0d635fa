"""Tables on the terminal."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.table import Table as RichTable

    from truepose.machine import Machine
    from truepose.plausibility import Oddity
    from truepose.reporting.table import Table
    from truepose.verdict.answer import Answer

PIPED_WIDTH = 160
"""Columns where the output is no terminal, so that no table is squeezed."""


def show_tables(tables: Iterable[Table]) -> None:
    """Print tables for people on stdout, in colour on a terminal."""
    from rich.text import Text

    for table in tables:
        shown: list[Any] = [Text(table.title, style="bold"), _rich(table)]
        if table.note:
            shown.append(Text(table.note, style="dim"))
        _print([*shown, Text()])


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


def _print(shown: Iterable[Any]) -> None:
    """Print what rich can render on stdout, in colour on a terminal."""
    from rich.console import Console

    terminal = sys.stdout.isatty()
    # Written as one text: rich itself would answer a closed pipe by leaving with exit code 1.
    text = io.StringIO()
    console = Console(
        file=text,
        highlight=False,
        force_terminal=terminal,
        width=None if terminal else PIPED_WIDTH,
    )
    for table in shown:
        console.print(table)
    sys.stdout.writelines(f"{line.rstrip(' ')}\n" for line in text.getvalue().splitlines())


def show_oddities(oddities: Iterable[Oddity], *, err: bool = False) -> None:
    """Print what looks odd, a paragraph each: above the answers, or with a failure on stderr."""
    if err:
        for oddity in oddities:
            click.echo(f"{_LOOKS_ODD}[{oddity.code}]: {oddity.sentence}", err=True)
        return
    from rich.text import Text

    lines = [
        Text.assemble((_LOOKS_ODD, "bold yellow"), f"[{oddity.code}]: {oddity.sentence}")
        for oddity in oddities
    ]
    if lines:
        _print([*lines, Text()])


_LOOKS_ODD = "looks odd"

COLOURS = {"met": "green", "missed": "red", "open": "yellow", "none": "default"}
"""Of an answer's word."""


def show_answers(machine: Machine, answers: Sequence[Answer]) -> None:
    """Print for which poses the answers are, then each, before anything else.

    At the end what compensation gains.
    """
    from rich.table import Table as RichTable
    from rich.text import Text

    from truepose.reporting.accuracy import gains, told, where_answered

    lines = RichTable.grid(padding=(0, 2))
    if answers:
        lines.add_row("", Text(where_answered(answers)))
    for answer in told(machine, answers):
        lines.add_row(Text(answer.word, f"bold {COLOURS[answer.colour]}"), Text(answer.line))
        if answer.witness:
            lines.add_row("", Text(f"witness: {answer.witness}", style="dim"))
    for sentence in gains(answers):
        lines.add_row("", Text(sentence))
    if lines.row_count:
        _print([lines, Text()])


def show_lines(lines: Iterable[tuple[str, str, str]]) -> None:
    """Print answers, each its word, the word's colour, and what it says."""
    from rich.table import Table as RichTable
    from rich.text import Text

    grid = RichTable.grid(padding=(0, 2))
    for word, colour, text in lines:
        grid.add_row(Text(word, f"bold {colour}"), Text(text))
    if grid.row_count:
        _print([grid, Text()])


def _rich(table: Table) -> RichTable:
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    shown = RichTable(box=box.SIMPLE_HEAD, show_header=any(table.header), pad_edge=False)
    for index, name in enumerate(table.header):
        shown.add_column(
            Text(name), justify="left" if index < table.words else "right", overflow="fold"
        )
    for row in table.rows:
        shown.add_row(*(Text(cell) for cell in row))
    return shown
