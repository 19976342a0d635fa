"""The machine: what `truepose.load` returns."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from truepose._kernel import STATUS
from truepose._kernel import Machine as KernelMachine
from truepose.arrays import Flags, Floats, Indices, real_numbers
from truepose.errors import ArgumentError, PoseError, Problem, RequestError
from truepose.files.shown_units import ShownUnits, shown_units
from truepose.files.units import FileUnit
from truepose.files.wording import counted, did_you_mean, one_of
from truepose.lazy_names import of_the_package
from truepose.machine.calls import OfJoints, OfPoses, OfWrenches, Plotted, WithStatus
from truepose.machine.chains import Vector
from truepose.machine.compliances import (
    compliances,
    compliances_at,
    end_compliances,
    known,
)
from truepose.machine.condition import DEFAULT_PART, Condition
from truepose.machine.costs import Costs
from truepose.machine.equality import equal
from truepose.machine.families.parameters import FamilyParameters
from truepose.machine.limbs import Limb
from truepose.machine.parts import BODIES, Body, Drive, Guide, Strut
from truepose.machine.tables.calibration import CalibrationTable
from truepose.machine.tables.controller import Holds
from truepose.machine.workspace import MOST_POSES, Accuracy, PoseTable, Workspace
from truepose.representation import Facts, Represented

if TYPE_CHECKING:
    from truepose.machine.source_builder import ErrorSource

_HANDED_THROUGH = (
    "forward",
    "inverse",
    "sensitivity",
    "jac_pose_joint",
    "conditioning",
    "forces",
)

_MAPPINGS = ("settings", "file_units", "data_files", "replaced", "cases")

_NOT_HELD = "the struts do not hold the platform"
_HELD = "guides and what has no stiffness are rigid: the stiffness is infinite, not the compliance"

_ASKED_OF = ("position", "orientation")

_POSITIVE = (".length", ".scale")
"""Endings of the parameters that make sense above zero only."""


@dataclass(frozen=True, eq=False, repr=False)
class Machine(Represented):
    """A machine as its file describes it. Immutable; SI, radians and kelvin throughout.

    Poses are (..., n_commanded) or, where all freedoms are meant, (..., n_dof), in the order of
    `commanded` and `dof`; the orientation is `R = Rz(c) Ry(b) Rx(a)`. Joints are (..., n_joint).
    Calls that meet poses they cannot use raise one `PoseError`; with `status=True` they return
    `(result, status)`, status codes being positions in `truepose._kernel.STATUS`.

    The kinematic calls are the kernel's own methods:

    * `inverse(poses)`: (..., n_commanded) -> (..., n_joint)
    * `forward(joints, start=None)`: (..., n_joint) -> (..., n_dof); `start` (..., n_dof) or
      (..., n_commanded), default home
    * `sensitivity(poses)`: (..., n_component, n_parameter), small displacement of the tool point
      and rotation vector, base frame, per unit of each parameter
    * `jac_pose_joint(poses)`: (..., n_component, n_joint)
    * `conditioning(poses)`: (...), smallest to largest singular value of the scaled Jacobian
    * `forces(poses, wrench)`: (..., n_closure), force of each closure in N, a strut's its tension,
      under the wrench (..., 6) on the tool at the tool point, base axes
    """

    kernel: KernelMachine
    name: str
    description: str
    origin: str
    file: str
    file_hash: str
    settings: Mapping[str, str]
    condition: Condition
    workspace: Workspace | None
    accuracy: Accuracy
    drives: tuple[Drive, ...]
    struts: tuple[Strut, ...]
    sources: tuple[ErrorSource, ...]
    file_units: Mapping[str, FileUnit]
    platform: Body = field(default_factory=lambda: Body("platform"))
    frame: Body = field(default_factory=lambda: Body("frame"))
    tool: Body = field(default_factory=lambda: Body("tool"))
    mounting: Vector = (0.0, 0.0, 0.0)
    guides: tuple[Guide, ...] = ()
    limbs: tuple[Limb, ...] = ()
    data_files: Mapping[str, str] = field(default_factory=dict)
    """SHA-256 of each file of data that the machine file names."""
    replaced: Mapping[str, float] = field(default_factory=dict)
    calibration: CalibrationTable | None = None
    """Where the numbers of a calibrated machine file come from."""
    controller_holds: Holds | None = None
    """Which geometry the nominal one is, that the controller works with: that of the drawing, or
    a calibrated one that was loaded into it. None where the file does not say."""

    serial: str = ""
    date: str = ""
    """Serial number, and date of the state that the file describes; empty where it says none."""

    family: FamilyParameters | None = None
    """What the file's `[family]` says; None where it has none."""

    path: str = ""
    """Where the file was read, from the root of the file system; it says nothing of the machine."""

    cases: Mapping[str, Condition] = field(default_factory=dict)
    """Further conditions that the file names: `[case.NAME]`."""

    costs: Costs | None = None
    """What may be chosen, and what it costs: the file's `[cost]`."""

    forward: OfJoints = field(init=False, repr=False)
    inverse: OfPoses = field(init=False, repr=False)
    sensitivity: OfPoses = field(init=False, repr=False)
    jac_pose_joint: OfPoses = field(init=False, repr=False)
    conditioning: OfPoses = field(init=False, repr=False)
    forces: OfWrenches = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name in _MAPPINGS:
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))
        for name in _HANDED_THROUGH:
            object.__setattr__(self, name, getattr(self.kernel, name))

    def _facts(self) -> Facts:
        yield "name", self.name
        yield "description", self.description or None
        yield "file", self.file or None
        yield "SHA-256", self.file_hash or None
        yield "family", None if self.family is None else self.family.family.kind
        yield "freedoms", self.dof
        yield "drives", ", ".join(f"{drive.name} ({drive.kind})" for drive in self.drives)
        yield "struts", len(self.struts)
        yield "parameters", len(self.parameters)
        yield "workspace", self._workspace_text()
        yield "accuracy asked", ", ".join(filter(None, map(self.accuracy.said, _ASKED_OF))) or None
        yield "error sources", self.sources
        yield "calibrated", None if self.calibration is None else self.calibration.date

    def _workspace_text(self) -> str | None:
        """Between which coordinates the workspace lies, and how many poses there are of it."""
        if self.workspace is None:
            return None
        ends = []
        for name, least, most in zip(self.commanded, *self.workspace.ends, strict=True):
            unit = self.shown.pose(name)
            first, last = (f"{value * unit.per_si:.6g}" for value in (least, most))
            ends.append(f"{name} {first} to {last} {unit.label}")
        return f"{', '.join(ends)}: {counted(self.workspace.n_pose, 'pose')}"

    def plot(self, figure: str | None = None) -> Plotted:
        """A figure of its report, which shows itself in a notebook.

        Without a name it is the machine drawn, in place of which a notebook shows the live page.
        `figure` is a name such as "workspace_maps"; what the figure needs is computed. The result
        has the `figure` of plotly.js, and `write` writes it. Raises `RequestError` (extra-missing
        without the extra `report`, unknown-choice, no-workspace, no-source).
        """
        drawn: Plotted = of_the_package("plot")(self, figure)
        return drawn

    def __reduce__(self) -> tuple[Callable[..., Machine], tuple[dict[str, Any]]]:
        state = {
            attribute.name: getattr(self, attribute.name)
            for attribute in fields(self)
            if attribute.init
        }
        for name in _MAPPINGS:
            state[name] = dict(state[name])
        return _restored, (state,)

    def __eq__(self, other: object) -> bool:
        """Whether both are the same machine in the same condition, as after pickling."""
        if not isinstance(other, Machine):
            return NotImplemented
        return self is other or equal(self._compared(), other._compared())

    def __hash__(self) -> int:
        return hash((self.name, self.file_hash))

    def _compared(self) -> list[Any]:
        """All that makes the machine, in a form that can be compared: the kernel's by its parts."""
        apart = ("kernel", "path")
        others = [
            getattr(self, each.name)
            for each in fields(self)
            if each.init and each.name not in apart
        ]
        return [self.kernel.__reduce__()[1], *others]

    @property
    def dof(self) -> tuple[str, ...]:
        """The platform's freedoms, among x y z a b c."""
        return self.kernel.dof

    @property
    def commanded(self) -> tuple[str, ...]:
        """The freedoms that a pose commands."""
        return self.kernel.commanded

    @property
    def components(self) -> tuple[str, ...]:
        """Those of x y z rx ry rz that the platform can move in."""
        return self.kernel.components

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joint coordinates: the drives'."""
        return self.kernel.joints

    @property
    def closures(self) -> tuple[str, ...]:
        """Names of the closures: the struts', then the guides'."""
        return self.kernel.closures

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters: `strut.1.length`, `drive.d1.axis.u`, `tool.x`, ..."""
        return self.kernel.parameters

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each parameter."""
        return self.kernel.units

    @property
    def nominal(self) -> Floats:
        """(n_parameter,) nominal values, SI."""
        return self.kernel.nominal

    @property
    def home(self) -> Floats:
        """(n_dof,) the pose at which solutions start, SI."""
        return self.kernel.home

    @property
    def characteristic_length(self) -> float:
        """The length in m that weighs rotations against displacements."""
        return self.kernel.characteristic_length

    @property
    def unit_labels(self) -> dict[str, str]:
        """The file's word for the unit of each dimension; the SI unit where it declares none."""
        return {name: unit.label for name, unit in self.file_units.items()}

    @property
    def shown(self) -> ShownUnits:
        """The units in which people are answered, from those of the file."""
        return shown_units(self.file_units)

    @property
    def stiffness_known(self) -> Flags:
        """(n_strut,) whether the file says how stiff something is along each strut's limb."""
        return known(self.drives, self.struts, self.limbs)

    @property
    def parts(self) -> tuple[str, ...]:
        """Paths of the parts that may have a temperature of their own: `strut.1`, `frame`, ..."""
        rows: tuple[Drive | Strut | Guide | Body, ...] = (
            *self.drives,
            *self.struts,
            *self.guides,
            *self.carriages,
        )
        return (*(row.part for row in rows), *BODIES)

    @property
    def carriages(self) -> tuple[Body, ...]:
        """The bodies that the drives move, those that have one."""
        return tuple(drive.carriage for drive in self.drives if drive.carriage is not None)

    @property
    def bodies(self) -> tuple[Body, ...]:
        """All of them: platform, frame, tool and carriages."""
        return (self.platform, self.frame, self.tool, *self.carriages)

    @property
    def down(self) -> Floats:
        """(3,) unit vector of gravity, base axes: R^T (0, 0, -1), R = Rz(c) Ry(b) Rx(a)."""
        a, b, _ = self.mounting
        return -np.array(
            [-math.sin(b), math.cos(b) * math.sin(a), math.cos(b) * math.cos(a)], np.float64
        )

    def poses(self) -> Floats:
        """(n_pose, n_commanded) the poses of the file's workspace, first axis fastest, SI.

        Raises `RequestError`: no-workspace where the file gives none, grid-too-large where it gives
        more than are kept at once.
        """
        count = len(self.pose_table())
        assert self.workspace is not None
        if count > MOST_POSES:
            raise RequestError(
                Problem(
                    "grid-too-large",
                    "more poses than are evaluated one by one",
                    self.file,
                    line=self.workspace.line,
                    path="workspace",
                    found=f"{count:.3g} poses",
                    expected=f"at most {MOST_POSES:.0e} poses".replace("e+0", "e"),
                    hint="a coarser grid; of more poses there is a summary: truepose budget "
                    "--summary, truepose.budget(machine, summary=True)",
                )
            )
        return self.workspace.poses()

    def pose_table(self) -> PoseTable:
        """The poses of the file's workspace, any number of them, of a grid made as looked at.

        Raises `RequestError` (no-workspace) where the file gives none.
        """
        if self.workspace is None:
            raise RequestError(
                Problem(
                    "no-workspace",
                    "the machine file gives no poses",
                    self.file,
                    found="no [workspace]",
                    expected="a [workspace] with a grid or poses, or poses in the call",
                )
            )
        return self.workspace.table()

    def compliances(self, lengths: ArrayLike) -> tuple[Indices, Floats]:
        """Parameters (k,) that may give way, and their compliance (n, k), m/N or rad/(N m).

        `lengths` (n, n_strut): present length of each strut, m. The first n_strut columns are the
        struts' lengths. In series along the limb; 0, rigid, where the file says nothing. What a
        `[[limb]]` says is not among them: it depends on the pose.
        """
        given = np.atleast_2d(real_numbers("lengths", lengths))
        if given.ndim != 2 or given.shape[1] != len(self.struts):
            raise ArgumentError.of("lengths", lengths, f"an array (n, {len(self.struts)})")
        return compliances(self.kernel, self.drives, self.struts, given, self.limbs)

    @property
    def end_compliances(self) -> Floats:
        """(n_strut, 2) m/N of what gives way along each strut at its base and platform end.

        Its joints and a telescopic drive, which stands at the base end: shares of `compliances`.
        """
        return end_compliances(self.kernel, self.drives, self.struts, self.limbs)

    @overload
    def stiffness(self, poses: ArrayLike, *, status: Literal[False] = False) -> Floats: ...
    @overload
    def stiffness(self, poses: ArrayLike, *, status: Literal[True]) -> WithStatus: ...
    def stiffness(self, poses: ArrayLike, *, status: bool = False) -> Floats | WithStatus:
        """Wrench on the tool per small displacement, (..., n_component, n_component), SI.

        At the tool point, base axes, from struts, joints, drives and what they stand on. Raises
        `RequestError` (no-stiffness) where nothing along a limb gives one, `PoseError` as all
        calls do.
        """
        return self._elastic(self.kernel.stiffness_at, poses, status)

    @overload
    def compliance(self, poses: ArrayLike, *, status: Literal[False] = False) -> Floats: ...
    @overload
    def compliance(self, poses: ArrayLike, *, status: Literal[True]) -> WithStatus: ...
    def compliance(self, poses: ArrayLike, *, status: bool = False) -> Floats | WithStatus:
        """Small displacement per wrench on the tool: the inverse of `stiffness`, same shapes."""
        return self._elastic(self.kernel.compliance_at, poses, status)

    def _elastic(
        self, block: Callable[..., WithStatus], poses: ArrayLike, status: bool
    ) -> Floats | WithStatus:
        self._require_stiffness()
        given = real_numbers("poses", poses)
        # The public inverse checks the poses, and raises for those that it cannot use.
        self.kernel.inverse(given, status=status)
        leading, size = given.shape[:-1], len(self.components)
        joints, placements, placed = self.kernel.place(given.reshape(-1, given.shape[-1]))
        lengths = self.kernel.lengths_at(joints, placements)
        yielding = compliances_at(self, joints, placements, lengths)
        matrices, solved = block(
            joints, placements, yielding.columns, yielding.stacked, yielding.pairs
        )
        result = matrices.reshape(*leading, size, size)
        codes = np.where(placed == 0, solved, placed)
        if status:
            return result, codes.reshape(leading)
        failed = np.flatnonzero(codes)
        if failed.size:
            first = int(failed[0])
            name = STATUS[codes[first]]
            # Placed, but not solved: a matrix of compliance that has no inverse.
            reason = _HELD if block == self.kernel.stiffness_at and not placed[first] else _NOT_HELD
            raise PoseError(int(failed.size), first, name, reason)
        return result

    def _require_stiffness(self) -> None:
        lacking = [
            strut.name
            for strut, known in zip(self.struts, self.stiffness_known, strict=True)
            if not known
        ]
        if lacking:
            raise RequestError(
                Problem(
                    "no-stiffness",
                    f"nothing says how stiff strut {', '.join(lacking)} is",
                    self.file,
                    path=f"strut.{lacking[0]}",
                    found="no stiffness",
                    expected="section_area and modulus (or material), or an outright stiffness",
                )
            )

    def replace(self, values: Mapping[str, float]) -> Machine:
        """The machine with other parameter values, SI: `{"strut.1.length": 0.5003}`.

        Properties, condition and sources stay. Raises `RequestError` with every name that is none
        (unknown-parameter) and every value that is not finite, or not above zero where it must be.
        """
        if not isinstance(values, Mapping):
            raise ArgumentError.of(
                "values",
                values,
                "values by the names of parameters, such as {'strut.1.length': 0.5003}",
            )
        problems = [
            problem
            for name, value in values.items()
            if (problem := self._bad_value(name, value)) is not None
        ]
        if problems:
            raise RequestError(*problems)
        changed = {name: float(value) for name, value in values.items()}
        kernel = self.kernel.replace(changed)
        return replace(self, kernel=kernel, replaced={**self.replaced, **changed})

    def _bad_value(self, name: str, value: object) -> Problem | None:
        if name not in self.parameters:
            return Problem(
                "unknown-parameter",
                f"the machine has no parameter {name}",
                self.file,
                path=name,
                found=name,
                expected="a name of machine.parameters",
                hint=did_you_mean(name, self.parameters),
            )
        positive = name.endswith(_POSITIVE)
        if isinstance(value, bool) or not isinstance(value, float | int | np.floating | np.integer):
            return Problem(
                "wrong-type",
                f"{name} is set to what is no number",
                self.file,
                path=name,
                found=repr(value),
                expected="a number above zero, SI" if positive else "a finite number, SI",
            )
        if np.isfinite(value) and (value > 0.0 or not positive):
            return None
        return Problem(
            "not-positive" if np.isfinite(value) else "not-finite",
            f"{name} cannot be {value:g}",
            self.file,
            path=name,
            found=str(value),
            expected="a number above zero, SI" if positive else "a finite number, SI",
        )

    def with_condition(self, condition: Condition) -> Machine:
        """The machine in another condition. Raises `RequestError` (unknown-part)."""
        self.check_condition(condition)
        return replace(self, condition=condition)

    def check_condition(self, condition: Condition) -> None:
        """Raise `RequestError` (unknown-part) with every part that the machine does not have."""
        if not isinstance(condition, Condition):
            raise ArgumentError.of("condition", condition, "a truepose.Condition")
        known_parts = (*self.parts, *(limb.part for limb in self.limbs))
        problems = [
            Problem(
                "unknown-part",
                f'the condition names a part "{part}", which the machine does not have',
                self.file,
                path=f"condition.{part}",
                found=part,
                expected=one_of((DEFAULT_PART, *known_parts)),
                hint=did_you_mean(part, known_parts),
            )
            for part in condition.named_parts
            if part not in known_parts
        ]
        if problems:
            raise RequestError(*problems)


def _restored(state: dict[str, Any]) -> Machine:
    return Machine(**state)
