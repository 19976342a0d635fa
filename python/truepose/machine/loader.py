"""A machine file -> `Machine`: read, validate, check, hand to the kernel, ask the sources."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path

from pydantic import BaseModel

from truepose.errors import ArgumentError, Fault, MachineFileError, Problem, in_order
from truepose.files.data_file import DataFiles
from truepose.files.document import Document, document_of, read
from truepose.files.settings import apply, require_settings
from truepose.files.units import shown_value
from truepose.machine import (
    build_costs,
    build_kernel,
    build_parts,
    build_workspace,
    checks,
    validation,
)
from truepose.machine.cases import share_condition
from truepose.machine.condition import Condition
from truepose.machine.families.expansion import TABLE as FAMILY
from truepose.machine.families.expansion import expand
from truepose.machine.model import Machine
from truepose.machine.parts import BODIES, Drive, Strut
from truepose.machine.shared_keys import share_each
from truepose.machine.source_builder import ErrorSource, SourceBuilder, SourceType
from truepose.machine.tables import SCHEMA, owners
from truepose.machine.tables.accuracy import AccuracyTable
from truepose.machine.tables.calibration import CalibrationTable
from truepose.machine.tables.condition import ConditionTable
from truepose.machine.tables.controller import ControllerTable
from truepose.machine.tables.machine import MachineTable
from truepose.machine.temperature_log import read_temperature_log
from truepose.machine.validation import Validated
from truepose.machine.workspace import Accuracy


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
    leads nowhere, `ArgumentError` for a path or settings of another kind.
    """
    if not isinstance(path, str | PathLike):
        raise ArgumentError.of("path", path, "the name of a machine file")
    require_settings(settings)
    return _loaded(read(path), settings, registry)


def load_text(
    path: str | Path,
    text: str,
    *,
    settings: Mapping[str, str] | Sequence[str] = (),
    registry: Sequence[SourceType],
) -> Machine:
    """The machine of a text as a machine file at `path` would have it, whether one is there or not.

    Raises `MachineFileError` with every problem of the text, `RequestError` for a setting that
    leads nowhere.
    """
    return _loaded(document_of(path, text.encode(), text), settings, registry)


def _loaded(
    document: Document, settings: Mapping[str, str] | Sequence[str], registry: Sequence[SourceType]
) -> Machine:
    owned = owners(source.tables for source in registry)
    expansion = expand(document, settings, owned)
    share_each(document, settings, owned.free_tables)
    apply(document, settings, owned.free_tables)
    share_condition(document)
    _require_schema(document)
    validated, problems = validation.validate(document, owned)
    if validated.family is None and FAMILY in document.data:
        _raise(problem for problem in problems if not expansion.explains(document, problem))
    problems += [*expansion.problems, *checks.check(document, validated)]
    _raise(problems)
    return _built(document, validated, registry)


def _raise(problems: Iterable[Problem]) -> None:
    """All problems at once, each once: file by file, in each file's order."""
    every = in_order(problems)
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
            Fault(
                "unsupported-schema",
                "this version of truepose does not read such a machine file",
                found=shown_value(schema),
                expected=str(SCHEMA),
                hint="a newer version of truepose may read it"
                if isinstance(schema, int) and schema > SCHEMA
                else None,
            ),
            ("schema",),
        )
    )


def _built(document: Document, validated: Validated, registry: Sequence[SourceType]) -> Machine:
    machine = validated.table(MachineTable)
    assert machine is not None
    problems: list[Problem] = []
    data_files = DataFiles(document)
    drives = build_parts.drives(validated)
    struts = build_parts.struts(validated)
    of_sources = tuple(
        dict.fromkeys(s.tables["condition"] for s in registry if "condition" in s.tables)
    )
    condition, *of_cases = (
        _condition(one, data_files, drives, struts, of_sources)
        for one in (validated, *validated.cases.values())
    )
    workspace, home = build_workspace.workspace(document, validated, data_files, problems)
    _raise([*problems, *data_files.problems])
    guides = build_parts.guides(validated)
    limbs = build_parts.limbs(validated)
    described = build_kernel.Described(document, validated, drives, struts, guides, limbs, home)
    kernel = build_kernel.kernel(described)
    _raise(build_kernel.problems(described, kernel))
    platform, frame, tool = build_parts.bodies(validated)
    family = build_parts.family(validated, (*drives, *guides))
    parts = SourceBuilder(
        document,
        validated,
        kernel,
        drives=drives,
        struts=struts,
        guides=guides,
        limbs=limbs,
        bodies=(platform, frame, tool),
        condition=condition,
        data_files=data_files,
        family=family,
    )
    built = [source.build(parts) for source in registry]
    priced = build_costs.costs(
        document,
        validated,
        kernel,
        family,
        [
            *(row.part for rows in (drives, struts, guides, limbs) for row in rows),
            *BODIES,
        ],
        data_files,
        parts.problems,
    )
    _raise([*parts.problems, *data_files.problems])
    sources: tuple[ErrorSource, ...] = tuple(source for source in built if source is not None)
    accuracy = validated.table(AccuracyTable)
    controller = validated.table(ControllerTable)
    return Machine(
        kernel=kernel,
        name=machine.name,
        description=machine.description.strip(),
        origin=machine.origin.strip(),
        serial=machine.serial.strip(),
        date=machine.date.strip(),
        file=document.name,
        file_hash=document.file_hash,
        settings=document.settings,
        condition=condition,
        workspace=workspace,
        accuracy=_accuracy(document, validated, accuracy),
        drives=drives,
        struts=struts,
        guides=guides,
        limbs=limbs,
        sources=sources,
        file_units=validated.units.shown(),
        platform=platform,
        frame=frame,
        tool=tool,
        mounting=build_parts.mounting(validated),
        data_files=data_files.hashes,
        calibration=validated.table(CalibrationTable),
        controller_holds=None if controller is None else controller.holds,
        family=family,
        path=os.path.abspath(document.file),  # noqa: PTH100  links stay
        cases=dict(zip(validated.cases, of_cases, strict=True)),
        costs=priced,
    )


def _accuracy(document: Document, validated: Validated, table: AccuracyTable | None) -> Accuracy:
    """What is asked, and how it was said: a bare number with the file's unit."""
    if table is None:
        return Accuracy()
    units = validated.units.shown()

    def said(key: str, dimension: str) -> str:
        given = document.value(("accuracy", key))
        try:
            return f"{float(given):.15g} {units[dimension].label}"
        except (TypeError, ValueError):
            return "" if given is None else str(given).strip()

    return Accuracy(
        table.target,
        table.angle_target,
        said("target", "length"),
        said("angle_target", "angle"),
        table.at,
    )


def _condition(
    validated: Validated,
    data_files: DataFiles,
    drives: Sequence[Drive],
    struts: Sequence[Strut],
    of_sources: Iterable[type[BaseModel]],
) -> Condition:
    """The condition with its temperature log and the keys that sources bring."""
    table = validated.table(ConditionTable)
    source_tables = [validated.table(model) or model() for model in of_sources]
    condition = build_parts.condition(table, source_tables)
    if table is None or table.temperature_log is None:
        return condition
    carriages = [drive.carriage.part for drive in drives if drive.carriage is not None]
    rows = [*(drive.part for drive in drives), *(strut.part for strut in struts)]
    parts = [*rows, *carriages, *BODIES]
    log = read_temperature_log(
        data_files, table.temperature_log, parts, table.time, condition.part_temperatures
    )
    return condition if log is None else condition.replace(temperature_log=log)
