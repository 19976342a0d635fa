"""How far the tool is off where it was asked for, in position and in orientation."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats
from truepose.compensation.commands import ActualMachine, PoseDeviations
from truepose.runs.poses import OK


class Measure:
    """Sizes of errors on the freedoms that a program commands.

    What the platform does besides, nobody can ask it not to do.
    """

    def __init__(self, actual: ActualMachine) -> None:
        machine = actual.machine
        self.actual = actual
        pairs = list(zip(actual.components, machine.commanded, strict=True))
        self._linear = [index for index, name in pairs if name in "xyz"]
        self._angular = [index for index, name in pairs if name not in "xyz"]
        self.has_position = bool(self._linear)
        self.has_orientation = bool(self._angular)

    def sizes(self, errors: Floats) -> tuple[Floats, Floats]:
        """(n,) m and (n,) rad of errors (n, n_component)."""
        return _norm(errors, self._linear), _norm(errors, self._angular)

    def at_joints(self, known: PoseDeviations, joints: Floats) -> tuple[Floats, Floats]:
        """The same where `joints` (n, n_joint) take the tool; infinite if they take it nowhere."""
        errors, status = self.actual.error(known, joints)
        position, orientation = self.sizes(errors)
        nowhere = status != OK
        if nowhere.any():
            position[nowhere] = np.inf
            orientation[nowhere] = np.inf
        return position, orientation

    def at_commands(self, known: PoseDeviations, commands: Floats) -> tuple[Floats, Floats]:
        """The same for commands (n, n_commanded); infinite where they must not be commanded."""
        joints, status = self.actual.machine.kernel.inverse(commands, status=True)
        position, orientation = self.at_joints(known, joints)
        refused = status != OK
        if refused.any():
            position[refused] = np.inf
            orientation[refused] = np.inf
        return position, orientation

    def combined(self, sizes: tuple[Floats, Floats]) -> Floats:
        """(n,) m: the larger of a position and an orientation times the characteristic length."""
        position, orientation = sizes
        if not self.has_orientation:
            return position
        length = self.actual.machine.characteristic_length
        return np.maximum(position, length * orientation)


def _norm(errors: Floats, columns: list[int]) -> Floats:
    if not columns:
        return np.zeros(len(errors))
    total = np.square(errors[:, columns[0]])
    for column in columns[1:]:
        total += np.square(errors[:, column])
    return np.asarray(np.sqrt(total))


__all__ = ["Measure"]
