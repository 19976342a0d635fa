"""Modules that draw need the extra `report`; who asks for one without it is told so."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from truepose.errors import Problem, RequestError


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
