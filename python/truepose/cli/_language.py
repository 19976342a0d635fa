"""The language in which a command speaks."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from truepose.errors import Problem, RequestError
from truepose.language import speaking


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


__all__ = ["speaking_for"]
