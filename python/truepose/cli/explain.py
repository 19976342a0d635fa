"""`truepose explain`: what a code means, an example that gives it, and what to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from truepose.cli import _complete

if TYPE_CHECKING:
    from collections.abc import Iterator

    from truepose.explanations import Explanation

WIDTH = 79


@click.command("explain")
@click.argument("codes", metavar="[CODE]...", nargs=-1, shell_complete=_complete.codes)
def command(codes: tuple[str, ...]) -> int:
    """Say what a CODE means, what to do, and show an example.

    A CODE stands in brackets behind `error` and `warning`, in results where a pose is left out,
    and in the answer of a calibration. Without one all are listed.
    """
    from truepose.explanations import explanations

    every = explanations()
    if not codes:
        click.echo("\n".join(_listed(every)))
        return 0
    asked = [_code(word) for word in codes]
    unknown = [code for code in asked if code not in every]
    if unknown:
        raise _unknown(unknown, every)
    click.echo("\n\n".join("\n".join(_explained(every[code])) for code in dict.fromkeys(asked)))
    return 0


def _code(word: str) -> str:
    """A code as it was copied: `error[no-unit]:` too."""
    return word.rpartition("[")[2].partition("]")[0].strip(" :").lower()


def _listed(every: dict[str, Explanation]) -> Iterator[str]:
    from truepose.explanations import TOPICS

    width = max(map(len, every))
    for topic, title in TOPICS.items():
        yield from (title, "")
        for explanation in every.values():
            if explanation.topic == topic:
                yield f"  {explanation.code:{width}}  {explanation.meaning}"
        yield ""
    yield "`truepose explain CODE` has an example and what to do."


def _explained(explanation: Explanation) -> Iterator[str]:
    from textwrap import fill

    def text(words: str) -> str:
        return fill(words, WIDTH, initial_indent="  ", subsequent_indent="  ")

    yield from (explanation.code, "", text(_sentence(explanation.meaning)), "")
    yield from ("What to do:", "", text(explanation.advice), "")
    if explanation.example is None:
        return
    yield "An example that gives it:"
    example = explanation.example
    files = ((f"in {name}", text.splitlines()) for name, text in example.all_files().items())
    for title, lines in (*example.machine_steps(), *files, *example.last_steps()):
        yield from ("", *([f"  {title}"] if title else []))
        yield from (f"    {line}".rstrip() for line in lines)


def _sentence(meaning: str) -> str:
    return f"{meaning[0].upper()}{meaning[1:]}."


def _unknown(codes: list[str], every: dict[str, Explanation]) -> Exception:
    from truepose.errors import Problem, RequestError
    from truepose.files.wording import did_you_mean

    return RequestError(
        *(
            Problem(
                "unknown-code",
                f"nothing gives the code {code}",
                found=code or "nothing",
                expected="one of those that `truepose explain` lists",
                hint=did_you_mean(code, every),
            )
            for code in codes
        )
    )
