"""D08, stiffness of seven cubic hexapods about a point of choice, struts of 1 N/m (m, N)."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose
from build_machine import file_text, hexapod
from oracle_cases import Published, case

CASES: dict[str, Any] = case("d08_cubic_stiffness")["cases"]


def half_digit(value: float) -> float:
    """Half a unit of the second significant digit; of the second decimal for a printed 0."""
    return 0.5 * 10.0 ** (math.floor(math.log10(abs(value))) - 1) if value else 0.005


@pytest.fixture(params=CASES)
def one(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[truepose.Machine, Any]:
    """The machine read from a file, its tool at the point B, and the case."""
    data = CASES[request.param]
    height = data["H"] + data["MO_B"]
    description = hexapod(data["Fa"], data["Mb"], tool=[0.0, 0.0, data["MO_B"]])
    path = tmp_path / "cubic.toml"
    workspace = f"[workspace]\nhome = {{ z = {height} }}\ngrid = {{ z = [{height}, {height}, 1] }}"
    path.write_text(file_text(description, strut='stiffness = "1 N/m"', more=workspace))
    return truepose.load(path), data


def test_there_are_seven() -> None:
    assert "".join(CASES) == "abcdefg"


def test_stiffness(one: tuple[truepose.Machine, Any], published: Published) -> None:
    machine, data = one
    (pose,) = machine.poses()
    stiffness = machine.stiffness(pose)
    assert np.abs(stiffness - data["K"]).max() < 1e-12

    told = data["published"]
    printed = np.diag([told[key] for key in ("kt", "kt", "kt", "krx", "krx", "krz")]).astype(float)
    printed[0, 4] = printed[4, 0] = told["off"]
    printed[1, 3] = printed[3, 1] = -told["off"]
    digits = np.vectorize(half_digit)(printed)
    # Case g's 0.375 is printed 0.37: exactly half a digit off.
    published("stiffness matrix", printed, stiffness, within=digits + 1e-12)


def test_compliance_is_its_inverse(one: tuple[truepose.Machine, Any]) -> None:
    machine, data = one
    (pose,) = machine.poses()
    compliance = machine.compliance(pose)
    assert np.abs(compliance @ np.array(data["K"]) - np.eye(6)).max() < 1e-9
