"""The kernel's machine from the parts of a file without problems, and what only it can tell."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from truepose._kernel import KernelError
from truepose._kernel import Machine as KernelMachine
from truepose.errors import CATALOGUE, Fault, MachineFileError, Problem
from truepose.files.document import Document
from truepose.files.units import UnitSystem, shown_value
from truepose.machine import limb_checks
from truepose.machine.compliances import compliances
from truepose.machine.elements import strut_geometry
from truepose.machine.limbs import Limb
from truepose.machine.limbs import described as limb_description
from truepose.machine.parts import Drive, Guide, Strut
from truepose.machine.tables.machine import MachineTable
from truepose.machine.validation import Validated


@dataclass(frozen=True)
class Described:
    """What a machine is built from; `home` by freedom, SI, what it does not name is 0."""

    document: Document
    validated: Validated
    drives: Sequence[Drive]
    struts: Sequence[Strut]
    guides: Sequence[Guide]
    limbs: Sequence[Limb]
    home: Mapping[str, float]

    @property
    def limb_parts(self) -> limb_checks.Parts:
        """What the checks of limbs look at."""
        rows = self.validated.rows(strut_geometry())
        return limb_checks.Parts(
            self.document,
            self.drives,
            self.struts,
            self.guides,
            self.limbs,
            [getattr(row, "length", None) for row in rows],
            [tuple(getattr(row, "base", (0.0, 0.0, 0.0))) for row in rows],
            self.validated.units,
        )


def kernel(described: Described) -> KernelMachine:
    """The kernel's machine. Raises `MachineFileError` for what it alone can refuse.

    Where there are more closures than freedoms, it knows how stiff the limbs are: at home, where a
    telescopic strut has the length that its stiffness then has everywhere.
    """
    wrong = list(limb_checks.problems(described.limb_parts))
    if wrong:
        raise MachineFileError(*dict.fromkeys(wrong))
    description = _description(described)
    machine = _built(described.document, description)
    if not machine.overconstrained:
        return machine
    wrong = list(limb_checks.unsupported(described.limb_parts))
    if wrong:
        raise MachineFileError(*wrong)
    lengths = _home_lengths(machine)
    columns, values = compliances(machine, described.drives, described.struts, lengths)
    names = machine.parameters
    given = {names[column]: float(value) for column, value in zip(columns, values[0], strict=True)}
    return _built(described.document, {**description, "parameter_compliance": given})


def problems(described: Described, machine: KernelMachine) -> list[Problem]:
    """What is wrong with the machine as a whole: rigid limbs that strain, motions left free."""
    problems = list(_rigid(described, machine)) if machine.overconstrained else []
    if described.guides and (free := _free_motions(machine)) is not None and len(free):
        problems.append(_loose(described, machine, free))
    if described.limbs and not problems:
        joints, placements, _ = machine.place(_commanded_home(machine)[np.newaxis, :])
        problems += limb_checks.chain_problems(
            described.limb_parts, machine, joints[0], placements[0]
        )
    return problems


def _built(document: Document, description: dict[str, Any]) -> KernelMachine:
    try:
        return KernelMachine(description)
    except KernelError as error:
        code, message, where = error.args
        key = document.key(where) if where else ()
        value = document.value(key)
        raise MachineFileError(
            document.problem(
                Fault(
                    code if code in CATALOGUE else "not-buildable",
                    message,
                    found=None if isinstance(value, dict) else shown_value(value),
                ),
                key,
            )
        ) from None


def _description(described: Described) -> dict[str, Any]:
    table = described.validated.table(MachineTable)
    assert table is not None
    geometry = described.validated.rows(strut_geometry())
    return {
        "dof": list(table.dof),
        "commanded": list(table.commanded or table.dof),
        "home": {name: value for name, value in described.home.items() if name in table.dof},
        "tool": list(table.tool),
        "characteristic_length": table.characteristic_length,
        "drives": [
            {
                "name": drive.name,
                "kind": drive.kind,
                "travel": list(drive.travel),
                "working_mode": drive.working_mode,
                "yields": bool(drive.chain),
                **_as_lists(drive.fields),
            }
            for drive in described.drives
        ],
        "struts": [
            {"name": strut.name, "drive": strut.drive, **_as_lists(dict(own)), **_limits(strut)}
            for strut, own in zip(described.struts, geometry, strict=True)
        ],
        "guides": [
            {"name": guide.name, "kind": guide.kind, **_as_lists(guide.fields)}
            for guide in described.guides
        ],
        "limbs": [
            limb_description(limb, described.drives, described.struts) for limb in described.limbs
        ],
    }


def _as_lists(fields: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: list(value) if isinstance(value, tuple) else value for name, value in fields.items()
    }


def _limits(strut: Strut) -> dict[str, Any]:
    """How far the strut may lean at its joints."""
    limits: dict[str, Any] = {}
    for end, joint in (("base", strut.base_joint), ("platform", strut.platform_joint)):
        if joint.angle_limit is not None and joint.axis is not None:
            limits[f"{end}_axis"] = list(joint.axis)
            limits[f"{end}_angle_limit"] = joint.angle_limit
    return limits


def _commanded_home(machine: KernelMachine) -> np.ndarray:
    return machine.home[[machine.dof.index(freedom) for freedom in machine.commanded]]


def _home_lengths(machine: KernelMachine) -> np.ndarray:
    """(1, n_strut) lengths at home, m; not finite where home cannot be reached."""
    joints, placements, _ = machine.place(_commanded_home(machine)[np.newaxis, :])
    return machine.lengths_at(joints, placements)


def _rigid(described: Described, machine: KernelMachine) -> Iterable[Problem]:
    """Parts that do not give way, in a machine whose parts must share a misfit out."""
    lengths = np.ones((1, len(described.struts)))  # whether a part gives way, not by how much
    columns, values = compliances(machine, described.drives, described.struts, lengths)
    yielding = {
        machine.parameters[column]: value > 0.0
        for column, value in zip(columns, values[0], strict=True)
    }
    of_drive = {drive.name: yielding.get(f"{drive.part}.offset") for drive in described.drives}
    for index, strut in enumerate(described.struts):
        own = yielding[machine.parameters[machine.length_parameters[index]]]
        base = any(yielding.get(f"{strut.part}.base.{axis}") for axis in "xyz")
        if not (own or base or of_drive.get(strut.drive or "")):
            yield described.document.problem(
                Fault(
                    "no-stiffness",
                    "the machine has more closures than freedoms, but nothing says how stiff "
                    f"strut {strut.name} is",
                    found="a rigid limb",
                    expected="section_area and modulus (or material), or an outright axial "
                    "stiffness",
                    hint="where not all closures fit, the limbs share the misfit by their "
                    "stiffness",
                ),
                ("strut", index),
            )
    for index, guide in enumerate(described.guides):
        yield described.document.problem(
            Fault(
                "no-stiffness",
                f"the machine has more closures than freedoms, and guide {guide.name} is rigid",
                found="a guide, which has no stiffness",
                expected="as many closures as freedoms where there are guides",
                hint="leave a guide or a strut away, or let a strut do what the guide does",
            ),
            ("guide", index),
        )
    # With a rigid guide nothing can be placed, wherever home is.
    if not described.guides and not np.isfinite(_home_lengths(machine)).all():
        yield described.document.problem(
            Fault(
                "home-unreachable",
                "the machine has more closures than freedoms and cannot be placed at home, "
                "where its stiffness is taken",
                found="home out of reach",
                expected="a [workspace] home that the machine reaches",
            ),
            ("workspace",),
        )


def _free_motions(machine: KernelMachine) -> np.ndarray | None:
    return machine.free_motions(_commanded_home(machine))


def _loose(described: Described, machine: KernelMachine, free: np.ndarray) -> Problem:
    names = ", ".join(guide.name for guide in described.guides)
    units = described.validated.units
    motions = "; ".join(_motion(twist, machine.characteristic_length, units) for twist in free)
    return described.document.problem(
        Fault(
            "loose-platform",
            "the struts leave motions free that the guides do not hold",
            found=f"at home the platform can still move: {motions}",
            expected="closures that hold every freedom of the platform",
            hint=f"look at where {names} point and stand; two closures may hold the same motion",
        ),
        ("guide", 0),
    )


def _motion(twist: np.ndarray, length: float, units: UnitSystem) -> str:
    """A free motion for people: what turns about which axis, what moves along which."""
    moved, turned = twist[:3], twist[3:] * length
    size = float(np.linalg.norm(twist * [1, 1, 1, length, length, length]))
    if np.linalg.norm(turned) < 1e-6 * size:
        return f"along {_direction(moved)}"
    axis = twist[3:] / np.linalg.norm(twist[3:])
    pitch = float(moved @ axis) / float(np.linalg.norm(twist[3:]))
    centre = np.cross(axis, moved) / np.linalg.norm(twist[3:])
    centre[np.abs(centre) < 1e-6 * length] = 0.0
    unit = units.shown()["length"]
    through = ", ".join(f"{float(unit.to_file(value)):.4g}" for value in centre + 0.0)
    about = f"about {_direction(axis)}, {through} {unit.label} from the tool point"
    if abs(pitch) < 1e-6 * length:
        return about
    return f"{about}, while it moves along it"


def _direction(vector: np.ndarray) -> str:
    unit = vector / np.linalg.norm(vector)
    for axis, name in enumerate("xyz"):
        if abs(abs(unit[axis]) - 1.0) < 1e-9:
            return name
    return "(" + ", ".join(f"{value:.3g}" for value in unit + 0.0) + ")"
