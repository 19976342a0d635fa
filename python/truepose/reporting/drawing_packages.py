"""Pages, figures and languages need the extra `report`; who asks for them without it is told so."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib import import_module
from types import ModuleType

from truepose.errors import Problem, RequestError
from truepose.language import speaking


def module_that_draws(name: str) -> ModuleType:
    """A module of pages or figures. Raises `RequestError` (extra-missing) without plotly."""
    try:
        return import_module(name)
    except ImportError as failure:
        if failure.name is None or failure.name.startswith("truepose"):
            raise
        raise RequestError(
            Problem(
                "extra-missing",
                "the report needs packages that are not installed",
                found=f"no {failure.name}",
                expected="jinja2 and plotly",
                hint="pip install 'truepose[report]'",
            )
        ) from failure


@contextmanager
def speaking_for(code: str) -> Iterator[None]:
    """Say everything in the language of this code, within the block.

    Raises `RequestError`: unknown-language for one that there is not, extra-missing where it needs
    Babel and it is not installed.
    """
    with ExitStack() as block:
        try:
            block.enter_context(speaking(code))
        except ImportError as failure:
            raise RequestError(
                Problem(
                    "extra-missing",
                    "languages other than English need a package that is not installed",
                    found=f"no {failure.name}",
                    expected="babel",
                    hint="pip install 'truepose[report]'",
                )
            ) from failure
        yield
