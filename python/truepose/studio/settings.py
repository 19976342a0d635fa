"""The state of a studio: edits of the file, the pose and the condition shown, and what was before.

All of it is immutable, and JSON can hold it. An edit is a key and a value as of `--set KEY=VALUE`;
they stand in the order in which they act, each key once, the one edited last at the end.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from truepose.machine import Condition

MOST_UNDONE = 200
"""Steps that can be undone."""

AXES = 6
"""Components of a wrench."""

Edit = tuple[str, str]
Edits = tuple[Edit, ...]


@dataclass(frozen=True)
class ShownCondition:
    """A condition in place of the file's: temperatures of parts, K; wrench (6,), N and N m."""

    temperature: tuple[tuple[str, float], ...]
    wrench: tuple[float, ...]

    def of(self, condition: Condition) -> Condition:
        """The file's condition with these values. Raises `RequestError` (bad-condition)."""
        return condition.replace(
            temperature=dict(self.temperature), force=self.wrench[:3], moment=self.wrench[3:]
        )

    def to_json(self) -> dict[str, Any]:
        """As a message has it."""
        return {"temperature": dict(self.temperature), "wrench": list(self.wrench)}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> ShownCondition:
        """Of what a message has. Raises `ValueError` for what is none."""
        wrench = _numbers(value["wrench"])
        if len(wrench) != AXES:
            raise ValueError("a wrench has six components")
        names = [str(part) for part in value["temperature"]]
        kelvin = _numbers(value["temperature"].values())
        return cls(tuple(zip(names, kelvin, strict=True)), wrench)


@dataclass(frozen=True)
class Settings:
    """What is asked: edits in their order; pose (n_commanded,), SI, and condition.

    `pose` None: the usable one nearest the middle of the workspace. `condition` None: the file's.
    """

    edits: Edits = ()
    pose: tuple[float, ...] | None = None
    condition: ShownCondition | None = None

    def edited(self, changes: Iterable[tuple[str, str | None]]) -> Settings:
        """With other edits, each key's last one alone; a value of None takes its key's back."""
        edits = dict(self.edits)
        for key, value in changes:
            edits.pop(key, None)
            if value is not None:
                edits[key] = value
        return replace(self, edits=tuple(edits.items()))

    def to_json(self) -> dict[str, Any]:
        """As the state file and messages have it."""
        return {
            "edits": [list(edit) for edit in self.edits],
            "pose": None if self.pose is None else list(self.pose),
            "condition": None if self.condition is None else self.condition.to_json(),
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Settings:
        """Of what a state file has. Raises `ValueError`, `KeyError` or `TypeError` for others."""
        pose, condition = value["pose"], value["condition"]
        return cls(
            edits_of(value["edits"]),
            None if pose is None else _numbers(pose),
            None if condition is None else ShownCondition.from_json(condition),
        )


@dataclass(frozen=True)
class History:
    """The settings now, and the edits that were before and that were undone, the nearest last."""

    now: Settings = field(default_factory=Settings)
    past: tuple[Edits, ...] = ()
    future: tuple[Edits, ...] = ()

    def changed(self, settings: Settings, *, joins: bool = False) -> History:
        """With other settings. Other edits are a step; what is shown is none.

        `joins`: they belong to the step before, as those of a slider that is dragged on.
        """
        if settings.edits == self.now.edits or (joins and self.past and not self.future):
            return replace(self, now=settings)
        past = (*self.past, self.now.edits)[-MOST_UNDONE:]
        return History(settings, past, ())

    def undone(self) -> History:
        """One step back, or the same where there is none."""
        if not self.past:
            return self
        *past, edits = self.past
        return History(replace(self.now, edits=edits), tuple(past), (*self.future, self.now.edits))

    def redone(self) -> History:
        """One step forward again, or the same where there is none."""
        if not self.future:
            return self
        *future, edits = self.future
        return History(replace(self.now, edits=edits), (*self.past, self.now.edits), tuple(future))

    def reset(self) -> History:
        """Without any edit, which is a step too."""
        return self.changed(replace(self.now, edits=()))

    def to_json(self) -> dict[str, Any]:
        """As the state file has it."""
        return {
            **self.now.to_json(),
            "past": [[list(edit) for edit in edits] for edits in self.past],
            "future": [[list(edit) for edit in edits] for edits in self.future],
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> History:
        """Of what a state file has. Raises as `Settings.from_json` does."""
        return cls(
            Settings.from_json(value),
            tuple(edits_of(edits) for edits in value["past"])[-MOST_UNDONE:],
            tuple(edits_of(edits) for edits in value["future"])[-MOST_UNDONE:],
        )


def edits_of(rows: Iterable[Any]) -> Edits:
    """Edits of pairs of texts. Raises `ValueError` or `TypeError` for what are none."""
    edits = []
    for key, value in rows:
        if not (isinstance(key, str) and isinstance(value, str)):
            raise TypeError("an edit is two texts")
        edits.append((key, value))
    return tuple(edits)


def _numbers(values: Iterable[Any]) -> tuple[float, ...]:
    """Finite numbers. Raises `ValueError` or `TypeError`."""
    numbers = tuple(float(value) for value in values)
    if not all(map(math.isfinite, numbers)):
        raise ValueError("a number is not finite")
    return numbers


__all__ = ["Edit", "Edits", "History", "Settings", "ShownCondition", "edits_of"]
