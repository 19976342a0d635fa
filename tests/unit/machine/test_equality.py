"""Machines compare by what they are."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

import truepose

MACHINES = sorted((Path(__file__).parents[3] / "machines").glob("*.toml"))


@pytest.mark.parametrize("path", MACHINES, ids=lambda path: path.stem)
def test_machine_equals_itself_pickled_and_no_other(path: Path) -> None:
    machine = truepose.load(path)
    again = pickle.loads(pickle.dumps(machine))  # noqa: S301 (made here)
    assert again == machine
    assert hash(again) == hash(machine)
    name = next(name for name in machine.parameters if name.endswith((".length", ".x")))
    value = machine.nominal[machine.parameters.index(name)]
    assert machine.replace({name: float(value) + 1e-9}) != machine
    assert machine != path
