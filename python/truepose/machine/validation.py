"""A document against the models that own its tables; every problem of it at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar, cast, get_args

from pydantic import BaseModel, ValidationError

from truepose.errors import CATALOGUE, Fault, Problem
from truepose.files.document import SEVERAL, Document, Key
from truepose.files.file_table import FileTable
from truepose.files.units import FileUnit, UnitSystem, shown_value, type_phrase
from truepose.files.wording import did_you_mean, nearest, one_of
from truepose.machine import cases, shared_keys
from truepose.machine.elements import DriveKind, ElementKind, kinds_of
from truepose.machine.families import MachineFamily
from truepose.machine.tables import REQUIRED, Owners, takes_every_key
from truepose.machine.tables.units import UnitsTable

Model = TypeVar("Model", bound=BaseModel)

_TYPES = {
    "string_type": "text",
    "int_type": "a whole number",
    "float_type": "a number",
    "bool_type": "true or false",
    "list_type": "a list",
    "tuple_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
}
"""pydantic's word for a wrong type -> what was expected."""


@dataclass
class Validated:
    """The models that a document filled, by their class; what failed is missing (or None)."""

    units: UnitSystem
    tables: dict[type[BaseModel], BaseModel] = field(default_factory=dict)
    every_row: dict[type[BaseModel], list[BaseModel | None]] = field(default_factory=dict)
    geometry: dict[str, list[FileTable | None]] = field(default_factory=dict)
    """Per row of a table whose rows have a kind: the model of that."""
    misspelt: set[Key] = field(default_factory=set)
    """Keys that an unknown key was most likely meant to be: they are not missing as well."""
    cases: dict[str, Validated] = field(default_factory=dict)
    """Per case, by name: the models of a condition."""

    def table(self, model: type[Model]) -> Model | None:
        """The one instance of `model`, or None."""
        return cast("Model | None", self.tables.get(model))

    @property
    def family(self) -> MachineFamily | None:
        """What `[family]` says; None where the file has none, or it is no good."""
        return next((one for one in self.tables.values() if isinstance(one, MachineFamily)), None)

    def rows(self, model: type[Model]) -> tuple[Model, ...]:
        """The instances of `model`, one per row; only for a document without problems."""
        return cast("tuple[Model, ...]", tuple(self.every_row.get(model, ())))


def validate(document: Document, owners: Owners) -> tuple[Validated, list[Problem]]:
    """Fill the models of every table. The problems are in no particular order."""
    problems: list[Problem] = []
    data = document.data
    for table in REQUIRED:
        if table not in data:
            problems.append(_missing_table(document, table))
    known = {"schema", shared_keys.EACH, cases.CASE, *owners.by_table}
    problems += shared_keys.problems(document)
    problems += [unknown_key(document, (key,), known) for key in data if key not in known]
    units = read_units(document, problems)
    validated = Validated(units)
    for table, models in owners.by_table.items():
        if table in data and table != "units":
            if table in SEVERAL:
                _array(document, table, models, validated, problems)
            else:
                _single(document, table, models, validated, problems)
    of_condition = owners.by_table[cases.CONDITION]
    for name, case in cases.tables(document, problems).items():
        of_case = validated.cases[name] = Validated(units)
        filled, faults = share_out(document, (cases.CASE, name), of_condition, case, validated)
        problems += faults
        of_case.tables |= {model: one for model, one in filled.items() if one is not None}
    return validated, one_per_unit(problems)


def units_of(document: Document) -> UnitSystem:
    """The units that the file declares, those that are good."""
    return read_units(document, [])


def validate_alone(
    document: Document, owners: Owners, table: str
) -> tuple[Validated, list[Problem]]:
    """Fill the models of one table that the file has, and what is wrong with it."""
    problems: list[Problem] = []
    validated = Validated(units_of(document))
    _single(document, table, owners.by_table[table], validated, problems)
    return validated, problems


def one_per_unit(problems: list[Problem]) -> list[Problem]:
    """One missing unit is one problem, however many numbers want it: that of the first."""
    by_dimension: dict[str | None, list[Problem]] = {}
    others = []
    for problem in problems:
        if problem.code == "no-unit":
            by_dimension.setdefault(problem.expected, []).append(problem)
        else:
            others.append(problem)
    for same in by_dimension.values():
        first = min(same, key=lambda problem: problem.line or 0)
        if len(same) > 1:
            more = f", as for {len(same) - 1} more in the file"
            first = replace(first, message=first.message + more)
        others.append(first)
    return others


def _missing_table(document: Document, table: str) -> Problem:
    written = f"[[{table}]]" if table in SEVERAL else f"[{table}]"
    plural = nearest(table, [key for key in document.data if key != table])
    return Problem(
        "missing-key",
        f"there is no {written}",
        document.file,
        path=table,
        found="nothing",
        expected=written,
        hint=f"is [{plural}] meant to be it?" if plural else None,
    )


def read_units(document: Document, problems: list[Problem]) -> UnitSystem:
    """The units that the file declares, those that are good; what is wrong with the others."""
    table = document.data.get("units", {})
    if not isinstance(table, dict):
        problems.append(not_a_table(document, ("units",), table))
        return UnitSystem({})
    filled, faults = _fill(document, ("units",), UnitsTable, table, None)
    broken = {str(key[1]) for key, _ in faults if len(key) > 1}
    if faults:
        # The good ones stay in force, so that each bare number is not reported as well.
        good = {key: value for key, value in table.items() if key not in broken}
        filled, _ = _fill(document, ("units",), UnitsTable, good, None)
    problems += [problem for _, problem in faults]
    declared: dict[str, FileUnit] = {}
    if filled is not None:
        declared = {name: getattr(filled, name) for name in filled.model_fields_set}
    return UnitSystem(declared, frozenset(broken))


def _single(
    document: Document,
    table: str,
    models: tuple[type[BaseModel], ...],
    validated: Validated,
    problems: list[Problem],
) -> None:
    value = document.data[table]
    if not isinstance(value, dict):
        problems.append(not_a_table(document, (table,), value))
        return
    models, value, _ = _of_its_kind(document, (table,), models, value, problems)
    filled, faults = share_out(document, (table,), models, value, validated)
    problems += faults
    validated.tables |= {model: one for model, one in filled.items() if one is not None}


def _array(
    document: Document,
    table: str,
    models: tuple[type[BaseModel], ...],
    validated: Validated,
    problems: list[Problem],
) -> None:
    rows = document.data[table]
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        problems.append(not_an_array(document, table, rows))
        return
    kinds = kinds_of(table)
    for index, row in enumerate(rows):
        key: Key = (table, index)
        of_row, row, kind = _of_its_kind(document, key, models, row, problems)
        coordinate = kind.coordinate if isinstance(kind, DriveKind) else None
        filled, faults = share_out(document, key, of_row, row, validated, coordinate)
        problems += faults
        for model in models:
            validated.every_row.setdefault(model, []).append(filled[model])
        if kinds:
            one = filled[of_row[-1]] if kind is not None else None
            validated.geometry.setdefault(table, []).append(cast("FileTable | None", one))


def _of_its_kind(
    document: Document,
    key: Key,
    models: tuple[type[BaseModel], ...],
    value: dict[str, Any],
    problems: list[Problem],
) -> tuple[tuple[type[BaseModel], ...], dict[str, Any], ElementKind | None]:
    """The models of one table or row with that of its kind, the keys to check, and the kind."""
    kinds = kinds_of(str(key[0]))
    if not kinds:
        return models, value, None
    kind = kinds.get(value["kind"]) if isinstance(value.get("kind"), str) else None
    if kind is not None:
        return (*models, kind.model), value, kind
    problems += unknown_kind(document, key, value, kinds)
    # Which keys it may have is not known without its kind: check only the common ones.
    common = {name for model in models for name in model.model_fields}
    return models, {name: entry for name, entry in value.items() if name in common}, None


def unknown_kind(
    document: Document, key: Key, row: Mapping[str, Any], kinds: Iterable[str]
) -> list[Problem]:
    """The problem of a row whose kind is text that is none of these."""
    if not isinstance(row.get("kind"), str):
        return []  # missing, or of a wrong type: the table's own model says so
    return [
        document.problem(
            Fault(
                "unknown-choice",
                f"there is no {key[0]} of kind {shown_value(row['kind'])}",
                found=shown_value(row["kind"]),
                expected=one_of(f'"{kind}"' for kind in kinds),
                hint=did_you_mean(row["kind"], kinds),
            ),
            (*key, "kind"),
        )
    ]


def share_out(
    document: Document,
    key: Key,
    models: tuple[type[BaseModel], ...],
    value: Mapping[str, Any],
    validated: Validated,
    coordinate: str | None = None,
) -> tuple[dict[type[BaseModel], BaseModel | None], list[Problem]]:
    """Give every model its keys of one table, and refuse the keys that are nobody's.

    `coordinate`: the dimension of a drive's joint coordinate, which some of its quantities have.
    """
    named = {name for model in models for name in model.model_fields}
    filled: dict[type[BaseModel], BaseModel | None] = {}
    of_keys: list[tuple[Key, Problem]] = []
    for model in models:
        free = takes_every_key(model)
        share = {
            name: entry
            for name, entry in value.items()
            if name in model.model_fields or (free and name not in named)
        }
        filled[model], of_model = _fill(document, key, model, share, validated.units, coordinate)
        of_keys += of_model
    problems = []
    if not any(takes_every_key(model) for model in models):
        unknown = [name for name in value if name not in named]
        problems = [unknown_key(document, (*key, name), named) for name in unknown]
        # "lenght" is one mistake: not also a missing "length".
        meant = {nearest(name, named - value.keys()) for name in unknown}
        validated.misspelt |= {(*key, name) for name in meant if name is not None}
        of_keys = [
            (where, problem)
            for where, problem in of_keys
            if not (problem.code == "missing-key" and where in validated.misspelt)
        ]
    return filled, problems + [problem for _, problem in of_keys]


def _fill(
    document: Document,
    key: Key,
    model: type[BaseModel],
    value: Mapping[str, Any],
    units: UnitSystem | None,
    coordinate: str | None = None,
) -> tuple[BaseModel | None, list[tuple[Key, Problem]]]:
    """One model from its keys; or None and what is wrong, each with where."""
    context = {"units": units, "coordinate": coordinate}
    try:
        return model.model_validate(dict(value), context=context), []
    except ValidationError as error:
        located = []
        for entry in error.errors(include_url=False):
            where = _where(document, key, entry["loc"])
            problem = _problem(document, where, model, cast("dict[str, Any]", entry))
            located.append((where, problem))
        return None, _without_misspelt(located)


def _without_misspelt(located: list[tuple[Key, Problem]]) -> list[tuple[Key, Problem]]:
    """A misspelt "lenght" is one mistake: not also a missing "length" beside it."""
    missing = [where for where, problem in located if problem.code == "missing-key"]
    meant = set()
    for where, problem in located:
        if problem.code == "unknown-key":
            beside = [str(key[-1]) for key in missing if key[:-1] == where[:-1]]
            meant.add((*where[:-1], nearest(str(where[-1]), beside)))
    return [
        (where, problem)
        for where, problem in located
        if not (problem.code == "missing-key" and where in meant)
    ]


def _where(document: Document, key: Key, loc: Iterable[str | int]) -> Key:
    """pydantic's place inside a model -> a key of the document.

    A validator may have put a value into a table that the file does not have (one temperature for
    all parts), or joined nested keys: the key goes only as far as the document does, but keeps the
    last word where a key is missing from a table.
    """
    value: Any = document.data
    for part in key:
        value = value[part]
    where = list(key)
    for part in loc:
        if isinstance(value, dict):
            words = [part] if part in value else str(part).split(".")
            for word in words:
                where.append(word)
                value = value.get(word) if isinstance(value, dict) else None
        elif isinstance(value, list) and isinstance(part, int) and part < len(value):
            where.append(part)
            value = value[part]
        else:
            break
    return tuple(where)


def _problem(
    document: Document, key: Key, model: type[BaseModel], entry: Mapping[str, Any]
) -> Problem:
    kind, value, context = entry["type"], entry["input"], entry.get("ctx", {})
    if kind in CATALOGUE:
        return document.problem(context["fault"], key)
    if kind == "missing" and isinstance(entry["loc"][-1], str):
        return document.problem(
            Fault(
                "missing-key",
                "missing",
                found="nothing",
                expected=f"the key {key[-1]}{_described(model, entry['loc'])}",
            ),
            key,
        )
    if kind == "extra_forbidden":
        return unknown_key(document, key, _keys_beside(model, entry["loc"]))
    if kind == "literal_error":
        return document.problem(
            Fault(
                "unknown-choice",
                f"{shown_value(value)} is not one of the allowed words",
                found=shown_value(value),
                expected=context["expected"],
            ),
            key,
        )
    if kind in ("missing", "too_short", "too_long"):
        return _wrong_count(document, key, value, context)
    expected = _TYPES.get(kind, entry["msg"])
    return document.problem(
        Fault(
            "wrong-type",
            f"expected {expected}, found {type_phrase(value)}",
            found=shown_value(value),
            expected=expected,
        ),
        key,
    )


def _wrong_count(document: Document, key: Key, value: Any, context: Mapping[str, Any]) -> Problem:
    wanted = context.get("max_length")
    if wanted is None and "min_length" in context:
        wanted = f"{context['min_length']} or more"
    return document.problem(
        Fault(
            "wrong-type",
            f"a list of {len(value)}"
            if isinstance(value, list | tuple)
            else "a list of another size",
            found=shown_value(value),
            expected="a list of more entries" if wanted is None else f"a list of {wanted}",
        ),
        key,
    )


def _described(model: type[BaseModel], loc: tuple[str | int, ...]) -> str:
    owner = _model_at(model, loc[:-1])
    name = str(loc[-1])
    if owner is None or name not in owner.model_fields:
        return ""
    return f": {owner.model_fields[name].description}"


def _keys_beside(model: type[BaseModel], loc: tuple[str | int, ...]) -> Iterable[str]:
    owner = _model_at(model, loc[:-1])
    return () if owner is None else owner.model_fields


def _model_at(model: type[BaseModel], loc: Iterable[str | int]) -> type[BaseModel] | None:
    """The model that a place inside `model` belongs to."""
    current: type[BaseModel] | None = model
    for part in loc:
        if isinstance(part, int):
            continue  # an entry of a list, whose model is found already
        if current is None or part not in current.model_fields:
            return None
        current = _model_in(current.model_fields[part].annotation)
    return current


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The model that a type is, holds in a list, or takes among others."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    models = (_model_in(member) for member in get_args(annotation))
    return next((model for model in models if model is not None), None)


def unknown_key(document: Document, key: Key, known: Iterable[str]) -> Problem:
    """The problem of a key that its table does not have, which has those known."""
    word, known = str(key[-1]), sorted(known)
    return document.problem(
        Fault(
            "unknown-key",
            "unknown key",
            found=word,
            expected=one_of(known),
            hint=did_you_mean(word, known),
        ),
        key,
    )


def not_a_table(document: Document, key: Key, value: Any) -> Problem:
    """The problem of a value where a table is expected."""
    name = key[-1]
    return document.problem(
        Fault(
            "wrong-type",
            f"expected a table, found {type_phrase(value)}",
            found=shown_value(value),
            expected=f"[{name}]",
            hint=f"[[{name}]] begins one of several; there is only one [{name}]"
            if isinstance(value, list)
            else None,
        ),
        key,
    )


def not_an_array(document: Document, table: str, value: Any) -> Problem:
    """The problem of a value where one table of several is expected."""
    return document.problem(
        Fault(
            "wrong-type",
            f"expected one table per {table}, found {type_phrase(value)}",
            found=shown_value(value),
            expected=f"[[{table}]]",
            hint=f"write [[{table}]], with two brackets" if isinstance(value, dict) else None,
        ),
        (table,),
    )
