"""An adapter by its name, and what it gives for a machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module

from truepose.controllers._export import Controller, Export, options_of
from truepose.controllers._registry import REGISTRY
from truepose.errors import Problem, RequestError
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Machine
from truepose.runs.arguments import checked


def controller(name: str) -> type[Controller]:
    """The adapter of a name. Raises `RequestError` (unknown-controller)."""
    if name not in REGISTRY:
        raise RequestError(
            Problem(
                "unknown-controller",
                f"there is no adapter for {name!r}",
                found=repr(name),
                expected=one_of(REGISTRY),
                hint=did_you_mean(name, REGISTRY),
            )
        )
    module, _, attribute = REGISTRY[name].partition(":")
    adapter: type[Controller] = getattr(import_module(module), attribute)
    return adapter


@checked
def export(machine: Machine, name: str, options: Mapping[str, str] | Sequence[str] = ()) -> Export:
    """What the controller `name` is to be given for `machine` in the file's condition.

    `options`: texts as on the command line, `{"clamp": "1 mm"}`. Raises `RequestError`:
    unknown-controller, bad-option, controller-cannot, and what the adapter says itself.
    """
    adapter = controller(name)
    return adapter.export(machine, options_of(adapter, machine, options))
