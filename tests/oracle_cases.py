"""Reading the validation cases and turning their conventions into the kernel's."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reference_kinematics import angles_of, rotation_in_order

Published = Callable[..., None]
"""The fixture `published` of oracles/conftest.py."""

CASES = Path(__file__).parent / "oracles" / "cases"


def case(name: str) -> dict[str, Any]:
    """The validation case in the file oracles/cases/<name>.json."""
    found: dict[str, Any] = json.loads((CASES / f"{name}.json").read_text(encoding="utf-8"))
    return found


def pose(position: ArrayLike, rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """(6,) pose x y z a b c, R = Rz(c) Ry(b) Rx(a), of a position and a rotation matrix."""
    return np.concatenate([np.asarray(position, float), angles_of(rotation)])


def pose_in_order(order: str, position: ArrayLike, angles: ArrayLike) -> NDArray[np.float64]:
    """(6,) pose from angles (a, b, c), rad, that a source multiplies in another order ("xyz")."""
    return pose(position, rotation_in_order(order, angles))


def dietmaier_text() -> str:
    """Case D01 as a machine file in metres, which the source leaves without a unit."""
    data = case("d01_dietmaier")
    rows = zip(data["base_points"], data["platform_points"], strict=True)
    tables = "".join(
        f'[[drive]]\nname = "d{n}"\nkind = "telescopic"\ntravel = [0.1, 4]\n'
        f'[[strut]]\nname = "{n}"\ndrive = "d{n}"\nbase = {base}\nplatform = {platform}\n'
        for n, (base, platform) in enumerate(rows, 1)
    )
    dof = '["x", "y", "z", "a", "b", "c"]'
    return (
        f'schema = 1\n[units]\nlength = "m"\nangle = "rad"\n[machine]\nname = "Forty"\n'
        f"dof = {dof}\n{tables}[workspace]\nposes = [[0, 0, 1, 0, 0, 0]]\n"
    )


def six_psu_deviations() -> dict[str, float]:
    """Identified minus nominal of case D09 in the kernel's parameters, m and rad.

    The nominal axis is z, whose two tangents are x and y; e = (ex, ey, 1) tilts by ex and ey.
    """
    data = case("d09_6psu_nominal_identified")
    nominal, identified, mm = data["nominal"], data["identified"], 1e-3
    moved: dict[str, float] = {}
    for i in range(6):
        for k, name in enumerate("xyz"):
            moved[f"strut.{i + 1}.platform.{name}"] = (
                identified["a"][i][k] - nominal["a"][i][k]
            ) * mm
            moved[f"drive.d{i + 1}.origin.{name}"] = (
                identified["b"][i][k] - nominal["b"][i][k]
            ) * mm
        moved[f"strut.{i + 1}.length"] = (identified["l"][i] - nominal["l"][i]) * mm
        moved[f"drive.d{i + 1}.axis.u"] = identified["e"][i][0]
        moved[f"drive.d{i + 1}.axis.v"] = identified["e"][i][1]
    return moved
