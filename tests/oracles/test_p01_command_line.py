"""P01 from the command line's JSON: every joint, force, error and residual to the digits given."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from command_line import PLANAR
from truepose.cli import run

CASE = json.loads(
    (Path(__file__).parent / "cases" / "p01_planar_two_slider.json").read_text(encoding="utf-8")
)["outputs"]
MM = 1e-9
NEWTON = 1e-6


@pytest.fixture(scope="module")
def documents(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("p01")
    for command in ("budget", "compensate"):
        assert run([command, str(PLANAR), "--output", str(folder / f"{command}.json")]) == 0
    return {
        command: json.loads((folder / f"{command}.json").read_text(encoding="utf-8"))
        for command in ("budget", "compensate")
    }


def values(document: dict[str, Any], name: str, unit: str) -> NDArray[np.float64]:
    variable = document["variables"][name]
    assert variable["units"] == unit
    return np.array(variable["values"], dtype=float)


@pytest.mark.parametrize(
    ("command", "variable", "source", "unit", "expected", "tolerance"),
    [
        ("budget", "joint_nominal", None, "mm", CASE["joints_nominal_mm"], MM),
        ("budget", "force", None, "N", CASE["strut_force_N"], NEWTON),
        ("budget", "error_upper", "tolerance", "mm", CASE["errors_mm"]["tolerance_max"], MM),
        ("budget", "error_lower", "tolerance", "mm", CASE["errors_mm"]["tolerance_min"], MM),
        ("budget", "error", "thermal", "mm", CASE["errors_mm"]["thermal"], MM),
        ("budget", "error", "elastic", "mm", CASE["errors_mm"]["elastic"], MM),
        ("budget", "overall_error_upper", None, "mm", CASE["errors_mm"]["overall_max"], MM),
        ("budget", "overall_error_lower", None, "mm", CASE["errors_mm"]["overall_min"], MM),
        ("compensate", "joint_corrected", None, "mm", CASE["joints_compensated_mm"], MM),
        (
            "compensate", "residual_upper", None, "mm",
            CASE["residual_after_compensation_mm"]["at_max"], MM,
        ),
        (
            "compensate", "residual_lower", None, "mm",
            CASE["residual_after_compensation_mm"]["at_min"], MM,
        ),
        ("compensate", "residual_middle", None, "mm", np.zeros((25, 2)), MM),
    ],
)  # fmt: skip
def test_values_at_every_pose(
    documents: dict[str, Any],
    command: str,
    variable: str,
    source: str | None,
    unit: str,
    expected: Any,
    tolerance: float,
) -> None:
    document = documents[command]
    found = values(document, variable, unit)
    if source is not None:
        found = found[:, document["coordinates"]["source"]["values"].index(source)]
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def test_poses(documents: dict[str, Any]) -> None:
    for document in documents.values():
        found = [document["coordinates"][f"pose_{name}"]["values"] for name in "xy"]
        np.testing.assert_allclose(np.transpose(found), CASE["poses_mm"], rtol=0, atol=MM)
