"""Two results that have to be the same one, told in other units or of a machine of other size."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr

RELATIVE = 1e-9
"""By which numbers may differ for themselves."""

ROUNDING = {"m": 1e-13, "rad": 1e-13, "N": 1e-10, "K": 1e-10, "1": 1e-10, "%": 1e-7, "s": 1e-9}
"""And by their unit, SI, of machines of about a metre.

A displacement is what is left of two positions of that size, each good to a few 1e-16, times what a
machine near a border amplifies; a force what is left of all that act. A percentage divides by a
coordinate, which may be a thousandth of a metre.
"""


def by_unit(variable: xr.DataArray, of_unit: Mapping[str, float]) -> xr.DataArray:
    """What `of_unit` says of a variable's units, to multiply with it; of a product, the product."""

    def along(coordinate: str) -> xr.DataArray:
        names = variable.coords[coordinate]
        return xr.DataArray([of_unit[str(unit)] for unit in names.values], dims=names.dims)

    if "other_component" in variable.dims:
        one = along("component_units")
        return one * one.rename(component="other_component")
    if "units_by" in variable.attrs:
        return along(str(variable.attrs["units_by"]))
    base, _, power = str(variable.attrs["units"]).partition("^")
    return xr.DataArray(of_unit[base] ** int(power or 1))


def assert_same(
    first: xr.Dataset,
    second: xr.Dataset,
    factors: Mapping[str, float] | None = None,
    *,
    relative: float = RELATIVE,
    but: tuple[str, ...] = (),
) -> None:
    """Every variable of the second is the first's, by units times `factors`, but for rounding."""
    of_unit = dict.fromkeys(ROUNDING, 1.0) | dict(factors or {})
    assert list(first.data_vars) == list(second.data_vars)
    assert dict(first.sizes) == dict(second.sizes)
    for name, variable in first.data_vars.items():
        if name in but:
            continue
        other = second[name]
        if variable.dtype.kind != "f":
            assert (variable.values == other.values).all(), name
            continue
        expected = variable.drop_vars(list(variable.coords))
        found = other.drop_vars(list(other.coords)) / by_unit(variable, of_unit)
        allowed = by_unit(variable, ROUNDING) + relative * abs(expected)
        same = (found == expected) | (found.isnull() & expected.isnull())
        assert (same | (abs(found - expected) <= allowed)).all(), _told(str(name), found, expected)


def _told(name: str, found: xr.DataArray, expected: xr.DataArray) -> str:
    gap, size = float(abs(found - expected).max()), float(abs(expected).max())
    return f"{name}: off by up to {gap:.3g} where the largest is {size:.3g}"
