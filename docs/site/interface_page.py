"""The page of Python's interface: every public name with its signature and docstring."""

from __future__ import annotations

import inspect
import re

import truepose as tp

HEAD = """# Python's interface

Written from the docstrings when the site is built. Everything is in SI: metres, radians, kelvin,
newtons. [From Python](how_to/python.md) shows it in use; [results](results.md) has the variables of
every Dataset.
"""


def shown(docstring: str) -> str:
    """A docstring as Markdown: links of docs/ lead there."""
    text = inspect.cleandoc(docstring)
    return re.sub(r"\bdocs/([\w/]+\.md)", r"[\1](\1)", text)


def signature(name: str, value: object) -> str:
    """How a public name is called."""
    try:
        return f"truepose.{name}{inspect.signature(value)}"  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return f"truepose.{name}"


def members(name: str, value: type) -> list[str]:
    """Sections of the public methods and properties that a class documents itself."""
    parts = []
    for attribute, member in sorted(vars(value).items()):
        function = member.fget if isinstance(member, property) else inspect.unwrap(member)
        function = getattr(function, "__func__", function)
        if attribute.startswith("_") or not callable(function) or not function.__doc__:
            continue
        call = "" if isinstance(member, property) else str(inspect.signature(function))
        parts.append(f"### {name}.{attribute}\n\n```python\n{attribute}{call}\n```\n")
        parts.append(f"{shown(function.__doc__)}\n")
    return parts


def page() -> str:
    """The text of the page."""
    parts = [HEAD]
    for name in sorted(set(tp.__all__) - {"__version__", "errors"}, key=str.lower):
        value = getattr(tp, name)
        parts.append(f"## {name}\n\n```python\n{signature(name, value)}\n```\n")
        parts.append(f"{shown(value.__doc__ or '')}\n")
        if isinstance(value, type):
            parts += members(name, value)
    return "\n".join(parts)
