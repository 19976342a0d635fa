"""The machine of a combination of options: the file as it was read, with the options set in it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from truepose.design.space import Combination, DesignSpace
from truepose.errors import MachineFileError, Problem, RequestError
from truepose.machine import Machine
from truepose.machine.costs import Costs, DesignChoice, DesignOption
from truepose.machine.loader import load_text
from truepose.sources import REGISTRY


def machine_of(machine: Machine, space: DesignSpace, combination: Combination) -> Machine:
    """The machine with a combination of options set; the machine itself where nothing is chosen.

    Raises `RequestError` (option-not-set) where the options do not go together.
    """
    if not space.slots:
        return machine
    first = space.slots[0].choice
    option = first.options[combination[0]]
    changed = _loaded(machine, space, space.option_settings(combination), first, option)
    # What is asked is not the options' to say, and may have been changed since the file was read.
    return dataclasses.replace(changed, accuracy=machine.accuracy)


def require_options(machine: Machine, space: DesignSpace) -> None:
    """Set every option by itself.

    Raises `RequestError` (option-not-set) with all that cannot be.
    """
    problems: list[Problem] = []
    for slot in space.slots:
        for number, option in enumerate(slot.choice.options):
            try:
                _loaded(machine, space, slot.settings(number), slot.choice, option)
            except RequestError as error:
                problems += error.problems
    if problems:
        # The parts of a choice that is not tied say the same of the same option.
        told = {(problem.path, problem.message): problem for problem in reversed(problems)}
        raise RequestError(*reversed(told.values()))


def _loaded(
    machine: Machine,
    space: DesignSpace,
    settings: Sequence[str],
    choice: DesignChoice,
    option: DesignOption,
) -> Machine:
    costs = space.costs
    every = dict(machine.settings)
    every |= dict(setting.split("=", 1) for setting in settings)
    try:
        changed = load_text(costs.path(machine.file), costs.text, settings=every, registry=REGISTRY)
    except (MachineFileError, RequestError) as error:
        first = error.problems[0]
        raise _refused(machine, choice, option, first.message, first.found, first.hint) from None
    if not _same(costs, changed.costs) or changed.commanded != machine.commanded:
        raise _refused(
            machine,
            choice,
            option,
            "it changes which tolerances are chosen, or what they cost",
            ", ".join(settings),
            "give sizes that an option changes bands instead of grades",
        )
    return changed


def _same(one: Costs, other: Costs | None) -> bool:
    return other is not None and one.tolerances == other.tolerances


def _refused(
    machine: Machine,
    choice: DesignChoice,
    option: DesignOption,
    why: str,
    found: str | None,
    hint: str | None,
) -> RequestError:
    return RequestError(
        Problem(
            "option-not-set",
            f"the option {option.name!r} of {choice.name!r} cannot be set: {why}",
            machine.file,
            option.line,
            option.path,
            found=found,
            expected="keys that these parts have, and values that they take",
            hint=hint,
        )
    )


__all__ = ["machine_of", "require_options"]
