"""Write docs/errors.md from the explanations that `truepose explain` shows.

Run `python docs/generate_errors.py` after a change of a code or its explanation; a test refuses a
page that is not what this writes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from truepose.explanations import TOPICS, Example, Explanation, Step, explanations, readings

HEAD = """# Every code, and what to do

<!-- Written by `python docs/generate_errors.py`. Do not edit. -->

A code stands in brackets behind `error`, `warning` and `looks odd`, in results where a pose is
left out, and in the answer of a calibration. `truepose explain CODE` shows what stands here at the
prompt. Every example has been run and gives its code; try it in an empty folder.
"""


def page() -> str:
    """The text of docs/errors.md."""
    every = explanations().values()
    parts = [HEAD]
    for topic, title in TOPICS.items():
        of_topic = [explanation for explanation in every if explanation.topic == topic]
        parts.append(f"## {title}\n")
        parts += [
            f"[{explanation.code}](#{explanation.code}) \N{MIDDLE DOT}" for explanation in of_topic
        ]
        parts[-1] = parts[-1].removesuffix(" \N{MIDDLE DOT}") + "\n"
        parts += ["\n".join(_section(explanation)) for explanation in of_topic]
    examples = [explanation.example for explanation in every]
    kinds = {e.machine: None for e in examples if e is not None and e.measured is not None}
    parts.append("\n".join(_readings(kinds)))
    return "\n".join(parts).rstrip("\n") + "\n"


def _section(explanation: Explanation) -> Iterator[str]:
    meaning = explanation.meaning
    yield from (f"### {explanation.code}", "", f"{meaning[0].upper()}{meaning[1:]}.", "")
    yield from (explanation.advice, "")
    if explanation.example is not None:
        yield from _example(explanation.example)


def _example(example: Example) -> Iterator[str]:
    for step in example.machine_steps():
        yield from _step(step)
    if example.measured is not None:
        name = example.machine
        yield from (f"measured.csv: the [readings of {name}](#readings-of-{name})", "")
        for old, new in example.measured:
            yield from _step(("in them, instead of", tuple(old.splitlines())))
            yield from _step(("write", tuple(new.splitlines())))
    for name, text in example.files.items():
        yield from _step((f"in {name}", tuple(text.splitlines())))
    for step in example.last_steps():
        yield from _step(step)


def _step(step: Step) -> Iterator[str]:
    title, lines = step
    if title:
        yield from (f"{title[0].upper()}{title[1:]}:", "")
    language = "python" if title == "in Python" else "text" if title else "sh"
    yield from (f"```{language}", *lines, "```", "")


def _readings(kinds: Iterable[str]) -> Iterator[str]:
    yield from ("## Readings of the examples", "")
    for kind in kinds:
        yield from (f"### Readings of {kind}", "", "```text", *readings(kind).splitlines(), "```")
        yield ""


if __name__ == "__main__":
    (Path(__file__).parent / "errors.md").write_text(page(), encoding="utf-8")
    print("docs/errors.md")
