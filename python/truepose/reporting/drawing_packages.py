"""Pages and languages need the extra `report`, the studio its own: who lacks one is told so."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib import import_module
from types import ModuleType

from truepose.errors import Problem, RequestError
from truepose.language import speaking

_OF_EXTRA = {
    "report": ("the report", "jinja2 and plotly"),
    "studio": ("the studio", "jinja2, plotly, starlette, uvicorn and websockets"),
}
"""What needs an extra, and the packages in it."""


def module_that_draws(name: str, extra: str = "report") -> ModuleType:
    """A module of pages or figures, or of the studio, which needs the packages of an extra.

    Raises `RequestError` (extra-missing) without one of them.
    """
    try:
        return import_module(name)
    except ImportError as failure:
        if failure.name is None or failure.name.startswith("truepose"):
            raise
        what, packages = _OF_EXTRA[extra]
        raise RequestError(
            Problem(
                "extra-missing",
                f"{what} needs packages that are not installed",
                found=f"no {failure.name}",
                expected=packages,
                hint=f"pip install 'truepose[{extra}]'",
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
