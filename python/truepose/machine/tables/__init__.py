"""The tables of a machine file: one table = one file.

Each table belongs to one or more models, its owners: the file's own ones here, the elements' from
the kernel, and the error sources' from the registry that the loader is given.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from pydantic import BaseModel

from truepose.machine.elements import strut_geometry
from truepose.machine.tables.accuracy import AccuracyTable
from truepose.machine.tables.body import FrameTable, PlatformTable, ToolTable
from truepose.machine.tables.calibration import CalibrationTable
from truepose.machine.tables.condition import ConditionTable
from truepose.machine.tables.controller import ControllerTable
from truepose.machine.tables.cost import CostTable
from truepose.machine.tables.drive import DriveTable
from truepose.machine.tables.family import FamilyTable
from truepose.machine.tables.guide import GuideTable
from truepose.machine.tables.limb import LimbTable
from truepose.machine.tables.machine import MachineTable
from truepose.machine.tables.mounting import MountingTable
from truepose.machine.tables.strut import StrutTable
from truepose.machine.tables.units import UnitsTable
from truepose.machine.tables.workspace import WorkspaceTable

SCHEMA = 1
"""The version of the machine file that this package reads: its key `schema`."""

REQUIRED = ("machine", "drive", "strut")
"""Tables without which there is no machine."""


@dataclass(frozen=True)
class Owners:
    """Which models read which table; drives have their kind's model besides."""

    by_table: Mapping[str, tuple[type[BaseModel], ...]]

    @property
    def free_tables(self) -> frozenset[str]:
        """Tables with an owner that takes every key, such as patterns of parameter names."""
        return frozenset(
            table
            for table, models in self.by_table.items()
            if any(takes_every_key(model) for model in models)
        )


def takes_every_key(model: type[BaseModel]) -> bool:
    """Whether a model reads keys that it does not name."""
    return model.model_config.get("extra") == "allow"


def owners(added: Iterable[Mapping[str, type[BaseModel]]]) -> Owners:
    """The file's own models and the `added` ones of each source, by table.

    Raises `ValueError` where two of them read one key: a defect of the registry, not of a file.
    """
    every: dict[str, list[type[BaseModel]]] = {
        "machine": [MachineTable],
        "units": [UnitsTable],
        "family": [FamilyTable],
        "drive": [DriveTable],
        "strut": [StrutTable, strut_geometry()],
        "guide": [GuideTable],
        "limb": [LimbTable],
        "platform": [PlatformTable],
        "frame": [FrameTable],
        "tool": [ToolTable],
        "mounting": [MountingTable],
        "condition": [ConditionTable],
        "workspace": [WorkspaceTable],
        "accuracy": [AccuracyTable],
        "controller": [ControllerTable],
        "calibration": [CalibrationTable],
        "cost": [CostTable],
    }
    for tables in added:
        for table, model in tables.items():
            models = every.setdefault(table, [])
            if model not in models:
                models.append(model)
    for table, models in every.items():
        keys = [key for model in models for key in model.model_fields]
        doubled = {key for key in keys if keys.count(key) > 1}
        if doubled:
            raise ValueError(f"[{table}]: read by two models: {sorted(doubled)}")
    return Owners({table: tuple(models) for table, models in every.items()})
