"""An adapter by its name, and what it gives for a machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any

from truepose.controllers._export import Controller, Export, options_of
from truepose.controllers._registry import REGISTRY
from truepose.errors import Problem, RequestError
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Machine
from truepose.runs.arguments import checked


def controller(name: str) -> type[Controller]:
    """The adapter of a name. Raises `RequestError` (unknown-controller)."""
    adapter: type[Controller] = by_name(name, REGISTRY, "adapter")
    return adapter


def by_name(name: str, registry: Mapping[str, str], what: str) -> Any:
    """What a registry has under a name. Raises `RequestError` (unknown-controller)."""
    if name not in registry:
        raise RequestError(
            Problem(
                "unknown-controller",
                f"there is no {what} for {name!r}",
                found=repr(name),
                expected=one_of(registry),
                hint=did_you_mean(name, registry),
            )
        )
    module, _, attribute = registry[name].partition(":")
    return getattr(import_module(module), attribute)


@checked
def export(machine: Machine, name: str, options: Mapping[str, str] | Sequence[str] = ()) -> Export:
    """What the controller `name` is to be given for `machine` in the file's condition.

    `options`: texts as on the command line, `{"clamp": "1 mm"}`. Raises `RequestError`:
    unknown-controller, bad-option, controller-cannot, and what the adapter says itself.
    """
    adapter = controller(name)
    return adapter.export(machine, options_of(adapter, machine, options))
