"""Bring the files of `python/truepose/languages/` up to the messages that the sources say.

Run `python docs/generate_languages.py` after a change of a sentence: a message that is new is added
without a translation, one that is said no more goes. Tests refuse a language with either.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

from babel.messages.catalog import Catalog
from babel.messages.pofile import read_po, write_po
from jinja2 import Environment, nodes

PACKAGE = Path(__file__).resolve().parents[1] / "python" / "truepose"
LANGUAGES = PACKAGE / "languages"
WIDTH = 100

SAID_ELSEWHERE = {"title", "TITLE", "doc", "quantity", "word"}
"""Last names of what may be said without being a text: titles of figures and docs of sources, which
are read at their modules, and words of results, which `result_words` says."""

NAMED = re.compile(r"\{(\w+)\}")


class Message(NamedTuple):
    """What is said: a text, and its plural where it goes with a number."""

    text: str
    plural: str | None = None

    @property
    def key(self) -> str | tuple[str, str]:
        """As a catalogue has it."""
        return self.text if self.plural is None else (self.text, self.plural)

    @property
    def places(self) -> frozenset[str]:
        """Names of what differs."""
        return frozenset(NAMED.findall(self.text + (self.plural or "")))


@cache
def said() -> dict[Message, str]:
    """The messages of the package, and the file that says each first."""
    return messages(PACKAGE)


def messages(package: Path) -> dict[Message, str]:
    """Every message and the file that says it first, in the order of files and lines.

    Raises `ValueError` where something is said that is no text.
    """
    found: dict[Message, str] = {}
    for path in sorted([*package.rglob("*.py"), *package.rglob("*.jinja")]):
        text, name = path.read_text(encoding="utf-8"), path.relative_to(package).as_posix()
        every = _of_template(text) if path.suffix == ".jinja" else _of_module(text, name)
        for line, message in every:
            if message is None:
                raise ValueError(f"{name}, line {line}: what is said has to be a text")
            found.setdefault(message, name)
    return found


def _of_module(text: str, name: str) -> Iterator[tuple[int, Message | None]]:
    tree = ast.parse(text)
    yield from _of_constants(tree, name)
    if "from truepose.language import" not in text:
        return
    tables = {
        target.id: node.value
        for node in tree.body
        if isinstance(node, ast.Assign | ast.AnnAssign)
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        if isinstance(target, ast.Name)
    }
    calls = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id in ("say", "say_counted")
    ]
    for call in sorted(calls, key=lambda node: (node.lineno, node.col_offset)):
        if isinstance(call.func, ast.Name) and call.func.id == "say_counted":
            texts = [_text(argument) for argument in call.args[:2]]
            known = len(texts) == 2 and None not in texts
            yield call.lineno, Message(str(texts[0]), str(texts[1])) if known else None
            continue
        (argument, *_) = call.args
        text_said = _text(argument)
        if text_said is not None:
            yield call.lineno, Message(text_said)
        elif isinstance(argument, ast.Subscript) and isinstance(argument.value, ast.Name):
            of_table = _texts_of(tables.get(argument.value.id))
            yield from ((call.lineno, Message(each)) for each in of_table)
            if not of_table:
                yield call.lineno, None
        elif _last_name(argument) not in SAID_ELSEWHERE:
            yield call.lineno, None


def _of_constants(tree: ast.Module, name: str) -> Iterator[tuple[int, Message]]:
    """Titles of figures and docs of sources."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            (target, *_) = node.targets if isinstance(node, ast.Assign) else [node.target]
            text = _text(node.value)
            wanted = {"reporting": "TITLE", "sources": "doc"}.get(name.split("/")[0])
            if text is not None and isinstance(target, ast.Name) and target.id == wanted:
                yield node.lineno, Message(text)


def _of_template(text: str) -> Iterator[tuple[int, Message | None]]:
    for call in Environment(autoescape=True).parse(text).find_all(nodes.Call):
        if not (isinstance(call.node, nodes.Name) and call.node.name in ("say", "say_counted")):
            continue
        plain = [each.value for each in call.args if isinstance(each, nodes.Const)]
        wanted = 1 if call.node.name == "say" else 2
        if len(plain) >= wanted:
            yield call.lineno, Message(*plain[:wanted])
        elif not (isinstance(call.args[0], nodes.Getattr) and call.args[0].attr in SAID_ELSEWHERE):
            yield call.lineno, None


def _text(node: ast.expr) -> str | None:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    return None


def _texts_of(node: ast.expr | None) -> list[str]:
    """Texts of a table of the module; none where it is none, or has anything else."""
    if not isinstance(node, ast.Dict):
        return []
    texts = [_text(value) for value in node.values]
    return [text for text in texts if text is not None] if None not in texts else []


def _last_name(node: ast.expr) -> str:
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def catalogue(code: str) -> Catalog:
    """A language as its file has it."""
    with (LANGUAGES / f"{code}.po").open("rb") as file:
        return read_po(file, locale=code)


def text_of(code: str) -> str:
    """The file of a language, brought up to the messages."""
    had = catalogue(code)
    now = Catalog(locale=code, header_comment=had.header_comment, fuzzy=False)
    for message, path in said().items():
        known = had.get(message.key)
        now.add(message.key, None if known is None else known.string, locations=[(path, None)])
    written = BytesIO()
    write_po(written, now, width=WIDTH, omit_header=True)
    # A header of its own: Babel's has the hour at which it was written.
    head = (
        f'{had.header_comment}\nmsgid ""\nmsgstr ""\n"Language: {code}\\n"\n'
        '"MIME-Version: 1.0\\n"\n"Content-Type: text/plain; charset=utf-8\\n"\n'
        f'"Content-Transfer-Encoding: 8bit\\n"\n"Plural-Forms: {had.plural_forms}\\n"\n\n'
    )
    return head + written.getvalue().decode("utf-8").lstrip("\n")


def main() -> None:
    """Write every language anew, and say what is to be translated."""
    for path in sorted(LANGUAGES.glob("*.po")):
        path.write_text(text_of(path.stem), encoding="utf-8")
        print(f"{path.name}: {len(untranslated(path.stem))} to be translated")


def untranslated(code: str) -> list[str]:
    """Messages that a language does not have."""
    had = catalogue(code)
    lacking = []
    for message in said():
        known = had.get(message.key)
        strings = () if known is None else known.string
        strings = (strings,) if isinstance(strings, str) else strings
        if not strings or not all(strings):
            lacking.append(message.text)
    return lacking


if __name__ == "__main__":
    main()
