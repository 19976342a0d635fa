"""The machine file's JSON schema and its page of documentation, made from the models.

Nothing here is written twice: keys, types, defaults and descriptions are those of the tables'
models, of the kernel's table of elements and of the registered sources.
`docs/generate_machine_file.py` writes both files.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from inspect import cleandoc
from typing import Any

from pydantic import BaseModel

from truepose.files.dimensions import DIMENSIONS
from truepose.files.document import ARRAY_TABLES, SEVERAL
from truepose.files.tolerance_standards import STANDARDS, designations_of
from truepose.machine.cases import CASE, CONDITION
from truepose.machine.elements import FamilyKind, kinds_of
from truepose.machine.materials import MATERIALS
from truepose.machine.shared_keys import EACH
from truepose.machine.source_builder import SourceType
from truepose.machine.tables import REQUIRED, SCHEMA, owners, takes_every_key

Json = dict[str, Any]


def schema_text(registry: Sequence[SourceType]) -> str:
    """The JSON schema as a file has it."""
    return json.dumps(json_schema(registry), indent=2, ensure_ascii=False) + "\n"


def json_schema(registry: Sequence[SourceType]) -> Json:
    """JSON schema (2020-12) of a machine file that the sources of `registry` may read from."""
    by_table = owners(source.tables for source in registry).by_table
    properties: Json = {"schema": {"const": SCHEMA, "description": "Version of the machine file."}}
    for table, models in by_table.items():
        properties[table] = (
            {"type": "array", "minItems": 1, "items": _row_schema(table, models)}
            if table in SEVERAL
            else _one_of(_choices(table, models))
        )
    properties[EACH] = {
        "type": "object",
        "description": _EACH_DOC,
        "properties": {table: _shared_schema(table, by_table[table]) for table in ARRAY_TABLES},
        "additionalProperties": False,
    }
    of_condition = _merged(by_table[CONDITION])
    properties[CASE] = {
        "type": "object",
        "description": _CASE_DOC,
        "additionalProperties": of_condition,
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "truepose machine file",
        "type": "object",
        "properties": properties,
        **_complete(properties),
        "additionalProperties": False,
    }


def _complete(properties: Json) -> Json:
    """What a file must have: rows and freedoms, or a `[family]` that gives them."""
    machine = properties["machine"]
    machine["required"].remove("dof")
    rows = [table for table in REQUIRED if table in SEVERAL]
    by_hand = {
        "type": "object",
        "required": rows,
        "properties": {"machine": {"type": "object", "required": ["dof"]}},
    }
    return {
        "required": ["schema", *(table for table in REQUIRED if table not in SEVERAL)],
        "anyOf": [{"type": "object", "required": ["family"]}, by_hand],
    }


def _one_of(choices: list[Json]) -> Json:
    return choices[0] if len(choices) == 1 else {"anyOf": choices}


def _row_schema(table: str, models: tuple[type[BaseModel], ...]) -> Json:
    """A row. Only its name is required of it: `[each.*]` may give all the rest."""
    choices = _choices(table, models)
    if table in ARRAY_TABLES:
        for choice in choices:
            choice["required"] = ["name"]
    return _one_of(choices)


def _shared_schema(table: str, models: tuple[type[BaseModel], ...]) -> Json:
    """What all rows may share: everything but their name."""
    choices = _choices(table, models)
    for choice in choices:
        choice.pop("required", None)
        del choice["properties"]["name"]
    return _one_of(choices)


def _choices(table: str, models: tuple[type[BaseModel], ...]) -> list[Json]:
    """The keys of a table or row, one object schema for each kind that there is of it."""
    kinds = kinds_of(table)
    if not kinds:
        return [_merged(models)]
    choices = []
    for kind in kinds.values():
        choice = _merged((*models, kind.model))
        choice["properties"]["kind"] = {"const": kind.kind, "description": kind.doc}
        choices.append(choice)
    return choices


def _merged(models: Iterable[type[BaseModel]]) -> Json:
    """One object schema for the keys of several models."""
    merged: Json = {"type": "object", "properties": {}, "required": []}
    free = False
    for model in models:
        one = _inlined(model.model_json_schema())
        merged["properties"] |= one.get("properties", {})
        merged["required"] += one.get("required", [])
        free = free or takes_every_key(model)
    if not merged["required"]:
        del merged["required"]
    merged["additionalProperties"] = free
    return merged


def _inlined(schema: Json) -> Json:
    """A schema with its definitions in place, and without what only programs made of it."""
    definitions = schema.pop("$defs", {})

    def clean(value: Any) -> Any:
        if isinstance(value, list):
            return [clean(member) for member in value]
        if not isinstance(value, dict):
            return value
        if "$ref" in value:
            name = value["$ref"].rpartition("/")[2]
            return clean(definitions[name] | {k: v for k, v in value.items() if k != "$ref"})
        cleaned = {
            key: clean(entry)
            for key, entry in value.items()
            if not (key == "title" and isinstance(entry, str)) and not _is_no_default(key, entry)
        }
        choices = [choice for choice in cleaned.get("anyOf", ()) if choice != {"type": "null"}]
        # TOML has no null: a key that may be left out takes only its other choice.
        if len(choices) == 1:
            del cleaned["anyOf"]
            return choices[0] | cleaned
        return cleaned

    result: Json = clean(schema)
    return result


def _is_no_default(key: str, entry: Any) -> bool:
    return key == "default" and entry is None


def page(registry: Sequence[SourceType]) -> str:
    """The page of documentation, Markdown."""
    by_table = owners(source.tables for source in registry).by_table
    reader = {
        key: source.name
        for source in registry
        for model in source.tables.values()
        for key in model.model_fields
    }
    parts = [_INTRODUCTION]
    for table, models in by_table.items():
        parts.append(_section(table, models, registry, reader))
    parts += [_cases(), _each(), _materials(), _classes()]
    return "\n".join(parts).rstrip() + "\n"


def _section(
    table: str,
    models: tuple[type[BaseModel], ...],
    registry: Sequence[SourceType],
    reader: Mapping[str, str],
) -> str:
    title = f"[[{table}]]" if table in SEVERAL else f"[{table}]"
    lines = [f"## `{title}`", "", _first_line(models[0]), ""]
    schema = _merged(models)
    if schema["properties"]:
        lines += _rows(schema, reader)
    for source in registry:
        model = source.tables.get(table)
        if model is not None and takes_every_key(model):
            lines += [f"Any key; read by the source `{source.name}`: {source.doc}.", ""]
    lines += _tables_below(table, schema)
    for kind in kinds_of(table).values():
        lines += [f'### `kind = "{kind.kind}"`', "", kind.doc, ""]
        if isinstance(kind, FamilyKind):
            lines += ["```text", *kind.drawing.rstrip().split("\n"), "```", ""]
        lines += _rows(_merged((kind.model,)), {})
    return "\n".join(lines)


def _tables_below(path: str, schema: Json) -> list[str]:
    """A section for every table inside a table, and inside those."""
    lines = []
    for key, value in schema["properties"].items():
        below = value.get("items", value)
        if below.get("properties"):
            meaning = _sentence(value.get("description", ""))
            lines += [f"### `{path}.{key}`", "", meaning, "", *_rows(below, {})]
            lines += _tables_below(f"{path}.{key}", below)
    return lines


def _first_line(model: type[BaseModel]) -> str:
    return cleandoc(model.__doc__ or "")


def _rows(schema: Json, reader: Mapping[str, str]) -> list[str]:
    required = schema.get("required", ())
    lines = ["| key | takes | meaning |", "|---|---|---|"]
    for key, value in schema["properties"].items():
        meaning = _sentence(value.get("description", ""))
        if key in required:
            meaning = f"**Required.** {meaning}"
        elif "default" in value and value["default"] not in ("", None, []):
            meaning += f" Default: {_shown(value['default'])}."
        if key in reader:
            meaning += f" Read by the source `{reader[key]}`."
        lines.append(f"| `{key}` | {_takes(value)} | {meaning.strip()} |".replace("\n", " "))
    return [*lines, ""]


def _sentence(text: str) -> str:
    text = text.strip()
    if not text:
        return ""
    return text[0].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def _shown(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "`[" + ", ".join(f"{number:g}" for number in value) + "]`"
    if isinstance(value, bool):
        return "`true`" if value else "`false`"
    return f"`{value:g}`" if isinstance(value, float) else f"`{value}`"


def _takes(schema: Json) -> str:
    """What a key takes, in words."""
    if "x-takes" in schema:
        return str(schema["x-takes"])
    if "x-dimension" in schema:
        return _takes_quantity(schema, schema["x-dimension"])
    if "x-poses" in schema:
        return "list of lists, one per pose, or the name of a CSV file"
    if "enum" in schema:
        return " or ".join(f'`"{word}"`' for word in schema["enum"])
    if "properties" in schema:
        return "table, see below"
    if schema.get("type") == "array":
        return _takes_list(schema)
    named = schema.get("additionalProperties")
    if isinstance(named, dict):
        return f"table of any names, each a {_takes(named)}"
    words = {
        "string": "text",
        "number": "plain number",
        "integer": "whole number",
        "boolean": "`true` or `false`",
    }
    return words.get(schema.get("type", ""), "value")


def _takes_quantity(schema: Json, name: str) -> str:
    if name == "direction":
        return "direction: 3 plain numbers"
    dimension = DIMENSIONS[name]
    if "x-tolerance" in schema:
        a_class = ", or a class" if schema["x-tolerance"] else ""
        written = f"`[lower, upper]`, ± one value{a_class}"
        return f"tolerance ({dimension.phrase}): {written}, or a table of them with more"
    if "x-known" in schema:
        return f"{dimension.name}, ± one or `[lower, upper]` where it is not known"
    if "x-slope" in schema:
        written = f"tolerance ({dimension.phrase}, or a rise over a length)"
        return f"{written}: `[lower, upper]`, ± one value, or a table with `direction`"
    if schema.get("x-grid"):
        return f"`[from, to, count]`, {dimension.plural}"
    if schema.get("x-series"):
        return f"{dimension.name.replace('_', ' ')}, or a table of those in series"
    if schema.get("x-per-axis"):
        return f"{dimension.name}, or `[x, y, z]` of them; `inf` is rigid"
    if "x-per-limb" in schema:
        several = f"list of {schema['x-per-limb']}, one for each limb"
        if schema["x-alike"]:
            return f"{dimension.name}, or a {several}"
        return f"{several} ({dimension.plural})"
    if schema.get("x-by-part"):
        return f"table of {dimension.plural} per part"
    if schema.get("x-per-part"):
        return f"{dimension.phrase}, or a table of them per part"
    if "x-angular" in schema:
        return f"{dimension.name}; of a crank {DIMENSIONS[schema['x-angular']].name}"
    return dimension.name.replace("_", " ")


def _takes_list(schema: Json) -> str:
    members = schema.get("prefixItems")
    if members:
        dimension = DIMENSIONS[members[0]["x-dimension"]]
        return f"list of {len(members)} {dimension.plural}"
    item = schema.get("items", {})
    return "list of tables, see below" if "properties" in item else "list of " + _takes(item)


def _each() -> str:
    tables = ", ".join(f"`[{EACH}.{table}]`" for table in ARRAY_TABLES)
    return f"## {tables}\n\n{_EACH_DOC}\n"


def _cases() -> str:
    return f"## `[{CASE}.NAME]`\n\n{_CASE_DOC}\n"


def _materials() -> str:
    lines = [
        "## Materials",
        "",
        "Typical values at room temperature, for a first budget: write `modulus` and `expansion`",
        "outright where the result depends on them.",
        "",
        "| `material` | modulus, GPa | expansion, 1e-6 1/K | source |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| `{material.name}` | {material.modulus / 1e9:g} | {material.expansion * 1e6:g} "
        f"| {material.source} |"
        for material in MATERIALS.values()
    ]
    return "\n".join([*lines, ""])


def _classes() -> str:
    lines = [
        "## Tolerance classes",
        "",
        "A class takes its limits from the nominal size; see",
        "[tolerance_standards.md](tolerance_standards.md).",
        "",
        "| standard | for | classes |",
        "|---|---|---|",
    ]
    lines += [
        f"| {standard.title} | {DIMENSIONS[standard.dimension].phrase} "
        f"| {', '.join(f'`{name}`' for name in designations_of(standard))} |"
        for standard in STANDARDS
        if standard.dimension == "length"
    ]
    return "\n".join([*lines, ""])


_EACH_DOC = """\
Keys that every row of an array table has unless it writes its own; a row that writes one keeps all
of its own value, tables within it included. Rows have a `name` each."""

_CASE_DOC = """\
A further condition, with the keys of `[condition]`. A key that it does not write is that of
`[condition]`, as a whole; a case that writes a force, as `force`, `cutting` or `kienzle`, takes
none of these, and one that writes `temperature` takes no `temperature_log`. A design holds
in `[condition]` and in every case; commands ask `[condition]`, and Python has the cases in
`machine.cases`."""

_INTRODUCTION = """\
# The machine file

<!-- Written by `python docs/generate_machine_file.py`. Do not edit. -->

A machine is described in one TOML file; `machines/` has examples. The same as a JSON schema, for
editors: [machine_file.schema.json](machine_file.schema.json).

The file begins with `schema = 1`, above the first table.

**Units.** A bare number has the unit that `[units]` declares for its dimension, or, where it
declares none, is an error. Text carries its own unit: `"28.27 mm^2"`, `"210 GPa"`, `"1.1e-5 1/K"`,
`"0.02 in"`. Dimensions are checked, and a temperature is not a temperature difference.

**Data files.** Temperature logs, lists of poses and measured tables are CSV files beside the
machine file, with the unit of every column in its header: [data_files.md](data_files.md).

**Problems.** All of a file's problems are reported at once, each with its code, file and line. A
key that nothing reads is one.

**Names.** Drives and struts are told apart by `name`. Parameters are named after them:
`strut.1.length`, `strut.1.base.x`, `drive.d1.offset`, `tool.z`.

**Families.** A machine of a common kind is said by its few parameters in [`[family]`](#family),
from which the joint centres follow.

**Trying a change.** `--set key=value` on the command line changes a value before the file is
checked: `--set accuracy.target="0.2 mm"`, `--set strut.1.length=501`,
`--set strut.*.material=invar`, `--set strut.1.base.x=3`, `--set condition.temperature=40`. A value
is a TOML value; what is none is taken as text.
"""
