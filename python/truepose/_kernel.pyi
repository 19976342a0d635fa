"""The compiled kernel: closures, kinematics, sensitivities and statics. SI and radians throughout.

Arrays in may be of any real dtype and layout, arrays out are float64 and C-contiguous. Poses are
(..., n_commanded), or (..., n_dof) where all freedoms are meant; R = Rz(c) Ry(b) Rx(a). A placement
is seven numbers: the tool point and the platform's unit quaternion w x y z, base frame.
"""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "GCODE_AXES",
    "STATUS",
    "GcodeCorrector",
    "GcodeError",
    "GcodeMoves",
    "GcodeReader",
    "Identification",
    "KernelError",
    "Machine",
    "Points",
    "Study",
    "Tallies",
    "Variables",
    "_rebuild",
    "elements",
    "gcode_codes",
    "instruction_set",
    "largest",
    "least_squares",
    "threads",
    "toml_lines",
    "use_instruction_set",
]

_Floats = NDArray[np.float64]
_Codes = NDArray[np.uint8]
_WithStatus = tuple[_Floats, _Codes]
_Term = tuple[int, float, float, int | None]
"""Parameter, constant, slope per metre of a strut's length, and which strut."""

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

    def band_at(
        self,
        joints: ArrayLike,
        placements: ArrayLike,
        centre: ArrayLike,
        moved: ArrayLike,
        values: ArrayLike,
        parameters: ArrayLike,
        variables: Sequence[int],
        half: ArrayLike,
        sigmas: Sequence[float],
        quantities: Sequence[Sequence[int]],
    ) -> _WithStatus:
        """(numbers (n, 2 n_component + n_quantity), status) of a band about errors `centre`.

        Reach and standard uncertainty of each component, then the largest length of each of
        `quantities`; of the machine with the parameters `moved` (k0,) deviated by `values`
        (n or 1, k0). `parameters` (k,) go by `half` (n or 1, k) where their variable of
        `variables` (k,) is 1; `sigmas`: standard deviations in each variable's half band.
        """

    def budget_at(
        self,
        joints: ArrayLike,
        placements: ArrayLike,
        causes: Sequence[object],
        quantities: Sequence[Sequence[int]],
        all_plain: bool,
        smallest: float,
        tables: Mapping[str, Any],
    ) -> tuple[_Codes, _Codes, _Codes, dict[str, _Floats]]:
        """(status of shifts (n,), of bands (n,), of edges (n,), highest magnitudes by name).

        Fills the arrays of `tables` with the budget of `causes`: see `error_budget.in_kernel`.
        `quantities`: components of each length; `all_plain`: whether all variables lie in [-1, 1];
        `smallest`: of which coordinate, m, there is still a percent.
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
        directions: Sequence[Sequence[int]] = ...,
        most_boxes: int = ...,
        targets: ArrayLike | None = ...,
    ) -> tuple[list[list[float]], list[list[float]], list[list[float]], list[str], list[int]]:
        """(lower, upper (n, n_component), magnitudes (n, n_quantity), status, boxes): bounds.

        Over every variable in [-1, 1]: parameters `shifted` (k0,) are deviated by `shift`
        (n or 1, k0), and column c moves `parameters[c]` by `swing` (n or 1, k) times variable
        `variables[c]`; the variables of one of `directions` are together a unit vector. Status
        (n,): proven, near_singular, box_too_wide.

        The box is divided into at most `most_boxes` parts, shown to be of one branch, where
        nothing is proven over the whole of it, and where a magnitude lies above its `targets`
        (n or 1, n_quantity), m and rad; NaN or inf: any bound will do. `boxes` (n,): looked at.
        """

    def bounds_over(
        self,
        sides: Sequence[tuple[float, float]],
        shifts: Sequence[tuple[int, tuple[float, float], float, int]],
        yielding: Sequence[tuple[int, tuple[float, float], float, int]],
        wrench: Sequence[float],
        columns: Sequence[tuple[int, int, float]],
        close: tuple[float, tuple[float, float] | None],
        most_boxes: int,
        earlier: tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike, ArrayLike, int] | None,
        progress: Callable[[int, float], bool],
    ) -> dict[str, Any]:
        """Proven bounds over a region of commanded poses with these `sides` (n_commanded, 2).

        `shifts` and `yielding`, a known deviation and a compliance under `wrench` (6,): parameter,
        (low, high) of a constant, per length of a strut, which strut. `columns`: parameter,
        variable, swing. `close`: the gap, and sizes of position (m) and orientation (rad) that
        nothing may be above, where that is the question. `earlier`: how far an earlier search was,
        `part_sides`, `part_bound`, `finished`, `reached`, `at` and `boxes` of its dict. Where
        `progress(boxes, share)`, told which
        share of the region is finished, returns False the search ends; so it does at
        Ctrl-C, with `interrupted` True. Raises KeyboardInterrupt where nothing is proven by then.
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
        pairs: Sequence[tuple[int, int]] = ...,
    ) -> _WithStatus:
        """(compliance (n, n_component, n_component), status).

        `parameter_compliance` (n or 1, k + n_pair): of each column, then of `pairs` of places among
        them that give way under each other's load.
        """
    def stiffness_at(
        self,
        joints: ArrayLike,
        placements: ArrayLike,
        columns: ArrayLike,
        parameter_compliance: ArrayLike,
        pairs: Sequence[tuple[int, int]] = ...,
    ) -> _WithStatus:
        """(stiffness (n, n_component, n_component), status).

        `parameter_compliance` (n or 1, k + n_pair): of each column, then of `pairs` of places among
        them that give way under each other's load.
        """
    @property
    def limb_parameters(self) -> list[int]:
        """The parameters that the limbs give way by, limb by limb."""
    @property
    def limb_pairs(self) -> list[tuple[int, int]]:
        """The two parameters of each column of `limb_compliances_at`."""
    def limb_compliances_at(self, joints: ArrayLike, placements: ArrayLike) -> _Floats:
        """(n, n_pair) m/N: the upper triangle of each limb's matrix, row by row."""
    def limb_ends_at(self, joints: ArrayLike, placements: ArrayLike) -> _Floats:
        """(n, n_limb, 2, 3) m: the base end and the platform end of each limb, base axes."""
    def limb_wrenches_at(self, joints: ArrayLike, placements: ArrayLike) -> _Floats:
        """(n, n_closure of limbs, 6) force and moment of a unit of each, about the tool point."""
    def limb_sag_at(
        self, joints: ArrayLike, placements: ArrayLike, weight: Sequence[float]
    ) -> _Floats:
        """(n, n_closure of limbs) m by which they open under the limbs' own weight.

        Beyond what the closure forces do; `weight` (3,) is that of a kilogram, N, base axes.
        """
    def limb_bend_at(
        self, joints: ArrayLike, placements: ArrayLike, gradients: ArrayLike
    ) -> _Floats:
        """(n, n_closure of limbs) m by which they open where limbs are warmer on one side.

        `gradients` (n or 1, 3 n_limb), K/m, limb axes.
        """
    def c_functions(
        self,
        always: Sequence[_Term],
        per_kelvin: Sequence[Sequence[_Term]],
        compliance: Sequence[_Term],
        shared: Sequence[tuple[int, int, float]],
        limbs: bool,
    ) -> dict[str, tuple[str, str, int]]:
        """C functions of the machine's formulas: name -> (arguments, body, values kept).

        Terms are shifts of parameters: always, per kelvin of each part, and per load on them.
        `shared`: two parameters and how each gives way under the other's load; `limbs`: whether
        limbs give way.
        `crates/kernel/src/code` says what each function computes.
        """
    @property
    def control(self) -> dict[str, Any]:
        """What a program round the formulas reads beside parameters.

        `home` (6,), `dof` and `commanded` (6,) flags; of each drive its `travel`, whether it
        `turns`, the parameter of its `scale` or None, and the struts that it carries
        (`strut_drives`); `strut_drive` or None of each strut; the number of `closures`, and those
        that are `carrying`; `regularity_scale`; how many `joint_limits` there are on how far struts
        may lean.
        """
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
class Identification:
    """What instruments read of a machine, as a function of n unknowns; rows are poses.

    `description`: `unknowns` (n); `joints`, `starts` (flat rows, the latter placements); `shifted`,
    parameters, and `shifts` (flat, n_row or 1 rows); `terms`, (unknown, parameter), and their
    `coefficients` (flat, n_row or 1 rows); `instruments`, each `frame` (placement), `target`,
    `axis`, `zero` (3,), `on_platform`, `unknowns` (9 of its own: origin, rotation, target; or
    None); `observations` in the order of rows: (row, instrument, observable, strut, bias or None).
    """

    def __new__(cls, machine: Machine, description: Mapping[str, Any]) -> Identification: ...
    def predict(self, values: ArrayLike) -> _WithStatus:
        """(readings (n_observation,), status (n_row,)) for values (n,)."""
    def jacobian(self, values: ArrayLike) -> _WithStatus:
        """(derivatives (n_observation, n), status (n_row,)); NaN where a row cannot be solved."""
    def solve(
        self,
        measured: ArrayLike,
        weights: ArrayLike,
        prior_rows: ArrayLike,
        prior_mean: ArrayLike,
        start: ArrayLike,
        tolerances: tuple[float, float, float],
        most_evaluations: int,
    ) -> tuple[_Floats, _Floats, list[str], list[int]]:
        """(values (n_set, n), cost (n_set,), endings, evaluations), each set fitted from `start`.

        `measured` (n_set, n_observation); `weights` multiply residuals; |prior_rows (u - mean)|^2
        is added. Endings: cost, step, gradient; stalled, exhausted, unreachable.
        """

@final
class Variables:
    """Independent or correlated variables t of mean zero, drawn by counter-based random numbers.

    Each is a dict: `kind` (uniform, triangular, arcsine, two-point, normal, student-t, discrete),
    `sigmas` (half band in standard deviations), `stream` and `number` (its identity: whatever else
    varies, its samples are the same), `dof`, `values` and `probabilities` where the kind has them.
    The variables `members` are correlated: `factor` (k x k, row after row) times independent normal
    numbers, then taken to their distributions. Those of one of `directions` are together a unit
    vector, as likely in any direction.
    """

    def __new__(
        cls,
        variables: Sequence[Mapping[str, object]],
        members: Sequence[int] = ...,
        factor: Sequence[float] = ...,
        directions: Sequence[Sequence[int]] = ...,
    ) -> Variables: ...
    def draw(self, seed: int, first: int, count: int) -> _Floats:
        """(count, n_variable) the samples from number `first` on."""

@final
class Points:
    """Values (count, n_variable) of the variables at points that poses share."""

    def __new__(cls, values: ArrayLike, variables: int) -> Points: ...

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
    def append_lengths(self, positions: ArrayLike, whitening: ArrayLike, width: float) -> None:
        """Append a column: lengths of `positions` (n, count, 3), NaN without a result.

        `whitening` (n, 12) as of a `Study`; `width`: of a bin at least.
        """
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
    def sample_keeping(
        self, variables: Variables, seed: int, first: int, count: int, tallies: Tallies
    ) -> _Floats:
        """As `sample`; (n, count, 3) position errors, NaN of a sample without a result."""
    def sample_given_keeping(
        self, variables: Variables, values: ArrayLike, tallies: Tallies
    ) -> _Floats:
        """As `sample_given`; (n, count, 3) position errors, NaN of a sample without a result."""
    def errors(self, pose: int, points: Points) -> tuple[_Floats, int]:
        """(n_point, n_component) exact errors at a pose, NaN without a result; how many."""

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

def largest(
    centre: ArrayLike,
    effects: ArrayLike,
    middle: Sequence[float],
    half: Sequence[float],
    directions: Sequence[Sequence[int]],
    quantities: Sequence[Sequence[int]],
) -> _Floats:
    """(n, q, 5): the largest length from above, one that is reached, and its direction (3).

    Of the errors `centre` (n, m) + `effects` (n, m, v) t over t between `middle` -+ `half` (v,),
    but for the variables of `directions`, which are together a unit vector; for each of the
    `quantities`, components of a length, at most three.
    """

def least_squares(
    residual: Callable[[_Floats], ArrayLike],
    jacobian: Callable[[_Floats], ArrayLike],
    start: _Floats,
    *,
    weights: _Floats | None,
    scale: _Floats | None,
    cost: float,
    step: float,
    gradient: float,
    most_evaluations: int,
    first_radius: float,
) -> tuple[
    _Floats,
    _Floats,
    _Floats,
    float,
    Literal["cost", "step", "gradient", "stalled", "exhausted"],
    int,
    int,
]:
    """What `truepose.calibration.least_squares` is a face of.

    Values (n,), weighted residual (m,) and Jacobian (m, n) there, cost, status, evaluations,
    iterations. The first error of a callback is raised; `ValueError` for shapes that contradict
    each other and a start where something is not finite. `first_radius` may be infinite.
    """

def _rebuild(table: Mapping[str, Any], replaced: Mapping[int, float]) -> Machine:
    """A machine from its pickle."""

# Programs (gcode.rs). Here lengths are mm and angles degrees: the programs' world. Coordinates are
# of the machine (offsets applied), axes in the order of GCODE_AXES; one not known is NaN.

GCODE_AXES: str
"""The axes' letters in the order of all columns: XYZABCUVW."""

class GcodeError(ValueError):
    """A program cannot be interpreted, or written anew, exactly. For `code` see `gcode_codes`."""

    code: str
    message: str
    line: int
    column: int
    found: str | None
    expected: str | None
    hint: str | None

def gcode_codes() -> dict[str, str]:
    """The codes that a `GcodeError` can have, each with its meaning in one line."""

@final
class GcodeMoves:
    """Some moves of a program, in its order. Every property makes a new array."""

    def __len__(self) -> int: ...
    @property
    def line(self) -> NDArray[np.int64]:
        """Line of the program, from 1 on, (n,)."""
    @property
    def kind(self) -> NDArray[np.uint8]:
        """0 rapid (also the way to the intermediate point of G28 and G30), 1 line, 2 arc, (n,)."""
    @property
    def start(self) -> _Floats:
        """(n, 9), mm and degrees."""
    @property
    def end(self) -> _Floats:
        """(n, 9), mm and degrees."""
    @property
    def length(self) -> _Floats:
        """Length of the path that F refers to, (n,).

        In mm of X Y Z; where these stand still of U V W; where those do too in degrees of A B C.
        """
    @property
    def speed(self) -> _Floats:
        """At which F asks the tool to go, in units of `length` a second, (n,).

        Infinite for a rapid, NaN where the program does not say it (G95).
        """
    @property
    def stops(self) -> NDArray[np.bool_]:
        """Whether G61 or G61.1 holds, (n,)."""
    @property
    def plane(self) -> NDArray[np.uint8]:
        """17, 18 or 19 for an arc, else 0, (n,)."""
    @property
    def centre(self) -> _Floats:
        """Centre of an arc, mm, on the axes XY, ZX or YZ of its plane, else NaN, (n, 2)."""
    @property
    def sweep(self) -> _Floats:
        """Angle of an arc, rad, all turns included, counterclockwise positive, else 0, (n,)."""
    @property
    def turns(self) -> NDArray[np.int32]:
        """Turns of an arc, begun ones included, clockwise negative, else 0, (n,)."""
    def points(self, index: NDArray[np.int64], share: _Floats) -> _Floats:
        """The points of the moves `index` (k,) at `share` (k,) of their paths, (k, 9).

        0 is the start and 1 the end; arcs, helices, several turns and what goes along with them
        included. Raises IndexError.
        """

@final
class GcodeReader:
    """Reads the moves of a program of any size, in constant memory.

    Args:
        path: the program.
        units: "mm" or "inch" before the first G20 or G21; without it a length before these is
            refused.
        start: where the machine stands, by axis letter; axes not named are not known.
        offsets: "G54" ... "G59", "G59.1" ... "G59.3" to offsets by axis letter, 0 where not named,
            and "R" to the rotation about Z, degrees. A program that selects another is refused.
        system: which of them is active at first; where it has no offset, machine coordinates hold.
        reference: "G28" and "G30" to the coordinates that they go to, by axis letter, where known.
        block_delete: whether lines that begin with / are left out; None refuses them.
        axes: letters of the axes that must be known at the end of every move, and at the start of
            every one at feed.

    Raises OSError, and ValueError for a setting that is none.
    """

    def __new__(
        cls,
        path: str | PathLike[str],
        *,
        units: str | None = None,
        start: dict[str, float] | None = None,
        offsets: dict[str, dict[str, float]] | None = None,
        system: str = "G54",
        reference: dict[str, dict[str, float]] | None = None,
        block_delete: bool | None = None,
        axes: str = "XYZ",
    ) -> GcodeReader: ...
    def read(self, most_moves: int) -> GcodeMoves:
        """The next moves, at most so many; none at the end. Raises GcodeError, OSError."""
    @property
    def lines(self) -> int:
        """Lines read."""

@final
class GcodeCorrector:
    """Writes a program anew, block by block, with corrected and divided moves.

    Everything that moves nothing stays as it is, where it is. `read` a batch, `write` its pieces,
    until `read` finds no more moves; then `finish`. Arguments are those of `GcodeReader`, and

    Args:
        target: the file to write; emptied at once.
        axes: letters of the axes that are corrected. The others are written where the program
            writes them, and go along on the programmed path.
        digits: decimals of mm and degrees, 0 to 8; inches have one more.
        heading: a comment in a line of its own at the beginning, ASCII without parentheses.
        path_mode: a block, G64 with its P, that is put in front of the pieces of a block that ends
            in an exact stop (G61, G61.1): only its last piece ends in one then.
    """

    def __new__(
        cls,
        path: str | PathLike[str],
        target: str | PathLike[str],
        *,
        units: str | None = None,
        start: dict[str, float] | None = None,
        offsets: dict[str, dict[str, float]] | None = None,
        system: str = "G54",
        reference: dict[str, dict[str, float]] | None = None,
        block_delete: bool | None = None,
        axes: str = "XYZ",
        digits: int = 6,
        heading: str | None = None,
        path_mode: str | None = None,
    ) -> GcodeCorrector: ...
    def read(self, most_moves: int) -> GcodeMoves:
        """The next moves, at most so many; none behind the last.

        Fewer where much text stands between them. Raises GcodeError, OSError, and RuntimeError
        where those before are not written.
        """
    def write(self, counts: NDArray[np.int64], points: _Floats, shares: _Floats) -> None:
        """Writes the moves read last.

        Args:
            counts: pieces of each move, (n,), one or more.
            points: where each piece ends, (sum of counts, 9), machine coordinates in mm and
                degrees; columns of axes that are not corrected are not looked at.
            shares: share of the move's programmed path at each piece's end, (sum of counts,),
                rising to exactly 1.

        Raises GcodeError, OSError, and RuntimeError where the arrays do not fit the moves.
        """
    def finish(self) -> None:
        """Writes what is left, which moves nothing. Raises GcodeError, OSError, RuntimeError."""
    @property
    def lines(self) -> int:
        """Lines read."""
