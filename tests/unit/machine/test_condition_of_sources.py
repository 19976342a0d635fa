"""A source's own keys of [condition] reach the Condition and every result, with no other edit."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Self

import pytest
from pydantic import BaseModel, Field

import truepose as tp
from machine_texts import PLANAR
from truepose.errors import MachineFileError, RequestError
from truepose.files.quantity import Fraction, Length
from truepose.machine import Condition, Machine
from truepose.machine.loader import load
from truepose.reporting import inputs
from truepose.sources import REGISTRY, Deviation, PoseBlock

DRY = 0.5
GROWTH = 1e-4


class Air(BaseModel):
    humidity: Fraction = Field(DRY, description="Relative humidity.")
    depth: Length = Field(0.0, description="Under water.")


@dataclass(frozen=True)
class Swelling:
    """Every strut's length grows with the humidity of the air."""

    name: ClassVar[str] = "swelling"
    doc: ClassVar[str] = "struts that swell"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {"condition": Air}
    sets_overall_edges: ClassVar[bool] = False

    @classmethod
    def build(cls, parts: object) -> Self | None:
        return cls()

    def acts(self, condition: Condition) -> bool:
        return condition.table(Air).humidity != DRY

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        growth = GROWTH * (condition.table(Air).humidity - DRY)
        return Deviation.of(machine.kernel.length_parameters, growth * block.lengths)


def machine(folder: Path, *settings: str, written: str = "") -> Machine:
    path = folder / "machine.toml"
    path.write_text(PLANAR + written, encoding="utf-8")
    return load(path, settings=settings, registry=(*REGISTRY, Swelling))


def test_what_the_file_says_is_in_the_condition_and_in_the_result(tmp_path: Path) -> None:
    humid = machine(tmp_path, "condition.humidity=60 %")
    assert humid.condition.table(Air) == Air.model_construct(humidity=0.6)
    found = tp.budget(humid)
    assert "swelling" in found.source.values
    assert json.loads(found.attrs["condition"])["humidity"] == 0.6
    assert ("humidity", "0.6") in inputs.condition(humid).rows
    assert copy.deepcopy(humid).condition == humid.condition


def test_a_file_that_says_nothing_has_the_default_and_can_be_changed(tmp_path: Path) -> None:
    dry = machine(tmp_path)
    assert dry.condition.source_keys == {"humidity": DRY, "depth": 0.0}
    assert "swelling" not in tp.budget(dry).source.values
    errors = [
        tp.budget(dry, condition=dry.condition.replace(source_keys={"humidity": humidity}))
        .sel(source="swelling")
        .error.values
        for humidity in (0.6, "60 %")
    ]
    assert (errors[0] == errors[1]).all()
    assert abs(errors[0]).max() > 0.0
    deep = dry.condition.replace(source_keys={"humidity": 0.7}).replace(
        source_keys={"depth": "2 mm"}
    )
    assert deep.source_keys == {"humidity": 0.7, "depth": 0.002}


def test_a_condition_without_a_file_has_the_defaults() -> None:
    assert Condition().table(Air).humidity == DRY


@pytest.mark.parametrize(
    ("keys", "expected", "hint"),
    [
        ({"humidity": "160 %"}, "a plain number from 0 to 1", None),
        ({"depth": "1 K"}, "a length", None),
        ({"humidty": 0.5}, "one of humidity, depth", 'did you mean "humidity"?'),
    ],
)
def test_a_bad_value_or_key_is_refused(
    keys: dict[str, object], expected: str, hint: str | None, tmp_path: Path
) -> None:
    with pytest.raises(RequestError) as refused:
        machine(tmp_path).condition.replace(source_keys=keys)
    (problem,) = refused.value.problems
    assert problem.code == "bad-condition"
    assert problem.path == f"condition.{next(iter(keys))}"
    assert expected in str(problem.expected)
    assert problem.hint == hint


def test_a_bad_value_in_a_file_is_told_with_its_place(tmp_path: Path) -> None:
    with pytest.raises(MachineFileError) as refused:
        machine(tmp_path, "condition.humidity=160 %")
    assert refused.value.problems[0].path == "condition.humidity"
