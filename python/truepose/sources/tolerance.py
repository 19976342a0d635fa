"""Dimensional tolerance: a parameter lies somewhere in a band about its nominal value.

A band [lower, upper] is the deviation `shift = (lower + upper) / 2` with
`half = (upper - lower) / 2`; an asymmetric one thus has a part that can be compensated. It comes
from `length_tolerance` of a strut, or from the `[tolerance]` table, whose keys are patterns over
the parameter names. What is made in one set-up varies together: members of one group share one
variable; what is made alike may be correlated. `docs/sources/tolerance.md` has the rules and
references.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from truepose.errors import Fault
from truepose.files.data_file import Column
from truepose.files.dimensions import BY_UNIT, DIMENSIONS
from truepose.files.quantity import LengthTolerance
from truepose.files.tolerance import LISTED, Band
from truepose.files.varies import HINT
from truepose.files.wording import one_of
from truepose.machine.families.parameters import is_of_family
from truepose.machine.parts import gives_way_only
from truepose.probability.distributions import (
    ARCSINE,
    TRIANGULAR,
    TWO_POINT,
    UNIFORM,
    Distribution,
    Listed,
    discrete,
    empirical,
    normal,
    student_t,
)
from truepose.representation import Represented
from truepose.sources._correlation import CorrelationTable, read_correlation
from truepose.sources.deviation import OWN_GROUP, Deviation, GroupQuantity
from truepose.sources.pose_block import PoseBlock
from truepose.sources.variation import WITH_MACHINE, Variation, variation

if TYPE_CHECKING:
    from truepose.files import tolerance as file_tolerance
    from truepose.machine import Condition, Machine, SourceBuilder

EDGE_ENDINGS = (".length", ".offset")
"""Of parameters that the overall error's minimum and maximum move to the ends of their bands."""

_WILDCARDS = frozenset("*?[")
_RANKS = 3

_WITHOUT_NUMBERS = {
    distribution.name: distribution for distribution in (UNIFORM, TRIANGULAR, ARCSINE, TWO_POINT)
}

DEVIATION = "deviation"
"""The column of a file of measured deviations."""


class StrutTolerance(BaseModel):
    """What a `[[strut]]` says about its tolerance."""

    length_tolerance: LengthTolerance | None = Field(
        None, description="Tolerance of the length, or of a telescopic strut's offset."
    )


class ToleranceTable(BaseModel):
    """The `[tolerance]` table: a pattern over parameter names = its band."""

    model_config = ConfigDict(extra="allow")


@dataclass(frozen=True)
class _Stated:
    """What the file says of one parameter, and where."""

    path: str
    tolerance: file_tolerance.Tolerance
    band: Band
    distribution: Distribution


@dataclass(frozen=True)
class _Member:
    """A column of the bands: the parameter, what moves it, and by how much of its variable.

    `family`: the family's parameter whose deviation the variable is; None: the column's own.
    """

    column: int
    stated: _Stated
    effect: float = 1.0
    family: str | None = None

    @property
    def group(self) -> str | None:
        return self.family or self.stated.tolerance.group

    @property
    def variation(self) -> Variation:
        return variation(self.stated.tolerance.varies, WITH_MACHINE)


@dataclass(frozen=True, repr=False)
class DimensionalTolerance(Represented):
    """Bands of any parameters, the same at every pose; members of a group vary together.

    `idle`: patterns of `[tolerance]` all of whose parameters have another, each with a parameter
    and the key that counts for it.
    """

    name: ClassVar[str] = "tolerance"
    doc: ClassVar[str] = "dimensional tolerance of lengths, coordinates, offsets and directions"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {
        "strut": StrutTolerance,
        "tolerance": ToleranceTable,
        "correlation": CorrelationTable,
    }
    sets_overall_edges: ClassVar[bool] = True

    bands: Deviation
    idle: tuple[tuple[str, str, str], ...] = ()

    @classmethod
    def build(cls, parts: SourceBuilder) -> Self | None:
        """From `length_tolerance` and `[tolerance]`; None where neither says anything."""
        stated = _of_struts(parts)
        of_table, idle = _of_table(parts, stated)
        stated |= of_table
        entries = [_Member(column, stated[column]) for column in sorted(stated)]
        if _mixed_groups(parts, [member.stated for member in entries]):
            return None
        quantities: dict[str, GroupQuantity] = {}
        entries += _of_family(parts, quantities)
        names = parts.kernel.parameters
        groups = list(dict.fromkeys(m.group for m in entries if m.group is not None))
        edges = {
            group: all(names[m.column].endswith(EDGE_ENDINGS) for m in entries if m.group == group)
            for group in quantities
        }
        bands = Deviation.of(
            [member.column for member in entries],
            [member.stated.band.shift * member.effect for member in entries],
            [member.stated.band.half * abs(member.effect) for member in entries],
            groups=[OWN_GROUP if m.group is None else groups.index(m.group) for m in entries],
            sign=[math.copysign(1.0, m.effect) * m.stated.tolerance.sign for m in entries],
            edge=[
                edges.get(m.group or "", names[m.column].endswith(EDGE_ENDINGS)) for m in entries
            ],
            distribution=[member.stated.distribution for member in entries],
            variation=[member.variation for member in entries],
            group_names=dict(enumerate(groups)),
            group_quantities={groups.index(group): one for group, one in quantities.items()},
        )
        # A tolerance that is wrong would be missed here, and told twice.
        correlation = None if parts.problems else read_correlation(parts, bands)
        return cls(replace(bands, correlation=correlation), tuple(idle)) if entries else None

    def acts(self, condition: Condition) -> bool:
        """In every condition."""
        return True

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        """The bands, m or rad or 1, (1, k)."""
        return self.bands


def bands_of(machine: Machine) -> Deviation | None:
    """The bands of the machine's tolerances; None where its file has none."""
    of_tolerances = (
        source.bands for source in machine.sources if isinstance(source, DimensionalTolerance)
    )
    return next(of_tolerances, None)


def _mixed_groups(parts: SourceBuilder, entries: Iterable[_Stated]) -> bool:
    """Whether a group has two distributions, or varies in two ways, though it is one variable.

    A problem, if so.
    """
    first: dict[str, _Stated] = {}
    refused = set()
    for entry in entries:
        group = entry.tolerance.group
        if group is None or entry.path in refused:
            continue
        other = first.setdefault(group, entry)
        if other.distribution != entry.distribution:
            refused.add(entry.path)
            parts.refuse(
                Fault(
                    "group-distributions",
                    f"the members of group {group!r} vary together, but have two distributions",
                    found=f"{entry.distribution}, and {other.distribution} of {other.path}",
                    expected="one distribution in one group",
                ),
                entry.path,
            )
        elif other.tolerance.varies != entry.tolerance.varies:
            refused.add(entry.path)
            parts.refuse(
                Fault(
                    "excluding-keys",
                    f"the members of group {group!r} vary together, but not with the same",
                    found=f'varies = "{entry.tolerance.varies}", and "{other.tolerance.varies}" of '
                    f"{other.path}",
                    expected="one word in one group",
                    hint=HINT,
                ),
                entry.path,
            )
    return bool(refused)


def _of_struts(parts: SourceBuilder) -> dict[int, _Stated]:
    """What the struts say of their lengths, by parameter."""
    stated: dict[int, _Stated] = {}
    sizes: np.ndarray | None = None
    for index, row in enumerate(parts.rows(StrutTolerance)):
        if row.length_tolerance is None:
            continue
        # ISO classes go by the nominal size; a telescopic strut has the one of its home pose.
        sizes = _strut_sizes(parts) if sizes is None else sizes
        path = f"strut.{parts.struts[index].name}.length_tolerance"
        entry = _entry(parts, row.length_tolerance, float(sizes[index]), path)
        if entry is not None:
            stated[int(parts.kernel.length_parameters[index])] = entry
    return stated


def _strut_sizes(parts: SourceBuilder) -> np.ndarray:
    kernel = parts.kernel
    at = [kernel.dof.index(freedom) for freedom in kernel.commanded]
    joints, placements, _ = kernel.place(np.asarray(kernel.home)[at][np.newaxis, :])
    sizes = np.array(kernel.lengths_at(joints, placements)[0])
    for index, column in enumerate(kernel.length_parameters):
        if kernel.parameters[column].endswith(".length"):
            sizes[index] = kernel.nominal[column]
    return sizes


def _entries(parts: SourceBuilder) -> Mapping[str, object]:
    """The `[tolerance]` table."""
    table = parts.table(ToleranceTable)
    return {} if table is None else table.model_extra or {}


def _of_table(
    parts: SourceBuilder, of_struts: Mapping[int, _Stated]
) -> tuple[dict[int, _Stated], list[tuple[str, str, str]]]:
    """What the `[tolerance]` table says, by parameter, and its patterns that are idle.

    A full parameter name goes before a pattern that names its part, and that before any other; a
    strut's own `length_tolerance` counts as a full name. Two of one kind for one parameter are
    refused, and a setting that is idle.
    """
    idle: list[tuple[str, str, str]] = []
    entries = {key: value for key, value in _entries(parts).items() if not is_of_family(key)}
    names = parts.kernel.parameters
    stated: dict[int, _Stated] = {}
    taken = {column: stated_before.path for column, stated_before in of_struts.items()}
    decided: set[int] = set()
    for rank in range(_RANKS):
        for key in entries:
            if _rank(key, names) != rank:
                continue
            matches = [
                i
                for i, name in enumerate(names)
                if name == key or (fnmatchcase(name, key) and not gives_way_only(name))
            ]
            if not _is_one_kind(parts, key, matches, entries[key]):
                continue
            columns = [column for column in matches if column not in decided]
            if not columns:
                idle.append((key, names[matches[0]], taken[matches[0]]))
                if parts.is_set(f"tolerance.{key}"):
                    parts.refuse(_without_effect(*idle[-1]), f"tolerance.{key}")
                continue
            if _is_twice(parts, key, columns, taken):
                continue
            taken |= dict.fromkeys(columns, f"tolerance.{key}")
            stated |= _stated(parts, key, columns, entries[key])
        decided = set(taken)
    return stated, idle


def _of_family(parts: SourceBuilder, quantities: dict[str, GroupQuantity]) -> list[_Member]:
    """What the `[tolerance]` table says of the family's parameters: a column each that they move.

    `quantities` is filled with what they are. A parameter that they move may have a tolerance of
    its own too.
    """
    members: list[_Member] = []
    named = {key: value for key, value in _entries(parts).items() if is_of_family(key)}
    known = () if parts.family is None else parts.family.names
    # In the family's order, whichever the file has.
    for key in sorted(named, key=lambda key: known.index(key) if key in known else -1):
        value = named[key]
        if not _is_of_family(parts, key, value):
            continue
        assert parts.family is not None
        path = f"tolerance.{key}"
        tolerance = parts.tolerance(value, parts.family.dimension(key), path)
        if tolerance is None:
            continue
        entry = _entry(parts, tolerance, parts.family.value(key), path)
        if entry is None:
            continue
        quantities[key] = GroupQuantity(entry.band.shift, entry.band.half, parts.family.unit(key))
        names = parts.kernel.parameters
        moved = {names.index(name): slope for name, slope in parts.family.effects(key).items()}
        members += [_Member(column, entry, moved[column], key) for column in sorted(moved)]
    return members


def _is_of_family(parts: SourceBuilder, key: str, value: object) -> bool:
    """Whether a key is a parameter of the family, varying by itself; a problem, if not."""
    path = f"tolerance.{key}"
    if parts.family is None or key not in parts.family.names:
        known = () if parts.family is None else parts.family.names
        parts.refuse(
            Fault(
                "tolerance-matches-nothing",
                f"no parameter of this machine's family is called {key!r}"
                if known
                else "the file has no [family]",
                found=key,
                expected=one_of(known) if known else "a [family], or names of joint centres",
                hint=parts.suggest(key, known),
            ),
            path,
        )
        return False
    if isinstance(value, dict) and ("group" in value or "sign" in value):
        parts.refuse(
            Fault(
                "excluding-keys",
                "a parameter of the family is a variable by itself, in no other group",
                found="group" if "group" in value else "sign",
                expected="no such key; what varies with it is told by [[correlation]]",
            ),
            path,
        )
        return False
    return True


def _without_effect(key: str, name: str, by: str) -> Fault:
    return Fault(
        "tolerance-without-effect",
        f"{key!r} changes nothing: what it matches has a tolerance that says more exactly which",
        found=f"for {name}, say: {by}",
        expected="a pattern that some parameter is left for",
        hint="change or remove the other; a strut's length_tolerance counts as its full name",
    )


def _rank(key: str, names: Iterable[str]) -> int:
    """0: a full name, 1: a pattern that names its part, 2: any other; the lower goes first."""
    if key in names:
        return 0
    part = key.split(".")[:2]
    return 1 if len(part) == 2 and not _WILDCARDS & set("".join(part)) else 2


def _is_one_kind(parts: SourceBuilder, key: str, matches: list[int], value: object) -> bool:
    """Whether a key stands for parameters of one dimension, at least one; a problem, if not."""
    names = parts.kernel.parameters
    path = f"tolerance.{key}"
    if not matches:
        known = tuple(name for name in names if not gives_way_only(name))
        nested = isinstance(value, dict) and not _WILDCARDS & set(key) and "." not in key
        parts.refuse(
            Fault(
                "tolerance-matches-nothing",
                f"no parameter of this machine matches {key!r}",
                found=key,
                expected='a parameter name, or a pattern such as "strut.*.base.x"',
                hint='a name with points stands in quotation marks: "strut.1.base.x" = 0.05'
                if nested
                else parts.suggest(key, _patterns(known) if "*" in key else known),
            ),
            path,
        )
        return False
    kinds: dict[str, str] = {}
    for column in matches:
        kinds.setdefault(BY_UNIT[parts.kernel.units[column]], names[column])
    if len(kinds) > 1:
        parts.refuse(
            Fault(
                "tolerance-mixes-kinds",
                f"{key!r} matches {' and '.join(DIMENSIONS[kind].plural for kind in kinds)}",
                found=", ".join(kinds.values()),
                expected="one tolerance for parameters of one kind",
                hint='a pattern for each kind, such as "drive.*.offset"',
            ),
            path,
        )
        return False
    return True


def _is_twice(parts: SourceBuilder, key: str, columns: list[int], taken: Mapping[int, str]) -> bool:
    """Whether another key of the same rank has one of the parameters; a problem, if so."""
    doubled = [column for column in columns if column in taken]
    for column in doubled[:1]:
        more = f", as are {len(doubled) - 1} more" if len(doubled) > 1 else ""
        parts.refuse(
            Fault(
                "tolerance-twice",
                f"parameter {parts.kernel.parameters[column]} is given a tolerance twice{more}",
                found=f"tolerance.{key} and {taken[column]}",
                expected="one tolerance for one parameter",
                hint="a full parameter name goes before a pattern, "
                "and a pattern that names a part before one that does not",
            ),
            f"tolerance.{key}",
        )
    return bool(doubled)


def _stated(
    parts: SourceBuilder, key: str, columns: list[int], value: object
) -> dict[int, _Stated]:
    """One entry of the table for each of its parameters; nothing, and a problem, if it is wrong."""
    path = f"tolerance.{key}"
    if not columns:
        return {}
    tolerance = parts.tolerance(value, BY_UNIT[parts.kernel.units[columns[0]]], path)
    if tolerance is None:
        return {}
    listed = _listed(parts, tolerance, path)
    stated: dict[int, _Stated] = {}
    for column in columns:
        size = float(parts.kernel.nominal[column])
        entry = _with_band(parts, tolerance, listed, size, path)
        if entry is None:
            break
        name = parts.kernel.parameters[column]
        if gives_way_only(name) and entry.band.half > 0.0:
            parts.refuse(_of_offset(name), path)
            break
        stated[column] = entry
    return stated


def _of_offset(name: str) -> Fault:
    return Fault(
        "tolerance-of-offset",
        f"{name} is what a limb gives way by, and has no tolerance",
        found="a band",
        expected="a known value, [v, v], or no entry",
        hint="as an error it would repeat lengths, origins and directions: give those a tolerance",
    )


def _entry(
    parts: SourceBuilder, tolerance: file_tolerance.Tolerance, nominal: float, path: str
) -> _Stated | None:
    """A tolerance of a parameter of so much nominal value; None, and a problem, if bad."""
    return _with_band(parts, tolerance, _listed(parts, tolerance, path), nominal, path)


def _with_band(
    parts: SourceBuilder,
    tolerance: file_tolerance.Tolerance,
    listed: Listed | None,
    nominal: float,
    path: str,
) -> _Stated | None:
    if listed is not None:
        band = Band(listed.centre - listed.half, listed.centre + listed.half)
        return _Stated(path, tolerance, band, listed.distribution)
    if tolerance.distribution in LISTED:
        return None  # and the problem is recorded
    limits = parts.band(tolerance, nominal, path)
    if limits is None:
        return None
    return _Stated(path, tolerance, limits, _distribution(tolerance))


def _distribution(tolerance: file_tolerance.Tolerance) -> Distribution:
    """That of a band; listed values bring their own."""
    if tolerance.dof is not None:
        return student_t(tolerance.dof, tolerance.sigmas)
    return _WITHOUT_NUMBERS.get(tolerance.distribution) or normal(tolerance.sigmas)


def _listed(parts: SourceBuilder, tolerance: file_tolerance.Tolerance, path: str) -> Listed | None:
    """Listed values as a band; None where there are none, or, with a problem, no good ones."""
    if tolerance.data is not None:
        columns = (Column(DEVIATION, tolerance.dimension),)
        table = parts.data_file(tolerance.data, columns, f"{path}.data")
        return None if table is None else empirical(table.numbers[DEVIATION].tolist())
    if not tolerance.values:
        return None
    if not tolerance.probabilities:
        return empirical(tolerance.values)
    try:
        return discrete(tolerance.values, tolerance.probabilities)
    except ValueError as error:
        parts.refuse(
            Fault(
                "bad-distribution",
                f"these values and probabilities are no distribution: {error}",
                found=", ".join(f"{probability:g}" for probability in tolerance.probabilities),
                expected="a probability from 0 to 1 of each value, their sum 1",
            ),
            path,
        )
        return None


def _patterns(names: tuple[str, ...]) -> list[str]:
    """Each parameter for every drive or strut: "strut.1.base.x" gives "strut.*.base.x"."""
    split = [name.split(".") for name in names]
    return list(dict.fromkeys(".".join([s[0], "*", *s[2:]]) for s in split if len(s) > 2))
