"""The parts and the condition of a machine, from the models of a file without problems."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, cast

from pydantic import BaseModel

from truepose.files.file_table import FileTable
from truepose.machine.chains import Beam, ChainJoint, Vector
from truepose.machine.condition import (
    DEFAULT_PART,
    ISO_1_REFERENCE_TEMPERATURE,
    STANDARD_GRAVITY,
    Condition,
    Envelope,
)
from truepose.machine.cutting import cutting_force, kienzle_force
from truepose.machine.elements import drive_kinds, strut_geometry
from truepose.machine.families.parameters import FamilyParameters
from truepose.machine.limbs import Limb
from truepose.machine.materials import MATERIALS
from truepose.machine.parts import Body, Drive, Guide, Joint, Strut, carriage_part
from truepose.machine.tables.body import CarriageTable, FrameTable, PlatformTable, ToolTable
from truepose.machine.tables.condition import ConditionTable
from truepose.machine.tables.drive import DriveTable
from truepose.machine.tables.force import AccelerationTable, ForceTable, MomentTable
from truepose.machine.tables.guide import GuideTable
from truepose.machine.tables.joint import JointTable
from truepose.machine.tables.limb import LimbPartTable, LimbTable, section_of
from truepose.machine.tables.mounting import MountingTable
from truepose.machine.tables.strut import StrutTable
from truepose.machine.validation import Model, Validated

_DIRECTIONS = ("axis", "normal")
"""Endings of the fields of drives and guides that are directions."""

_NOTHING: Vector = (0.0, 0.0, 0.0)


def drives(validated: Validated) -> tuple[Drive, ...]:
    """Every `[[drive]]`."""
    parts = []
    for common, geometry in _rows(validated, DriveTable, "drive"):
        kind = drive_kinds()[common.kind]
        fields: dict[str, Any] = dict(geometry)
        parts.append(
            Drive(
                common.name,
                common.kind,
                kind.coordinate,
                fields.pop("travel"),
                common.working_mode,
                drawing=kind.drawing,
                feedback=common.feedback,
                material=common.material,
                expansion=_expansion(common.material, common.expansion),
                fixed_at=fields.pop("fixed_at"),
                stiffness=fields.pop("stiffness"),
                mass=common.mass,
                carriage=_carriage(common) if kind.has_carriage else None,
                chain=tuple(_chain_part(part) for part in common.chain or ()),
                fields=fields,
            )
        )
    return tuple(parts)


def _carriage(row: DriveTable) -> Body:
    return _body(carriage_part(row.name), row.carriage or CarriageTable())


def family(validated: Validated, parts: Iterable[Drive | Guide]) -> FamilyParameters | None:
    """`[family]`, with the directions of the drives and guides."""
    if validated.family is None:
        return None
    return FamilyParameters(
        validated.family,
        {
            f"{part.part}.{key}": cast("Vector", value)
            for part in parts
            for key, value in part.fields.items()
            if key.endswith(_DIRECTIONS)
        },
    )


def guides(validated: Validated) -> tuple[Guide, ...]:
    """Every `[[guide]]`."""
    rows = _rows(validated, GuideTable, "guide")
    return tuple(Guide(common.name, common.kind, fields=dict(own)) for common, own in rows)


def _rows(validated: Validated, model: type[Model], table: str) -> list[tuple[Model, FileTable]]:
    """What every row of a table says in common, and in the model of its kind."""
    own = [model for model in validated.geometry.get(table, []) if model is not None]
    return list(zip(validated.rows(model), own, strict=True))


def limbs(validated: Validated) -> tuple[Limb, ...]:
    """Every `[[limb]]`."""
    return tuple(
        Limb(
            row.name,
            row.strut,
            tuple(row.guides),
            row.axis,
            tuple(_chain_part(part) for part in row.chain),
            row.mass,
            row.length,
            row.compliance,
        )
        for row in validated.rows(LimbTable)
    )


def _chain_part(row: LimbPartTable) -> ChainJoint | Beam:
    if row.joint is not None:
        given = {key: getattr(row, key) for key in ("radial", "axial", "across", "tilt", "axis")}
        said = {key: value for key, value in given.items() if value is not None}
        return ChainJoint(row.joint, **said)
    if row.beam == "rigid":
        return Beam(row.length, None, expansion=_expansion(row.material, row.expansion))
    material = MATERIALS.get(row.material or "")
    modulus = row.modulus if row.modulus is not None else material.modulus if material else None
    assert modulus is not None  # the table has looked
    shear = row.shear_modulus
    if shear is None:
        shear = modulus / (2.0 * (1.0 + (row.poisson_ratio or 0.0)))
    expansion = _expansion(row.material, row.expansion)
    return Beam(row.length, section_of(row), modulus, shear, expansion)


def struts(validated: Validated) -> tuple[Strut, ...]:
    """Every `[[strut]]`."""
    rows, own = validated.rows(StrutTable), validated.rows(strut_geometry())
    axes = [tuple(getattr(model, "ring_axis", None) or ()) for model in own]
    return tuple(
        _strut(row, axis if any(axis) else None) for row, axis in zip(rows, axes, strict=True)
    )


def _strut(row: StrutTable, ring_axis: Vector | None) -> Strut:
    material = MATERIALS.get(row.material or "")
    modulus = row.modulus
    if modulus is None and material is not None:
        modulus = material.modulus
    return Strut(
        row.name,
        row.drive,
        row.section_area,
        modulus,
        _expansion(row.material, row.expansion),
        row.stiffness,
        row.material,
        row.mass,
        row.centre_of_mass,
        _joint(row.base_joint),
        _joint(row.platform_joint),
        row.base_stiffness,
        ring_axis,
    )


def _joint(table: JointTable | None) -> Joint:
    return Joint() if table is None else Joint(**dict(table))


def _expansion(material: str | None, outright: float | None) -> float | None:
    if outright is not None or material is None:
        return outright
    return MATERIALS[material].expansion


def bodies(validated: Validated) -> tuple[Body, Body, Body]:
    """Platform, frame and tool."""
    platform = validated.table(PlatformTable) or PlatformTable()
    frame = validated.table(FrameTable) or FrameTable()
    held = validated.table(ToolTable) or ToolTable()
    return (
        _body("platform", platform, platform.mass, platform.centre_of_mass),
        _body("frame", frame),
        _body("tool", held),
    )


def _body(
    part: str,
    table: PlatformTable | FrameTable | ToolTable | CarriageTable,
    mass: float = 0.0,
    centre_of_mass: Vector = _NOTHING,
) -> Body:
    expansion = _expansion(table.material, table.expansion)
    anchor = _NOTHING if isinstance(table, CarriageTable) else table.anchor
    return Body(part, mass, centre_of_mass, table.material, expansion, anchor)


def mounting(validated: Validated) -> Vector:
    """Angles a, b, c of the base frame in the workshop, rad."""
    table = validated.table(MountingTable) or MountingTable()
    return (table.a, table.b, table.c)


def condition(table: ConditionTable | None, source_tables: Iterable[BaseModel]) -> Condition:
    """`[condition]`, without its temperature log; `source_tables`: of the keys of sources."""
    if table is None:
        return Condition(source_tables=tuple(source_tables))
    reference = table.reference_temperature or ISO_1_REFERENCE_TEMPERATURE
    temperatures = dict(table.temperature or {})
    default = temperatures.pop(DEFAULT_PART, reference)
    force = _vector(table.force)
    if table.cutting is not None:
        force = cutting_force(table.cutting)
    elif table.kienzle is not None:
        force = kienzle_force(table.kienzle)
    envelope = table.envelope
    return Condition(
        reference,
        default,
        temperatures,
        force,
        _vector(table.moment),
        table.gradient or {},
        time=table.time,
        gravity=STANDARD_GRAVITY if table.gravity is None else table.gravity,
        acceleration=_vector(table.acceleration),
        envelope=None
        if envelope is None
        else Envelope(envelope.force, envelope.normal, envelope.varies),
        source_tables=tuple(source_tables),
    )


def _vector(table: ForceTable | MomentTable | AccelerationTable | None) -> Vector:
    return _NOTHING if table is None else (table.x, table.y, table.z)
