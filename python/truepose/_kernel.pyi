"""The compiled kernel: closures, kinematics, sensitivities and statics. SI and radians throughout.

Arrays in may be of any real dtype and layout, arrays out are float64 and C-contiguous. Poses are
(..., n_commanded), or (..., n_dof) where all freedoms are meant; R = Rz(c) Ry(b) Rx(a). A placement
is seven numbers: the tool point and the platform's unit quaternion w x y z, base frame.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "STATUS",
    "KernelError",
    "Machine",
    "_rebuild",
    "elements",
    "instruction_set",
    "threads",
    "toml_lines",
    "use_instruction_set",
]

_Floats = NDArray[np.float64]
_Codes = NDArray[np.uint8]
_WithStatus = tuple[_Floats, _Codes]

STATUS: tuple[str, ...]
"""Status of a pose by its code: ok, out_of_travel, unreachable, singular, not_converged,
branch_lost, joint_limit."""

class KernelError(ValueError):
    """A description is no machine. `args` are (code, message, place), as in `strut.1.length`."""

@final
class Machine:
    """A parallel kinematic machine: immutable, picklable.

    `description`: `dof` and `commanded` (names in the order x y z a b c), `home` (freedom -> value,
    0 where missing), `tool` (3,), `characteristic_length` or None; `drives`, each `name`, `kind`,
    `travel` (2,), `working_mode` "+", "-" or None, and the fields of its kind (`elements()`);
    `struts`, each `name`, `drive` or None, `base` (3,), `platform` (3,), and `length`, which is
    None exactly where a telescopic drive is the length, and optionally `ring_radius`, `ring_axis`
    (3,), and `base_axis`, `base_angle_limit`, `platform_axis`, `platform_angle_limit` (rad);
    `guides`, each `name`, `kind` and the fields of its kind. Where there are more closures than
    freedoms `closure_compliance` (n_closure,), m/N, and `parameter_compliance` (name -> m/N or
    rad/(N m)) say how they share a misfit out; an infinite one carries nothing.
    Raises `KernelError`.
    """

    def __new__(cls, description: Mapping[str, Any]) -> Machine: ...
    @property
    def dof(self) -> tuple[str, ...]: ...
    @property
    def commanded(self) -> tuple[str, ...]: ...
    @property
    def components(self) -> tuple[str, ...]: ...
    @property
    def joints(self) -> tuple[str, ...]: ...
    @property
    def closures(self) -> tuple[str, ...]: ...
    @property
    def overconstrained(self) -> bool: ...
    @property
    def parameters(self) -> tuple[str, ...]: ...
    @property
    def units(self) -> tuple[str, ...]: ...
    @property
    def nominal(self) -> _Floats: ...
    @property
    def characteristic_length(self) -> float: ...
    @property
    def home(self) -> _Floats: ...
    @property
    def length_parameters(self) -> NDArray[np.int64]:
        """(n_closure,) the parameter that each strut's length is."""
    @property
    def working_modes(self) -> tuple[str, ...]: ...
    def replace(self, values: Mapping[str, float]) -> Machine: ...

    # Public calls: they raise `truepose.errors.PoseError`, or return (result, status).
    @overload
    def inverse(self, poses: ArrayLike, *, status: Literal[False] = False) -> _Floats: ...
    @overload
    def inverse(self, poses: ArrayLike, *, status: Literal[True]) -> _WithStatus: ...
    @overload
    def inverse(self, poses: ArrayLike, *, status: bool) -> _Floats | _WithStatus: ...
    @overload
    def forward(
        self,
        joints: ArrayLike,
        start: ArrayLike | None = None,
        *,
        status: Literal[False] = False,
    ) -> _Floats: ...
    @overload
    def forward(
        self, joints: ArrayLike, start: ArrayLike | None = None, *, status: Literal[True]
    ) -> _WithStatus: ...
    @overload
    def sensitivity(self, poses: ArrayLike, *, status: Literal[False] = False) -> _Floats: ...
    @overload
    def sensitivity(self, poses: ArrayLike, *, status: Literal[True]) -> _WithStatus: ...
    @overload
    def jac_pose_joint(self, poses: ArrayLike, *, status: Literal[False] = False) -> _Floats: ...
    @overload
    def jac_pose_joint(self, poses: ArrayLike, *, status: Literal[True]) -> _WithStatus: ...
    @overload
    def conditioning(self, poses: ArrayLike, *, status: Literal[False] = False) -> _Floats: ...
    @overload
    def conditioning(self, poses: ArrayLike, *, status: Literal[True]) -> _WithStatus: ...
    @overload
    def forces(
        self, poses: ArrayLike, wrench: ArrayLike, *, status: Literal[False] = False
    ) -> _Floats: ...
    @overload
    def forces(
        self, poses: ArrayLike, wrench: ArrayLike, *, status: Literal[True]
    ) -> _WithStatus: ...

    # Blocks of n poses: they raise for no pose.
    def place(self, poses: ArrayLike) -> tuple[_Floats, _Floats, _Codes]:
        """(joints, placements, status) of commanded poses (n, n_commanded)."""
    def corrected(
        self, poses: ArrayLike, columns: ArrayLike, values: ArrayLike
    ) -> tuple[_Floats, _Floats, _Codes]:
        """(joints, placements, status) for deviations `values` (n or 1, k) of parameters."""
    def displacement(
        self, joints: ArrayLike, placements: ArrayLike, columns: ArrayLike, values: ArrayLike
    ) -> _WithStatus:
        """(errors (n, n_component), status): forward with deviations, minus `placements`."""
    def sensitivity_at(
        self, joints: ArrayLike, placements: ArrayLike, columns: ArrayLike
    ) -> _WithStatus:
        """(sensitivity (n, n_component, k), status)."""
    def base_loads_at(
        self, joints: ArrayLike, placements: ArrayLike, forces: ArrayLike, columns: ArrayLike
    ) -> _Floats:
        """Loads (n, k) on parameters from forces on the base-side joint centres themselves.

        `forces` (n or 1, 3 n_strut), N, base axes, x y z of each strut in turn.
        """

    def settle_at(
        self,
        joints: ArrayLike,
        placements: ArrayLike,
        columns: ArrayLike,
        values: ArrayLike,
        clearances: ArrayLike,
        wrenches: ArrayLike,
    ) -> tuple[_Floats, _Floats, _Floats, _Floats, _Codes]:
        """Where an over-constrained machine comes to rest.

        (errors (n, n_component), forces, absorbed, strain (n, n_closure), status), for deviated
        parameters, half clearances of the closures (n or 1, n_closure), m, and a wrench (n or 1, 6)
        on the tool.
        """

    def internal_forces_at(
        self, joints: ArrayLike, placements: ArrayLike, columns: ArrayLike
    ) -> tuple[_Floats, _Codes]:
        """(forces (n, n_closure, k), status) that unit deviations of parameters strain.

        N/m or N/rad, a strut's tension positive; in a machine with more closures than freedoms.
        """

    def free_motions(self, pose: ArrayLike) -> _Floats | None:
        """The twists (k, 6) of the platform about its tool point that nothing holds.

        At one commanded pose, m and rad; None where the joints do not reach it.
        """

    def loads_at(
        self, joints: ArrayLike, placements: ArrayLike, wrenches: ArrayLike, columns: ArrayLike
    ) -> _WithStatus:
        """(loads (n, k), status) on parameters, by virtual work; a length's is the tension."""
    def compliance_at(
        self,
        joints: ArrayLike,
        placements: ArrayLike,
        columns: ArrayLike,
        parameter_compliance: ArrayLike,
    ) -> _WithStatus:
        """(compliance (n, n_component, n_component), status)."""
    def stiffness_at(
        self,
        joints: ArrayLike,
        placements: ArrayLike,
        columns: ArrayLike,
        parameter_compliance: ArrayLike,
    ) -> _WithStatus:
        """(stiffness (n, n_component, n_component), status)."""
    def lengths_at(self, joints: ArrayLike, placements: ArrayLike) -> _Floats:
        """(n, n_closure) present length of each strut, m."""
    def pose_of(self, placements: ArrayLike) -> _Floats:
        """(n, n_dof)."""
    def placement_of(self, poses: ArrayLike) -> _Floats:
        """(n, 7) of poses (n, n_dof) or (n, n_commanded)."""
    def joint_centres(self, joints: ArrayLike, placements: ArrayLike) -> _Floats:
        """(n, n_strut, 2, 3) base-side and platform-side joint centres, base frame, m."""
    def explain(self, pose: ArrayLike) -> list[dict[str, Any]]:
        """What keeps one commanded pose from being used, and by how much.

        Each is `what` ("strut", "travel", "singular"), `name`, `amount` and `unit`; the amount is
        negative where a strut would have to be shorter, or a joint is below its travel.
        """

def elements() -> dict[str, list[dict[str, Any]]]:
    """Every element by family (`drive`, `strut`), for models, schema, docs and pictures.

    Each is kind, doc, drawing, coordinate, fields (name, shape, dimension, default, doc) and
    parameters (name, dimension).
    """

def toml_lines(text: str) -> Sequence[tuple[tuple[str | int, ...], int]]:
    """The line, from 1, of every key and array item of a TOML document, by its path."""

def threads(n: int | None = None) -> int:
    """Set (where `n` is given) and return the number of threads that share a batch."""

def instruction_set() -> str:
    """What batches run on: scalar, portable, avx2 or avx512."""

def use_instruction_set(name: str) -> None:
    """Run batches on the named instruction set, or on the best there is ("best")."""

def _rebuild(table: Mapping[str, Any], replaced: Mapping[int, float]) -> Machine:
    """A machine from its pickle."""
