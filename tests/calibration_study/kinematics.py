"""Where a machine is, and where its joints are: Newton's method on closures, in plain NumPy.

The closures and their rows are those of `reference_kinematics.Reference`. It solves them by MINPACK
with differences, which is slower and stops short of rounding at times; here the rows are the
derivatives to the platform's twist, and the joints' are central differences.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reference_kinematics import ANGLES, POSITION, Reference, angles_of, rotation_by_vector

Floats = NDArray[np.float64]
Placed = tuple[Floats, Floats]

CLOSED = 1e-12
"""m: what rounding leaves of closures of a metre, and some."""
STEP = 1e-6
"""m and rad, of a central difference of closures to a joint coordinate."""
MOST = 60
LONGEST = 0.2
"""m and rad: of a step, so that a start that is far off is not thrown farther."""


class NoRootError(ValueError):
    """Newton's method did not close the machine."""


def forward(machine: Reference, joints: ArrayLike, near: Placed) -> Placed:
    """Tool point (3,) and rotation (3, 3) at joints (n_drive,), near a placement.

    Raises `NoRootError`.
    """
    coordinates = np.asarray(joints, float)
    moves = [at for at, name in enumerate((*POSITION, *ANGLES)) if name in machine.dof]
    point, rotation = near
    for _ in range(MOST):
        closures = machine.closures(coordinates, point, rotation)
        if np.abs(closures).max() < CLOSED:
            return point, rotation
        step = np.zeros(6)
        rows = machine.rows(coordinates, point, rotation)[:, moves]
        step[moves] = _bounded(_solved(rows, closures))
        point, rotation = point + step[:3], rotation_by_vector(step[3:]) @ rotation
    raise NoRootError("no placement closes at these joints")


def inverse(
    machine: Reference, pose: ArrayLike, near: Placed | None = None
) -> tuple[Floats, Placed]:
    """Joints (n_drive,) of a commanded pose, and where the machine then is.

    Parasitic freedoms are searched from home, or from a placement near.

    Raises `NoRootError`, and ValueError where a strut does not reach.
    """
    names = [*machine.commanded, *machine.parasitic]
    given = np.asarray(pose, float)
    start = _components(machine, near) if near is not None else machine.home
    free = np.array([start[name] for name in machine.parasitic], float)

    def placed(parasitic: Floats) -> Placed:
        return machine.placement(names, np.concatenate([given, parasitic]))

    joints = _first_joints(machine, placed(free))
    count = len(joints)
    unknown = np.concatenate([joints, free])
    for _ in range(MOST):
        residual = machine.closures(unknown[:count], *placed(unknown[count:]))
        if np.abs(residual).max() < CLOSED:
            return unknown[:count], placed(unknown[count:])
        slopes = []
        for one in np.eye(unknown.size) * STEP:
            ahead, behind = unknown + one, unknown - one
            difference = machine.closures(ahead[:count], *placed(ahead[count:]))
            difference = difference - machine.closures(behind[:count], *placed(behind[count:]))
            slopes.append(difference / (2.0 * STEP))
        unknown = unknown + _bounded(_solved(np.array(slopes).T, residual))
    raise NoRootError("no joints close at this pose")


def _first_joints(machine: Reference, placed: Placed) -> Floats:
    """Those that close each drive's first strut, in its working mode."""
    joints = []
    for drive in machine.drives:
        roots = machine.roots(drive, *placed)
        if not roots:
            raise ValueError(f"drive {drive['name']} does not reach")
        joints.append(roots[0] if drive["working_mode"] == "-" else roots[-1])
    return np.array(joints)


def _components(machine: Reference, placed: Placed) -> dict[str, float]:
    values = (*placed[0], *angles_of(placed[1]))
    return dict(zip((*POSITION, *ANGLES), map(float, values), strict=True))


def _solved(matrix: Floats, residual: Floats) -> Floats:
    step, *_ = np.linalg.lstsq(matrix, -residual, rcond=None)
    return np.asarray(step)


def _bounded(step: Floats) -> Floats:
    return step * min(1.0, LONGEST / max(float(np.abs(step).max()), 1e-300))
