"""The one form in which every controller is served: a machine in, text files and a statement out.

A controller's adapter is one folder. It knows its controller's language and, where that has only
a small model of its own, states the model as a machine; fitting, evaluating and judging are done
once for all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Protocol

from truepose.errors import Problem, ReadingError, RequestError
from truepose.files.units import UnitSystem
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Machine
from truepose.representation import Facts, Represented


@dataclass(frozen=True)
class Option:
    """One thing that may be asked of an adapter.

    `dimension` names what a quantity measures ("length", "ratio" for a plain number, ...), SI
    once read; None: the value is text. `choices` are the words of a text that is one of them.
    """

    default: float | str
    doc: str
    dimension: str | None = "ratio"
    choices: tuple[str, ...] = ()


@dataclass(frozen=True, repr=False)
class Export(Represented):
    """What an adapter gives.

    `files`: name -> whole text, to be written into one folder. `statement`: what the user must
    know, one line each: what is left over in µm and where, what the export leaves out.
    """

    files: Mapping[str, str]
    statement: tuple[str, ...] = field(default=())

    def _facts(self) -> Facts:
        yield "files", ", ".join(self.files)
        yield "characters", sum(map(len, self.files.values()))
        yield "statement", " ".join(self.statement)


class Controller(Protocol):
    """A controller's adapter."""

    name: ClassVar[str]
    doc: ClassVar[str]
    options: ClassVar[Mapping[str, Option]]

    @classmethod
    def export(cls, machine: Machine, options: Mapping[str, float | str]) -> Export:
        """What the controller is to be given for `machine` in its condition.

        `options` has a value, SI, for every one declared. Raises `RequestError`
        (controller-cannot) where the controller has no way to take the machine.
        """
        ...


def options_of(
    controller: type[Controller], machine: Machine, given: Mapping[str, str] | Sequence[str] = ()
) -> dict[str, float | str]:
    """Every option of a controller: what is `given` (`["clamp=1 mm"]`), else its default.

    Bare numbers are in the units of the machine file. Raises `RequestError` (bad-option), all
    problems at once.
    """
    units = UnitSystem(machine.file_units)
    listed = [given] if isinstance(given, str) else given
    pairs = listed.items() if isinstance(listed, Mapping) else map(_pair, listed)
    values: dict[str, float | str] = {key: o.default for key, o in controller.options.items()}
    problems = []
    read: set[str] = set()
    for key, text in pairs:
        option = controller.options.get(key)
        if option is None:
            problems.append(_unknown(controller, key))
            continue
        if key in read:
            problems.append(
                Problem(
                    "bad-option",
                    f"option {key} of {controller.name} is given twice",
                    found=repr(text),
                    expected=f"{key} once: {option.doc}",
                )
            )
            continue
        read.add(key)
        try:
            values[key] = _read(option, units, text)
        except ReadingError as failure:
            subject = f"option {key} of {controller.name}"
            problems.append(unread("bad-option", subject, failure, text, option.doc))
    if problems:
        raise RequestError(*problems)
    return values


def unread(code: str, subject: str, failure: ReadingError, text: str, doc: str) -> Problem:
    """The problem of a value that could not be read: of `subject`, given as `text`."""
    return Problem(
        code,
        f"{subject}: {failure.message}",
        found=failure.found or repr(text),
        expected=failure.expected or doc,
        hint=failure.hint,
    )


def _pair(text: str) -> tuple[str, str]:
    key, _, value = text.partition("=")
    return key.strip(), value.strip()


def _read(option: Option, units: UnitSystem, text: str) -> float | str:
    if option.dimension is not None:
        return units.read(text, option.dimension)
    if option.choices and text not in option.choices:
        raise ReadingError(
            "bad-option", "no such choice", found=repr(text), expected=one_of(option.choices)
        )
    return text


def _unknown(controller: type[Controller], key: str) -> Problem:
    return Problem(
        "bad-option",
        f"{controller.name} has no option {key!r}",
        found=repr(key),
        expected=one_of(sorted(controller.options)) if controller.options else "no option",
        hint=did_you_mean(key, controller.options),
    )


def geometry_loaded(machine: Machine) -> tuple[str, ...]:
    """What changes once a controller has its kinematics from a calibrated file; else nothing."""
    if machine.calibration is None:
        return ()
    line = (
        "once this is loaded the controller holds the calibrated geometry: correct programs for it "
    )
    if machine.controller_holds == "calibrated":
        return (line + f'with {machine.file}, which says so (holds = "calibrated")',)
    if machine.controller_holds is None:
        return (line + 'with a file that says so, [controller] holds = "calibrated"',)
    return (
        line
        + f"no more with {machine.file}, but with the file that truepose calibrate writes with "
        "--controller-holds calibrated",
    )


def geometry_compensated(machine: Machine) -> tuple[str, ...]:
    """What kinematics with a compensation of their own make of a calibrated file; else nothing."""
    if machine.calibration is None:
        return ()
    return (
        "with its compensated joints the controller holds the calibrated geometry: programs that "
        "are corrected as well are corrected twice",
    )


def unsupported_machine(
    controller: str, machine: Machine, found: str, expected: str, hint: str
) -> RequestError:
    """The refusal of a machine that the controller has no way to take."""
    return RequestError(
        Problem(
            "controller-cannot",
            f"{controller} cannot take this machine",
            file=machine.file,
            found=found,
            expected=expected,
            hint=hint,
        )
    )


__all__ = [
    "Controller",
    "Export",
    "Option",
    "geometry_compensated",
    "geometry_loaded",
    "options_of",
    "unread",
    "unsupported_machine",
]
