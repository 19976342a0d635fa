"""docs/studies.md says what a study has, and what it takes."""

from __future__ import annotations

import re
from pathlib import Path

import truepose as tp
from command_line import PLANAR
from truepose.studies.design import DESIGNS, MOST_VARIANTS
from truepose.studies.quantities import QUICK_NAMES, REGISTRY

PAGE = (Path(__file__).parents[3] / "docs" / "studies.md").read_text("utf-8")


def test_every_variable_stands_on_the_page() -> None:
    names = [quantity.name for quantity in REGISTRY]
    study = tp.study(PLANAR, ["condition.temperature=20 degC"], quantities=names)
    schema = {name: one for quantity in REGISTRY for name, one in quantity.schema.items()}
    owner = {name: quantity.name for quantity in REGISTRY for name in quantity.schema}
    told: dict[str, tuple[str, str]] = {}
    for row in re.findall(r"^\| (`.+?) \| (.+?) \| (.+?) \| .+ \|$", PAGE, re.MULTILINE):
        for name in re.findall(r"`(\w+)`", row[0]):
            told[name] = (row[1], row[2].strip("`"))
    assert set(told) == set(study.data_vars)
    for name, (dims, quantity) in told.items():
        assert ", ".join(map(str, study[name].dims)) == dims, name
        assert quantity == owner.get(name, "always"), name
        assert (name in schema) == (quantity != "always")
    assert {"setting", "value", "variable", "variable_units"} < set(study.coords)


def test_designs_and_limits_stand_on_the_page() -> None:
    for design in DESIGNS:
        assert f"`{design}" in PAGE
    assert f"at most {MOST_VARIANTS:,} variants" in PAGE
    for quantity in REGISTRY:
        if not quantity.quick:
            assert f"| `{quantity.name}` |" in PAGE
    assert "`coverage` is Monte Carlo" in PAGE
    assert "coverage" not in QUICK_NAMES
