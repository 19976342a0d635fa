"""Dimensional tolerance: a parameter lies somewhere in a band about its nominal value.

A band [lower, upper] is the deviation `shift = (lower + upper) / 2` with
`half = (upper - lower) / 2`; an asymmetric one thus has a part that can be compensated. It comes
from `length_tolerance` of a strut, or from the `[tolerance]` table, whose keys are patterns over
the parameter names. `docs/sources/tolerance.md` has the rules and references.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from pydantic import BaseModel, ConfigDict

from truepose.machine.dimensions import BY_UNIT
from truepose.machine.quantity import LengthTolerance
from truepose.sources._base import Block, Deviation

if TYPE_CHECKING:
    from truepose.machine import Band, Condition, FileParts, Machine

_EDGE_ENDINGS = (".length", ".offset")


class StrutTolerance(BaseModel):
    """What a `[[strut]]` says about its tolerance."""

    length_tolerance: LengthTolerance | None = None


class ToleranceTable(BaseModel):
    """The `[tolerance]` table: a pattern over parameter names = its band."""

    model_config = ConfigDict(extra="allow")


@dataclass(frozen=True)
class Tolerance:
    """Bands of any parameters, the same at every pose, each by itself."""

    name: ClassVar[str] = "tolerance"
    doc: ClassVar[str] = "dimensional tolerance of lengths, coordinates, offsets and directions"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {
        "strut": StrutTolerance,
        "tolerance": ToleranceTable,
    }
    sets_overall_edges: ClassVar[bool] = True

    bands: Deviation

    @classmethod
    def build(cls, parts: FileParts) -> Self | None:
        """From `length_tolerance` and `[tolerance]`; None where neither says anything."""
        names = parts.kernel.parameters
        bands = _strut_bands(parts) | _table_bands(parts)
        if not bands:
            return None
        columns = sorted(bands)
        return cls(
            Deviation.of(
                columns,
                [bands[column].shift for column in columns],
                [bands[column].half for column in columns],
                edge=[names[column].endswith(_EDGE_ENDINGS) for column in columns],
            )
        )

    def acts(self, condition: Condition) -> bool:
        """In every condition."""
        return True

    def deviation(self, machine: Machine, condition: Condition, block: Block) -> Deviation:
        """The bands, m or rad or 1, (1, k)."""
        return self.bands


def _strut_bands(parts: FileParts) -> dict[int, Band]:
    bands: dict[int, Band] = {}
    sizes: np.ndarray | None = None
    for index, row in enumerate(parts.rows(StrutTolerance)):
        if row.length_tolerance is None:
            continue
        # ISO classes go by the nominal size; a telescopic strut has the one of its home pose.
        sizes = _strut_sizes(parts) if sizes is None else sizes
        path = f"strut.{parts.struts[index].name}.length_tolerance"
        band = parts.band(row.length_tolerance, float(sizes[index]), path)
        if band is not None:
            bands[int(parts.kernel.length_parameters[index])] = band
    return bands


def _strut_sizes(parts: FileParts) -> np.ndarray:
    kernel = parts.kernel
    at = [kernel.dof.index(freedom) for freedom in kernel.commanded]
    joints, placements, _ = kernel.place(np.asarray(kernel.home)[at][np.newaxis, :])
    sizes = np.array(kernel.lengths_at(joints, placements)[0])
    for index, column in enumerate(kernel.length_parameters):
        if kernel.parameters[column].endswith(".length"):
            sizes[index] = kernel.nominal[column]
    return sizes


def _table_bands(parts: FileParts) -> dict[int, Band]:
    """Bands of the `[tolerance]` table, by parameter.

    A full parameter name goes before a pattern, as does a strut's own `length_tolerance` (a
    pattern is a default); two patterns, or two full names, for one parameter are refused.
    """
    table = parts.table(ToleranceTable)
    if table is None:
        return {}
    names = parts.kernel.parameters
    taken = {
        int(parts.kernel.length_parameters[index]): f"strut.{strut.name}.length_tolerance"
        for index, (strut, row) in enumerate(
            zip(parts.struts, parts.rows(StrutTolerance), strict=True)
        )
        if row.length_tolerance is not None
    }
    own = set(taken)
    bands: dict[int, Band] = {}
    entries = sorted((table.model_extra or {}).items(), key=lambda entry: entry[0] not in names)
    exact = own | {names.index(key) for key, _ in entries if key in names}
    for key, value in entries:
        path = f"tolerance.{key}"
        matches = [i for i, name in enumerate(names) if name == key or fnmatchcase(name, key)]
        if not matches:
            parts.refuse(
                "tolerance-matches-nothing",
                f"no parameter of this machine matches {key!r}",
                path,
                found=key,
                expected='a parameter name, or a pattern such as "strut.*.base.x"',
                hint=parts.suggest(key, _patterns(names) if "*" in key else names),
            )
        for column in matches:
            if key not in names and column in exact:
                continue
            if column in taken:
                parts.refuse(
                    "tolerance-twice",
                    f"parameter {names[column]} is given a tolerance twice",
                    path,
                    found=f"{path} and {taken[column]}",
                    expected="one tolerance for one parameter",
                    hint="a full parameter name goes before a pattern",
                )
                continue
            taken[column] = path
            dimension = BY_UNIT[parts.kernel.units[column]]
            tolerance = parts.tolerance(value, dimension, path)
            if tolerance is None:
                break
            band = parts.band(tolerance, float(parts.kernel.nominal[column]), path)
            if band is not None:
                bands[column] = band
    return bands


def _patterns(names: tuple[str, ...]) -> list[str]:
    """Each parameter for every drive or strut: "strut.1.base.x" gives "strut.*.base.x"."""
    split = [name.split(".") for name in names]
    return list(dict.fromkeys(".".join([s[0], "*", *s[2:]]) for s in split if len(s) > 2))
