"""docs/part_features.md has every kind with its keys."""

from __future__ import annotations

import re
from pathlib import Path

from truepose.workpiece.features import REGISTRY

PAGE = Path(__file__).parents[3] / "docs" / "part_features.md"


def test_every_kind_and_key_is_on_the_page() -> None:
    rows = {
        cells[1].strip().strip("`"): set(re.findall(r"`(\w+)`", cells[3]))
        for line in PAGE.read_text("utf-8").splitlines()
        if line.startswith("| `") and (cells := line.split("|"))
    }
    keys = {kind: set(feature.table.model_fields) for kind, feature in REGISTRY.items()}
    assert rows == keys


def test_every_key_is_described() -> None:
    for kind, feature in REGISTRY.items():
        assert feature.doc
        for key, field in feature.table.model_fields.items():
            assert field.description, f"{kind}.{key}"
