"""docs/results.md and the Datasets say the same: every name, its dims and its units."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import truepose as tp
from build_machine import MACHINES
from truepose.compensation import SCHEMA as COMPENSATION
from truepose.error_budget.at_poses import SCHEMA as BUDGET
from truepose.error_budget.over_time import SCHEMA as OVER_TIME
from truepose.error_budget.strain import SCHEMA as STRAIN
from truepose.error_budget.summary import SUMMARY
from truepose.machine.temperature_log import TemperatureLog
from truepose.uncertainty_analysis.bounds import SCHEMA as BOUNDS
from truepose.uncertainty_analysis.bounds_over_region import SCHEMA as REGION
from truepose.uncertainty_analysis.monte_carlo import ELLIPSE, MACHINE
from truepose.uncertainty_analysis.monte_carlo import SCHEMA as MONTE_CARLO
from truepose.uncertainty_analysis.region_search import UNFINISHED
from truepose.uncertainty_analysis.shares import CORRELATED
from truepose.uncertainty_analysis.shares import SCHEMA as SHARES
from truepose.uncertainty_analysis.uncertainty import SCHEMA as UNCERTAINTY
from truepose.uncertainty_analysis.uncertainty import VALIDATION
from truepose.uncertainty_analysis.worst_case import SCHEMA as WORST_CASE

PAGE = (Path(__file__).parents[3] / "docs" / "results.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| (?P<name>[^|]+) \| (?P<dims>[^|]+) \| (?P<units>[^|]+) \| (?P<text>.+) \|$")

PRODUCTS = {"m^2", "m rad", "rad^2"}
HEADER = ("variable", "coordinate", "---")


def section(title: str) -> dict[str, tuple[str, str]]:
    """Name -> (dims, units) of the table in a section of the page."""
    text = PAGE.split(f"\n## {title}\n")[1].split("\n## ")[0]
    rows = (ROW.match(line) for line in text.splitlines())
    found = {row["name"]: (row["dims"], row["units"]) for row in rows if row}
    assert found
    return {name: cells for name, cells in found.items() if name not in HEADER}


def warm(machine: tp.Machine) -> tp.Condition:
    """The machine's condition with a log of two moments."""
    log = TemperatureLog(np.array([0.0, 60.0]), {"default": np.array([293.15, 303.15])})
    return machine.condition.replace(temperature_log=log)


MADE: dict[str, Callable[[tp.Machine, np.ndarray], xr.Dataset]] = {
    "Budget": tp.budget,
    "Summary of a budget": lambda machine, poses: tp.budget(machine, poses, summary=True),
    "Compensation": tp.compensate,
    "Over time": lambda machine, poses: tp.over_time(machine, poses, warm(machine)),
    "Internal forces": tp.strain,
    "Monte Carlo": lambda machine, poses: tp.monte_carlo(machine, poses, samples=2000),
    "Uncertainty": lambda machine, poses: tp.uncertainty(
        machine, poses, validate=True, samples=2000
    ),
    "Worst case": lambda machine, poses: tp.worst_case(machine, poses),
    "Bounds": lambda machine, poses: tp.bounds(machine, poses),
    "Bounds over a region": lambda machine, poses: tp.bounds(
        machine, region={"x": (0.29, 0.31), "y": (0.19, 0.21)}, gap=0.2
    ),
    "Shares": lambda machine, poses: tp.shares(machine, poses, samples=64),
}


@cache
def made(title: str, name: str) -> xr.Dataset:
    """A result of a machine at its first poses."""
    machine = tp.load(MACHINES / f"{name}.toml")
    return MADE[title](machine, machine.poses()[:3])


SCHEMAS = {
    "Budget": BUDGET,
    "Summary of a budget": SUMMARY,
    "Compensation": COMPENSATION,
    "Over time": OVER_TIME,
    "Internal forces": STRAIN,
    "Monte Carlo": {**MONTE_CARLO, **MACHINE, **ELLIPSE},
    "Uncertainty": {**UNCERTAINTY, **VALIDATION},
    "Worst case": WORST_CASE,
    "Bounds": BOUNDS,
    "Bounds over a region": {**REGION, **UNFINISHED},
    "Shares": {**SHARES, **CORRELATED},
}
# What only some Datasets of a kind have.
NOT_HERE = {"Shares": CORRELATED.keys(), "Bounds over a region": UNFINISHED.keys()}
SEEDED = ("Monte Carlo", "Uncertainty", "Shares")
MACHINES_OF = {
    "Internal forces": ["overconstrained"],
    "Bounds over a region": ["planar_two_slider"],
}
CASES = [
    (title, name)
    for title in SCHEMAS
    for name in MACHINES_OF.get(title, ["linear_delta", "planar_two_slider", "hexapod"])
]
FIRST = dict(reversed(CASES))


@pytest.mark.parametrize(("title", "schema"), SCHEMAS.items())
def test_the_page_has_the_schema(title: str, schema: dict[str, object]) -> None:
    assert section(title) == {
        name: (", ".join(variable.dims) or "none", variable.units)
        for name, variable in schema.items()
    }


@pytest.mark.parametrize(("title", "name"), CASES)
def test_the_dataset_has_what_the_page_says(title: str, name: str) -> None:
    dataset = made(title, name)
    variables = {
        name: cells for name, cells in section(title).items() if name not in NOT_HERE.get(title, ())
    }
    # xarray makes a coordinate of a variable that is named as one of its dims.
    found = {key for key in variables if key in dataset.data_vars or key in dataset.coords}
    assert found == set(variables)
    assert set(dataset.data_vars) <= set(variables)
    for key, (dims, _) in variables.items():
        assert (", ".join(dataset[key].dims) or "none") == dims
    named = section("Coordinates")
    for key in set(dataset.coords) - set(variables):
        generic = re.sub(r"^(pose|left_out)_(x|y|z|a|b|c)$", r"\1_F", str(key))
        assert ", ".join(dataset[key].dims) == named[generic][0]


@pytest.mark.parametrize(("title", "name"), CASES)
def test_everything_carries_its_unit_and_name(title: str, name: str) -> None:
    dataset = made(title, name)
    for variable in {**dataset.data_vars, **dataset.coords}.values():
        assert variable.attrs["long_name"]
        units = variable.attrs["units"].split(", ")
        assert set(units) <= {"m", "rad", "N", "%", "1", "K", "s", *PRODUCTS}
        if len(units) > 1 and not set(units) <= PRODUCTS:
            by = dataset[variable.attrs["units_by"]]
            assert set(by.values) == set(units)
            assert by.dims[0] in variable.dims


@pytest.mark.parametrize(("title", "name"), FIRST.items())
def test_provenance(title: str, name: str) -> None:
    attributes = made(title, name).attrs
    page = PAGE.split("\n## Attributes\n")[1]
    assert all(re.search(rf"\b{name}\b", page) for name in attributes)
    assert attributes["machine_file"] == f"{name}.toml"
    assert re.fullmatch("[0-9a-f]{64}", attributes["machine_hash"])
    assert attributes["truepose_version"] == tp.__version__
    assert attributes["seed"] == (0 if title in SEEDED else "none")


@pytest.mark.parametrize(("title", "name"), FIRST.items())
def test_a_dataset_is_written_and_read_again(title: str, name: str, tmp_path: Path) -> None:
    dataset = made(title, name)
    dataset.to_netcdf(tmp_path / "result.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "result.nc", engine="h5netcdf") as read:
        for name in dataset.variables:
            assert (read[name].values == dataset[name].values).all() or read[name].isnull().any()
        assert read.attrs == dataset.attrs


def test_what_is_cited_of_the_paper() -> None:
    """Equation 8 is the percent of a source, 9 that of all together; table 5 has sources only.

    Of every variable with a percent or a highest error the page cites what belongs to it.
    """
    text = PAGE.split("\n## Budget\n")[1].split("\n## ")[0]
    rows = [row for row in map(ROW.match, text.splitlines()) if row]
    cited = {row["name"]: set(re.findall(r"eq\. [\d-]+|table \d", row["text"])) for row in rows}
    for name, found in cited.items():
        overall = name.startswith("overall_")
        alone = name.removeprefix("overall_")
        if alone in ("percent_lower", "percent_upper"):
            assert found == {"eq. 9" if overall else "eq. 8"}, name
        elif alone in ("highest_lower", "highest_upper"):
            assert found == (set() if overall else {"table 5"}), name
        else:
            assert not found & {"eq. 8", "eq. 9", "table 5"}, name
