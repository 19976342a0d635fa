"""What a notebook shows of answers and tables: HTML tables of escaped text, without any colour."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from truepose.reporting.accuracy import Told, gains, told, where_answered
from truepose.reporting.table import Table
from truepose.representation import LEFT, Facts

if TYPE_CHECKING:
    from truepose.calibration.calibrate import Calibration
    from truepose.machine import Machine
    from truepose.verdict.answer import Answer

MOST_ROWS = 20
"""Of a table; of more the number is told."""


def table_html(table: Table) -> str:
    """A table; its first columns are words and stand to the left, as on a page."""
    head = "".join(
        _cell("th", name, at < table.words, 'scope="col"') for at, name in enumerate(table.header)
    )
    rows = "".join(
        f"<tr>{''.join(_cell('td', cell, at < table.words) for at, cell in enumerate(row))}</tr>"
        for row in table.rows[:MOST_ROWS]
    )
    more = len(table.rows) - MOST_ROWS
    note = " ".join([*([f"{more} more rows."] if more > 0 else []), table.note]).strip()
    return (
        f"<table><caption>{html.escape(table.title)}</caption>"
        + (f"<thead><tr>{head}</tr></thead>" if any(table.header) else "")
        + f"<tbody>{rows}</tbody></table>"
        + (f"<p>{html.escape(note)}</p>" if note else "")
    )


def answers_html(machine: Machine, answers: Sequence[Answer]) -> str:
    """The answers as the command says them, for which poses they are, and what is gained."""
    if not answers:
        return ""
    rows = [
        (of.word, of.name, of.size, "" if of.answer.asked is None else of.asked, of.basis)
        for of in told(machine, answers)
    ]
    return table_html(
        Table(
            "answers",
            "Is the accuracy kept?",
            ("", "", "size", "asked", ""),
            tuple(rows),
            words=5,
            note=" ".join([where_answered(answers), *map(_sentence, gains(answers))]),
        )
    )


def facts_of_answer(answer: Answer) -> Facts:
    """An answer of a machine that is known, in the machine's units, as the command says it."""
    assert answer.machine is not None
    of = Told(answer.machine, answer)
    yield "machine", answer.machine.name
    yield "quantity", of.name
    yield "answer", of.word
    yield "size", of.size
    if answer.asked is not None:
        yield "asked", of.asked
    yield "where and why", of.basis
    if of.witness:
        yield "witness", of.witness
    yield "poses", where_answered([answer])


def calibration_html(of: Calibration) -> str:
    """The answer, what remains to be measured, what the tool gains, and the residuals."""
    from truepose.reporting import calibration

    result, units = of.dataset, of.machine.shown
    tables: Iterable[Table | None] = (
        calibration.suspicions(result),
        calibration.undetermined(result),
        calibration.next_measurement(result, units),
        calibration.tool(result, units),
        calibration.residuals(result, units),
    )
    return "".join(table_html(table) for table in tables if table is not None)


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def _cell(tag: str, text: str, words: bool, attributes: str = "") -> str:
    look = f' style="{LEFT}"' if words else ""
    return f"<{' '.join([tag, attributes]).strip()}{look}>{html.escape(text)}</{tag}>"


__all__ = [
    "answers_html",
    "calibration_html",
    "facts_of_answer",
    "table_html",
]
