"""A machine file -> `Machine`: read, validate, check, hand to the kernel, ask the sources."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truepose import _kernel
from truepose.errors import CATALOGUE, MachineFileError, Problem
from truepose.machine import checks, validation
from truepose.machine.condition import (
    DEFAULT_PART,
    ISO_1_REFERENCE_TEMPERATURE,
    Condition,
    Vector,
)
from truepose.machine.dimensions import FREEDOMS
from truepose.machine.document import Document, read
from truepose.machine.elements import drive_kinds, strut_geometry
from truepose.machine.file_parts import ErrorSource, FileParts, SourceType
from truepose.machine.materials import MATERIALS
from truepose.machine.model import Machine
from truepose.machine.parts_of_machine import Drive, Strut
from truepose.machine.settings import apply
from truepose.machine.tables import SCHEMA, owners
from truepose.machine.tables.accuracy import AccuracyTable
from truepose.machine.tables.condition import ConditionTable, CuttingTable
from truepose.machine.tables.drive import DriveTable
from truepose.machine.tables.machine import MachineTable
from truepose.machine.tables.strut import StrutTable
from truepose.machine.tables.workspace import HomeTable, WorkspaceTable
from truepose.machine.units import QuantityError, UnitSystem, shown_value
from truepose.machine.validation import Validated
from truepose.machine.workspace import Accuracy, GridAxis, Workspace


def load(
    path: str | Path,
    *,
    settings: Mapping[str, str] | Sequence[str] = (),
    registry: Sequence[SourceType],
) -> Machine:
    """Read a machine file.

    `settings`: changes of its values before it is validated, as `{"strut.1.length": "501"}` or
    `["strut.1.length=501"]`. `registry`: the error sources that may read keys of the file.

    Raises `MachineFileError` with every problem of the file, `RequestError` for a setting that
    leads nowhere.
    """
    document = read(path)
    owned = owners(source.tables for source in registry)
    apply(document, settings, owned.free_tables)
    _require_schema(document)
    validated, problems = validation.validate(document, owned)
    problems += checks.check(document, validated)
    _raise(problems)
    return _built(document, validated, registry)


def _raise(problems: Iterable[Problem]) -> None:
    """All problems at once, in the file's order and each once."""
    every = sorted(
        dict.fromkeys(problems), key=lambda problem: (problem.line is None, problem.line or 0)
    )
    if every:
        raise MachineFileError(*every)


def _require_schema(document: Document) -> None:
    """Stop at a file of another version: what else it says is not for this version to judge."""
    schema = document.data.get("schema")
    if schema == SCHEMA and isinstance(schema, int) and not isinstance(schema, bool):
        return
    if schema is None:
        raise MachineFileError(
            Problem(
                "missing-key",
                "schema: missing",
                document.file,
                path="schema",
                found="nothing",
                expected=f"schema = {SCHEMA}, above the first table",
            )
        )
    raise MachineFileError(
        document.problem(
            "unsupported-schema",
            "this version reads no such machine file",
            ("schema",),
            found=shown_value(schema),
            expected=str(SCHEMA),
            hint="a newer version of truepose may read it"
            if isinstance(schema, int) and schema > SCHEMA
            else None,
        )
    )


def _built(document: Document, validated: Validated, registry: Sequence[SourceType]) -> Machine:
    machine = validated.table(MachineTable)
    assert machine is not None
    problems: list[Problem] = []
    drives = _drives(validated)
    workspace, home = _workspace(document, validated, machine, problems)
    _raise(problems)
    kernel = _kernel_machine(document, validated, machine, drives, home)
    struts = tuple(map(_strut, validated.rows(StrutTable)))
    condition = _condition(validated.table(ConditionTable))
    parts = FileParts(document, validated, validated.units, kernel, drives, struts, condition)
    built = [source.build(parts) for source in registry]
    _raise(parts.problems)
    sources: tuple[ErrorSource, ...] = tuple(source for source in built if source is not None)
    accuracy = validated.table(AccuracyTable)
    return Machine(
        kernel=kernel,
        name=machine.name,
        description=machine.description.strip(),
        origin=machine.origin.strip(),
        file=document.name,
        file_hash=document.file_hash,
        settings=document.settings,
        condition=condition,
        workspace=workspace,
        accuracy=Accuracy()
        if accuracy is None
        else Accuracy(accuracy.target, accuracy.angle_target),
        drives=drives,
        struts=struts,
        sources=sources,
        file_units=validated.units.shown(),
    )


def _drives(validated: Validated) -> tuple[Drive, ...]:
    drives = []
    for common, geometry in zip(validated.rows(DriveTable), validated.geometry, strict=True):
        kind = drive_kinds()[common.kind]
        assert geometry is not None
        fields: dict[str, Any] = dict(geometry)
        travel = fields.pop("travel")
        drives.append(
            Drive(
                common.name,
                common.kind,
                kind.coordinate,
                travel,
                common.working_mode,
                fields,
                kind.drawing,
            )
        )
    return tuple(drives)


def _strut(row: StrutTable) -> Strut:
    material = MATERIALS.get(row.material or "")
    modulus, expansion = row.modulus, row.expansion
    if material is not None:
        modulus = material.modulus if modulus is None else modulus
        expansion = material.expansion if expansion is None else expansion
    return Strut(
        row.name, row.drive, row.section_area, modulus, expansion, row.stiffness, row.material
    )


def _condition(table: ConditionTable | None) -> Condition:
    if table is None:
        return Condition()
    reference = table.reference_temperature or ISO_1_REFERENCE_TEMPERATURE
    temperatures = dict(table.temperature or {})
    default = temperatures.pop(DEFAULT_PART, reference)
    force: Vector = (0.0, 0.0, 0.0)
    moment: Vector = (0.0, 0.0, 0.0)
    if table.cutting is not None:
        force = cutting_force(table.cutting)
    elif table.force is not None:
        force = (table.force.x, table.force.y, table.force.z)
    if table.moment is not None:
        moment = (table.moment.x, table.moment.y, table.moment.z)
    return Condition(reference, default, temperatures, force, moment)


def cutting_force(cutting: CuttingTable) -> Vector:
    """Force on the tool in N, base axes: each component is specific force x chip section.

    Gojtan & Hess-Coelho (2005): the chip's thickness times the depth, and times the width, of cut.
    """
    per_length = cutting.specific_force * cutting.chip_thickness
    x, y, z = (
        per_length * (cutting.depth * along_depth + cutting.width * along_width)
        for along_depth, along_width in zip(
            cutting.depth_direction, cutting.width_direction, strict=True
        )
    )
    return (x, y, z)


def _workspace(
    document: Document,
    validated: Validated,
    machine: MachineTable,
    problems: list[Problem],
) -> tuple[Workspace | None, dict[str, float]]:
    """The workspace and the home pose by freedom; what home does not name is 0."""
    table = validated.table(WorkspaceTable)
    if table is None:
        return None, {}
    commanded = machine.commanded or machine.dof
    line = document.line(("workspace",))
    home = {} if table.home is None else _home(table.home)
    if table.poses is not None:
        listed = _listed(document, table.poses, commanded, validated.units, problems)
        if table.home is None and len(listed):
            middle = 0.5 * (listed.min(axis=0) + listed.max(axis=0))
            home = dict(zip(commanded, middle.tolist(), strict=True))
        return Workspace(listed=listed, line=line), home
    axes = []
    for freedom in commanded:
        span = None if table.grid is None else getattr(table.grid, freedom)
        if span is None:
            stay = home.get(freedom, 0.0)
            span = (stay, stay, 1)
        axes.append(GridAxis(freedom, *span))
    if table.home is None:
        home = {axis.name: axis.centre for axis in axes}
    return Workspace(tuple(axes), line=line), home


def _home(table: HomeTable) -> dict[str, float]:
    return {freedom: getattr(table, freedom) for freedom in FREEDOMS}


def _listed(
    document: Document,
    poses: Sequence[Sequence[float | int | str]],
    commanded: Sequence[str],
    units: UnitSystem,
    problems: list[Problem],
) -> NDArray[np.float64]:
    """(n_pose, n_commanded) of the listed poses, SI; each column by its freedom's dimension."""
    result = np.zeros((len(poses), len(commanded)))
    for row, pose in enumerate(poses):
        for column, (value, freedom) in enumerate(zip(pose, commanded, strict=True)):
            try:
                result[row, column] = units.read(value, FREEDOMS[freedom])
            except QuantityError as error:
                problems.append(
                    document.problem(
                        error.code,
                        error.message,
                        ("workspace", "poses", row, column),
                        found=error.found,
                        expected=error.expected,
                        hint=error.hint,
                    )
                )
    return result


def _kernel_machine(
    document: Document,
    validated: Validated,
    machine: MachineTable,
    drives: Sequence[Drive],
    home: Mapping[str, float],
) -> _kernel.Machine:
    """The kernel's machine. What it alone can refuse becomes a problem of the file."""
    struts = zip(validated.rows(StrutTable), validated.rows(strut_geometry()), strict=True)
    description: dict[str, Any] = {
        "dof": list(machine.dof),
        "commanded": list(machine.commanded or machine.dof),
        "home": {freedom: value for freedom, value in home.items() if freedom in machine.dof},
        "tool": list(machine.tool),
        "characteristic_length": machine.characteristic_length,
        "drives": [
            {
                "name": drive.name,
                "kind": drive.kind,
                "travel": list(drive.travel),
                "working_mode": drive.working_mode,
                **{name: _plain(value) for name, value in drive.fields.items()},
            }
            for drive in drives
        ],
        "struts": [
            {
                "name": row.name,
                "drive": row.drive,
                **{name: _plain(value) for name, value in dict(geometry).items()},
            }
            for row, geometry in struts
        ],
    }
    try:
        return _kernel.Machine(description)
    except _kernel.KernelError as error:
        code, message, where = error.args
        key = document.key(where) if where else ()
        value = document.value(key)
        raise MachineFileError(
            document.problem(
                code if code in CATALOGUE else "not-buildable",
                message,
                key,
                found=None if isinstance(value, dict) else shown_value(value),
            )
        ) from None


def _plain(value: float | tuple[float, ...] | None) -> float | list[float] | None:
    return list(value) if isinstance(value, tuple) else value
