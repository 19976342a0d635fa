"""How an object shows itself at a prompt, in a line of text, and in a notebook, as a small table.

Both are made of the same facts, a label and a value each. Names come from files that somebody else
wrote: in HTML everything is escaped. The table has no colours, so that it suits any theme.
"""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass

import numpy as np

MOST = 2000
"""Characters of a representation at a prompt, and of one value in a notebook."""

MOST_OF_VALUE = 300
"""Characters of one value at a prompt."""

_SCALAR = (str, int, float, np.integer, type(None))

_FEW = 8
"""Values of a sequence that are shown; of more, how many they are."""

Facts = Iterable[tuple[str, object]]
"""What is shown: a label and its value each."""


class Represented:
    """A base of classes whose values are too long to be shown whole.

    A dataclass needs `repr=False`, or it makes a representation of its own.
    """

    def _facts(self) -> Facts:
        """What is shown of this object; of a dataclass by default its fields."""
        own: object = self
        assert is_dataclass(own)
        return [(field.name, getattr(own, field.name)) for field in fields(own) if field.repr]

    def __repr__(self) -> str:
        told = ", ".join(f"{label}: {shown(value)}" for label, value in self._facts())
        return clipped(f"<{type(self).__name__} {told}", MOST - 1) + ">"

    def _repr_html_(self) -> str:
        return facts_html(type(self).__name__, self._facts())


def attribute_text(text: str) -> str:
    """A text as HTML has it between double quotes, as short as that can be."""
    return text.replace("&", "&amp;").replace('"', "&quot;")


LEFT = "text-align: left"
"""How words stand in a cell."""


def facts_html(caption: str, facts: Facts) -> str:
    """Facts as a table, a row each."""
    rows = "".join(
        f'<tr><th scope="row" style="{LEFT}">{html.escape(label)}</th>'
        f'<td style="{LEFT}">{html.escape(shown(value, MOST))}</td></tr>'
        for label, value in facts
    )
    return f"<table><caption>{html.escape(caption)}</caption><tbody>{rows}</tbody></table>"


def shown(value: object, most: int = MOST_OF_VALUE) -> str:
    """A value in at most so many characters: itself, or what and how many it is."""
    if isinstance(value, str):
        text = " ".join(value.split())
    elif isinstance(value, bool | np.bool_):
        text = "yes" if value else "no"
    elif value is None:
        text = "none"
    elif isinstance(value, float):
        text = f"{value:.6g}"
    elif isinstance(value, int | np.integer):
        text = str(value)
    elif isinstance(value, np.ndarray):
        text = f"array {value.shape}"
    elif isinstance(value, Mapping):
        text = _few(list(value))
    elif isinstance(value, Sequence):
        text = _few(value)
    else:
        name = getattr(value, "name", None)
        text = name if isinstance(name, str) else type(value).__name__
    return clipped(text, most)


def _few(values: Sequence[object]) -> str:
    if not values:
        return "none"
    named = all(isinstance(value, _SCALAR) or hasattr(value, "name") for value in values)
    return " ".join(map(shown, values)) if named and len(values) <= _FEW else str(len(values))


def clipped(text: str, most: int) -> str:
    """The text, or its beginning with "..." where it is longer than `most` characters."""
    return text if len(text) <= most else text[: most - 3] + "..."


__all__ = ["LEFT", "Facts", "Represented", "attribute_text", "clipped", "facts_html", "shown"]
