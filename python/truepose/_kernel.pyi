"""The compiled kernel: closures, kinematics, sensitivities and statics. SI and radians throughout.

Arrays in may be of any real dtype and layout, arrays out are float64 and C-contiguous. Poses are
(..., n_commanded), or (..., n_dof) where all freedoms are meant; R = Rz(c) Ry(b) Rx(a). A placement
is seven numbers: the tool point and the platform's unit quaternion w x y z, base frame.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "STATUS",
    "KernelError",
    "Machine",
    "Study",
    "Tallies",
    "Variables",
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
    def sensitivity_moved(
        self,
        joints: ArrayLike,
        placements: ArrayLike,
        columns: ArrayLike,
        moved: ArrayLike,
        values: ArrayLike,
    ) -> _WithStatus:
        """(sensitivity (n, n_component, k), status) of the machine with parameters moved.

        The parameters `moved` (k0,) are deviated by `values` (n or 1, k0); derivatives of the
        displacement from `placements` and of its rotation vector, where the machine then is.
        """

    @property
    def can_be_enclosed(self) -> bool:
        """Whether bounds over a region can be proven: see `bounds_over`."""

    def bounds_at(
        self,
        joints: ArrayLike,
        placements: ArrayLike,
        shifted: ArrayLike,
        shift: ArrayLike,
        parameters: ArrayLike,
        variables: Sequence[int],
        swing: ArrayLike,
    ) -> tuple[list[list[float]], list[list[float]], list[list[float]], list[str]]:
        """(lower, upper (n, n_component), magnitudes (n, n_quantity), status (n,)), proven bounds.

        Over every variable in [-1, 1]: parameters `shifted` (k0,) are deviated by `shift`
        (n or 1, k0), and column c moves `parameters[c]` by `swing` (n or 1, k) times variable
        `variables[c]`. Status: proven, near_singular, box_too_wide.
        """

    def bounds_over(
        self,
        sides: Sequence[tuple[float, float]],
        shifts: Sequence[tuple[int, tuple[float, float], float, int]],
        yielding: Sequence[tuple[int, tuple[float, float], float, int]],
        wrench: Sequence[float],
        columns: Sequence[tuple[int, int, float]],
        gap: float,
        most_boxes: int,
        progress: Callable[[int, float], bool],
    ) -> dict[str, Any]:
        """Proven bounds over a region of commanded poses with these `sides` (n_commanded, 2).

        `shifts` and `yielding`, a known deviation and a compliance under `wrench` (6,): parameter,
        (low, high) of a constant, per length of a strut, which strut. `columns`: parameter,
        variable, swing. Where `progress(boxes, gap)` returns False the search ends.
        """

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

@final
class Variables:
    """Independent or correlated variables t of mean zero, drawn by counter-based random numbers.

    Each is a dict: `kind` (uniform, triangular, arcsine, two-point, normal, student-t, discrete),
    `sigmas` (half band in standard deviations), `stream` and `number` (its identity: whatever else
    varies, its samples are the same), `dof`, `values` and `probabilities` where the kind has them.
    The variables `members` are correlated: `factor` (k x k, row after row) times independent normal
    numbers, then taken to their distributions.
    """

    def __new__(
        cls,
        variables: Sequence[Mapping[str, object]],
        members: Sequence[int] = ...,
        factor: Sequence[float] = ...,
    ) -> Variables: ...
    def draw(self, seed: int, first: int, count: int) -> _Floats:
        """(count, n_variable) the samples from number `first` on."""

@final
class Tallies:
    """What is kept of samples at n poses, in constant memory.

    `origins`, `widths` (n, columns): where the values of a column lie, and how wide a bin of its
    histogram may be at least. The first `covariant` columns have a covariance.
    """

    def __new__(
        cls, origins: ArrayLike, widths: ArrayLike, columns: int, covariant: int
    ) -> Tallies: ...
    def blank(self) -> Tallies:
        """The same without samples."""
    def add(self, values: ArrayLike) -> None:
        """Add samples (count, columns) to the first pose."""
    def fail(self, count: int) -> None:
        """Count samples of the first pose that have no result."""
    def merge(self, other: Tallies) -> None:
        """Add the samples of other tallies."""
    @property
    def count(self) -> NDArray[np.int64]:
        """(n,) samples with a result."""
    @property
    def failed(self) -> NDArray[np.int64]:
        """(n,) samples without a result."""
    @property
    def mean(self) -> _Floats:
        """(n, columns)."""
    @property
    def covariance(self) -> _Floats:
        """(n, covariant, covariant)."""
    @property
    def extremes(self) -> _Floats:
        """(n, columns, 2) smallest and largest value."""
    def quantiles(self, shares: Sequence[float]) -> _Floats:
        """(n, columns, n_share) the values below which lie the shares of the samples."""
    def shortest(self, share: float) -> _Floats:
        """(n, columns, 2) the narrowest interval that holds the share of the samples."""

@final
class Study:
    """A machine at n poses, ready for sampling.

    `joints` (n, n_joint), `placements` (n, 7) of the commands; `shifted` (k0,) parameters and their
    `shift` (n or 1, k0); `parameters`, `variables` (k,) of the columns and their `swing`
    (n or 1, k); `whitening` (n, 12): centre (3) and matrix (3 x 3) of the position error, whose
    length then is the last column of the tallies.
    """

    def __new__(
        cls,
        machine: Machine,
        joints: ArrayLike,
        placements: ArrayLike,
        shifted: ArrayLike,
        shift: ArrayLike,
        parameters: ArrayLike,
        variables: Sequence[int],
        swing: ArrayLike,
        whitening: ArrayLike | None = None,
    ) -> Study: ...
    @property
    def status(self) -> _Codes:
        """(n,) of the machine at its shifts."""
    @property
    def shift_error(self) -> _Floats:
        """(n, n_component) error at the shifts."""
    def sample(
        self, variables: Variables, seed: int, first: int, count: int, tallies: Tallies
    ) -> None:
        """Evaluate samples into tallies of the components, the magnitudes and the length."""
    def sample_given(self, variables: Variables, values: ArrayLike, tallies: Tallies) -> None:
        """Evaluate samples of given variables (count, n_variable)."""

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
