"""What the arguments of a public function are, read off its own annotations.

`@checked` stands on every function of `truepose`, so that the name of a file in place of a machine,
or a number in place of a list of names, is answered with a sentence and not from deep inside. What
a value has to be besides its kind (finite, positive, one of some words) the function says itself,
and of some arguments (`OWN`) all of it.
"""

from __future__ import annotations

import functools
import inspect
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from typing import Any, ParamSpec, TypeVar

import numpy as np

from truepose.arrays import real_numbers
from truepose.errors import ArgumentError, Problem, wrong_argument
from truepose.machine import Condition, Machine

P = ParamSpec("P")
R = TypeVar("R")


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """The function, which refuses arguments that are of another kind than it states.

    It raises `ArgumentError` (bad-argument) with all of them at once. An annotation that is not in
    `KINDS` is an error where the function is defined.
    """
    signature = inspect.signature(function)
    kinds = {
        name: OWN.get(name) or KINDS[str(each.annotation)]
        for name, each in signature.parameters.items()
    }

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        given = _bound(signature, function.__name__, args, kwargs)
        problems: list[Problem] = []
        for name, value in given.items():
            fits, expected = kinds[name]
            if not fits(value):
                problems.append(wrong_argument(name, value, expected))
        if problems:
            raise ArgumentError(*problems)
        return function(*args, **kwargs)

    return call


def _bound(
    signature: inspect.Signature, name: str, args: tuple[Any, ...], kwargs: dict[str, Any]
) -> Mapping[str, Any]:
    """The arguments by name. Raises `ArgumentError` where the function takes no such ones."""
    try:
        return signature.bind(*args, **kwargs).arguments
    except TypeError as error:
        problem = Problem("bad-argument", f"{name}: {error}", expected=f"{name}{signature}")
        raise ArgumentError(problem) from None


def _numbers(value: object) -> bool:
    try:
        real_numbers("", value)  # type: ignore[arg-type]
    except ArgumentError:
        return False
    return True


def _whole(value: object) -> bool:
    if isinstance(value, bool | np.bool_):
        return False
    try:
        operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        return False
    return True


def _number(value: object) -> bool:
    if isinstance(value, float | np.floating):
        return True
    if not _whole(value):
        return False
    try:
        float(value)  # type: ignore[arg-type]
    except OverflowError:
        return False
    return True


def _names(value: object) -> bool:
    """Some strings, each of its own."""
    if isinstance(value, str | bytes | np.ndarray) or not isinstance(value, Iterable):
        return False
    # What can be gone through once only is looked at as it is used.
    return not isinstance(value, Sequence) or all(isinstance(each, str) for each in value)


def _path(value: object) -> bool:
    return isinstance(value, str | PathLike)


def _settings(value: object) -> bool:
    if isinstance(value, Mapping):
        return all(isinstance(each, str) for pair in value.items() for each in pair)
    return isinstance(value, Sequence) and _names(value)


def _coordinates(value: object) -> bool:
    """Numbers by the names of axes."""
    return isinstance(value, Mapping) and all(
        isinstance(axis, str) and _number(number) for axis, number in value.items()
    )


def _systems(value: object) -> bool:
    return isinstance(value, Mapping) and all(
        isinstance(name, str) and _coordinates(each) for name, each in value.items()
    )


def _intervals(value: object) -> bool:
    return isinstance(value, Mapping) and all(
        isinstance(name, str) and _numbers(each) for name, each in value.items()
    )


def _anything(_: object) -> bool:
    return True


Fits = Callable[[object], bool]
Kind = tuple[Fits, str]


def _is(*types: type) -> Fits:
    return lambda value: isinstance(value, types)


def _or_none(kind: Kind) -> Kind:
    fits, expected = kind
    return lambda value: value is None or fits(value), f"{expected}, or None"


def _one_value(value: object) -> bool:
    return value is None or isinstance(value, str | bytes | bool | np.generic) or _number(value)


_LATER: Kind = (_anything, "")
"""What the function itself tells apart: a machine or a function, an instrument or some."""

_MACHINE: Kind = (_is(Machine), "a machine, as truepose.load returns it")
_CONDITION: Kind = (_is(Condition), "a truepose.Condition, such as machine.condition.replace(...)")
_NUMBERS: Kind = (_numbers, "an array of real numbers")
_FLAG: Kind = (_is(bool, np.bool_), "True or False")
_WHOLE: Kind = (_whole, "a whole number")
_NUMBER: Kind = (_number, "a number")
_TEXT: Kind = (_is(str), "text")
_NAMES: Kind = (_names, 'names, such as ["strut.*.length"]')
_PATH: Kind = (_path, "the name of a file")
_SETTINGS: Kind = (_settings, 'settings, such as ["condition.temperature=30"], or a dict of them')
_POSITIONS: Kind = (_coordinates, 'coordinates by axis, such as {"x": 0.1}')
_SYSTEMS: Kind = (_systems, 'coordinates by axis and system, such as {"G54": {"x": 0.1}}')
_INTERVALS: Kind = (_intervals, 'an interval by freedom, such as {"x": [0.1, 0.2]}')
_MAPPING: Kind = (_is(Mapping), "inputs by name")
_CALLABLE: Kind = (callable, "a function of what is done and of how much there is")

KINDS: dict[str, Kind] = {
    "Machine": _MACHINE,
    "Machine | Callable[..., Any]": _LATER,
    "Machine | str | Path": (
        lambda value: isinstance(value, Machine) or _path(value),
        "the name of a machine file, or a machine as truepose.load returns it",
    ),
    "Any": _LATER,
    "Correlation": _LATER,
    "Measurements | str | Path": (
        lambda value: _path(value) or type(value).__name__ == "Measurements",
        "the name of a file of measurements, or what is read from it",
    ),
    "Measurements | str | Path | None": (
        lambda value: value is None or _path(value) or type(value).__name__ == "Measurements",
        "the name of a file of measurements, or what is read from it, or None",
    ),
    "Instrument | Iterable[Instrument]": _LATER,
    "ArrayLike": _NUMBERS,
    "ArrayLike | None": _or_none(_NUMBERS),
    "Condition | None": _or_none(_CONDITION),
    "Progress | None": _or_none(_CALLABLE),
    "Mapping[str, Input] | None": _or_none(_MAPPING),
    "xr.Dataset | None": (
        lambda value: value is None or type(value).__name__ == "Dataset",
        "an xarray.Dataset, as a function of truepose returns it, or None",
    ),
    "Mapping[str, Sequence[float]] | None": _or_none(_INTERVALS),
    "Mapping[str, str] | Sequence[str]": _SETTINGS,
    "Positions": _POSITIONS,
    "Positions | None": _or_none(_POSITIONS),
    "Mapping[str, Positions] | None": _or_none(_SYSTEMS),
    "Sequence[str]": _NAMES,
    "Iterable[str]": _NAMES,
    "str | Path": _PATH,
    "str | Path | None": _or_none(_PATH),
    "str | PathLike[str]": _PATH,
    "str | PathLike[str] | None": _or_none(_PATH),
    "str": _TEXT,
    "str | None": _or_none(_TEXT),
    "Criterion": _TEXT,
    "Literal['random', 'sobol']": _TEXT,
    "Rule": _TEXT,
    "bool": _FLAG,
    "bool | None": _or_none(_FLAG),
    "int": _WHOLE,
    "int | None": _or_none(_WHOLE),
    "float": _NUMBER,
    "float | None": _or_none(_NUMBER),
}
"""What an annotation means: what fits, and how that is said."""

_VALUE: Kind = (_one_value, "one value")

OWN: dict[str, Kind] = {
    "poses": _LATER,
    "times": _LATER,
    "region": _LATER,
    "states": (lambda value: isinstance(value, str) or _names(value), "names of states"),
    "gap": _VALUE,
    "truncate": _VALUE,
    "samples": _VALUE,
    "seed": _VALUE,
    "probability": _VALUE,
    "digits": _VALUE,
    "budget": _VALUE,
}
"""Arguments that have codes of their own (bad-poses, ...) wherever they stand, once one value."""
