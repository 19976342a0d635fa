"""The generated pages are fresh, and the JSON schema says what the loader does."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from build_machine import machine_files
from family_machines import KINDS, family_file
from generators import DOCS, generator
from truepose.files.tolerance_standards import designations
from truepose.machine.reference import json_schema, page
from truepose.sources import REGISTRY


@pytest.mark.parametrize("name", generator("machine_file").pages())
def test_the_pages_are_fresh(name: str) -> None:
    written = (DOCS / name).read_text(encoding="utf-8")
    assert written == generator("machine_file").pages()[name], (
        "run: python docs/generate_machine_file.py"
    )


def test_the_page_names_every_key_of_every_source() -> None:
    text = page(REGISTRY)
    for source in REGISTRY:
        for table, model in source.tables.items():
            assert f"[{table}]" in text
            for key in model.model_fields:
                assert f"| `{key}` |" in text
    for name in designations():
        assert f"`{name}`" in text


def fits(value: object, schema: dict) -> bool:
    """The parts of JSON schema that ours uses, checked plainly."""
    for choice in ("anyOf", "oneOf"):
        if choice in schema and not any(fits(value, each) for each in schema[choice]):
            return False
    if "const" in schema:
        return value == schema["const"]
    if "enum" in schema and value not in schema["enum"]:
        return False
    kind = schema.get("type")
    if kind == "object":
        assert isinstance(value, dict)
        known = schema.get("properties", {})
        if any(key not in value for key in schema.get("required", ())):
            return False
        if schema.get("additionalProperties") is False and value.keys() - known.keys():
            return False
        return all(fits(entry, known[key]) for key, entry in value.items() if key in known)
    if kind == "array":
        low, high = schema.get("minItems", 0), schema.get("maxItems", 10**9)
        if not isinstance(value, list) or not low <= len(value) <= high:
            return False
        if "prefixItems" in schema:
            return all(map(fits, value, schema["prefixItems"]))
        return all(fits(entry, schema.get("items", {})) for entry in value)
    if kind == "number":
        if not isinstance(value, (int, float)) or isinstance(value, bool):
            return False
        return value >= schema.get("minimum", value) and value > schema.get(
            "exclusiveMinimum", value - 1
        )
    return kind is None or (kind == "string") == isinstance(value, str)


@pytest.mark.parametrize("path", machine_files(), ids=lambda path: path.stem)
def test_the_schema_takes_the_machines_shipped(path: Path) -> None:
    schema = json.loads(json.dumps(json_schema(REGISTRY)))
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    assert fits(document, schema)
    for wrong in (
        document | {"acuracy": {}},
        document | {"schema": 2},
        document | {"drive": [{**document["drive"][0], "kind": "slyder"}]},
        document | {"strut": [{**document["strut"][0], "lenght": 1}]},
        {key: value for key, value in document.items() if key != "machine"},
        {key: value for key, value in document.items() if key != "strut"},
        document | {"machine": {"name": "no freedoms"}},
    ):
        assert not fits(wrong, schema)


@pytest.mark.parametrize("kind", KINDS)
def test_the_schema_takes_families(kind: str) -> None:
    schema = json.loads(json.dumps(json_schema(REGISTRY)))
    file = family_file(kind)
    assert fits(file, schema)
    assert fits(
        {key: value for key, value in file.items() if key not in ("drive", "strut")}, schema
    )
    for wrong in ({"kind": "delta"}, {"spacing": -1}, {"rods": 3}, {"base_radius": "x", "rod": {}}):
        assert not fits(file | {"family": file["family"] | wrong}, schema)
