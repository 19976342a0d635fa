"""What the kernel says of a description that is none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from build_machine import Description, description_of, machine_files
from truepose import _kernel


def machine() -> Description:
    (path,) = (path for path in machine_files() if path.stem == "hexapod")
    return description_of(path)


@pytest.mark.parametrize(
    ("change", "code", "place"),
    [
        (lambda d: d.pop("dof"), "missing-field", "machine"),
        (lambda d: d.update(commanded=["z", "x"]), "freedom-order", "machine.commanded"),
        (lambda d: d.update(home={"w": 1.0}), "unknown-freedom", "workspace.home"),
        (lambda d: d["drives"][0].update(kind="w"), "unknown-kind", "drive.d1"),
        (lambda d: d["drives"][0].update(working_mode="*"), "working-mode", "drive.d1"),
        (lambda d: d["struts"][1].pop("base"), "missing-field", "strut.2"),
    ],
)
def test_a_fault_has_its_code_and_place(
    change: Callable[[Description], Any], code: str, place: str
) -> None:
    description = machine()
    change(description)
    with pytest.raises(_kernel.KernelError) as raised:
        _kernel.Machine(description)
    assert (raised.value.args[0], raised.value.args[2]) == (code, place)


@pytest.mark.parametrize("value", [7, "word", [[1.0]], [1.0, 2.0], object(), {"x": 1.0}, True])
def test_another_type_is_a_type_error(value: object) -> None:
    description = machine()
    description["struts"][0]["base"] = value
    with pytest.raises(TypeError, match=r'strut\.1: "base" is .*, expected a list of 3'):
        _kernel.Machine(description)


def test_numbers_of_numpy_are_numbers() -> None:
    plain, other = machine(), machine()
    for strut in other["struts"]:
        strut["base"] = np.array(strut["base"])
        strut["platform"] = tuple(np.float64(value) for value in strut["platform"])
    other["home"] = {name: np.float32(value) for name, value in other.get("home", {}).items()}
    np.testing.assert_array_equal(_kernel.Machine(other).nominal, _kernel.Machine(plain).nominal)
