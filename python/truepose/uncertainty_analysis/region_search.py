"""How far the search for bounds over a region is: in its result, and back, so that it goes on.

The kernel has the bounds in rows of targets: the lower ends of the components, their upper ends,
the sizes of position and orientation. A result has them by name.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Problem, RequestError
from truepose.machine import Machine
from truepose.runs.dataset import Schema, Variable
from truepose.runs.quantities import quantities

if TYPE_CHECKING:
    import xarray as xr

UNFINISHED: Schema = {
    "part_from": Variable(("part", "commanded"), "commanded", "lower ends of an unfinished part"),
    "part_to": Variable(("part", "commanded"), "commanded", "upper ends of an unfinished part"),
    "part_lower": Variable(
        ("part", "component"), "component", "proven bound in the part, missing without any"
    ),
    "part_upper": Variable(
        ("part", "component"), "component", "proven bound in the part, missing without any"
    ),
    "part_magnitude": Variable(
        ("part", "quantity"), "quantity", "proven bound in the part, missing without any"
    ),
    "finished_lower": Variable(
        ("component",), "component", "proven bound in all other parts, missing without any"
    ),
    "finished_upper": Variable(
        ("component",), "component", "proven bound in all other parts, missing without any"
    ),
    "finished_magnitude": Variable(
        ("quantity",), "quantity", "proven bound in all other parts, missing without any"
    ),
}
"""What a result has besides where the search for it did not come to its end."""

SAME = (
    "machine_hash",
    "data_files",
    "settings",
    "replaced",
    "condition",
    "region",
    "gap",
    "truncate",
)
"""Attributes of a result that one that goes on has, too."""

Earlier = tuple[Floats, Floats, Floats, Floats, Floats, int]
"""Ends of the parts, their bounds, those of all others, what is reached, where; boxes looked at."""


def by_name(machine: Machine, row: Floats, name: str = "") -> dict[str, Floats]:
    """Rows of targets (..., 2 n_component + n_quantity) -> `lower`, `upper`, `magnitude`."""
    n = len(machine.components)
    ends = {"lower": row[..., :n], "upper": row[..., n : 2 * n], "magnitude": row[..., 2 * n :]}
    return {f"{name}{end}": values for end, values in ends.items()}


def unfinished(machine: Machine, proof: Mapping[str, Any]) -> dict[str, Floats]:
    """The variables of `UNFINISHED` of what the kernel found; none where all is finished."""
    if not len(proof["part_sides"]):
        return {}
    sides = np.asarray(proof["part_sides"], np.float64)
    return {
        "part_from": sides[..., 0],
        "part_to": sides[..., 1],
        **by_name(machine, _finite_or_missing(proof["part_bound"]), "part_"),
        **by_name(machine, _finite_or_missing(proof["finished"]), "finished_"),
    }


def _finite_or_missing(bounds: Any) -> Floats:
    values = np.asarray(bounds, np.float64)
    return np.where(np.isfinite(values), values, np.nan)


def earlier(machine: Machine, resume: xr.Dataset, asked: Mapping[str, object]) -> Earlier:
    """What the kernel goes on from. Raises `RequestError` (bad-resume).

    `asked`: the attributes `SAME` as they are asked now.
    """
    lacking = [name for name in ("reached_upper", "boxes", *UNFINISHED) if name not in resume]
    if lacking:
        raise bad_resume(
            "there is nothing to go on with",
            f"a result without {', '.join(lacking)}",
            "a result of bounds over a region that was interrupted or ran out of parts",
        )
    for name in SAME:
        if str(resume.attrs.get(name)) != str(asked.get(name)):
            raise bad_resume(
                f"its {name.replace('_', ' ')} is another",
                f"{resume.attrs.get(name)}",
                f"{asked.get(name)}",
            )
    sides = np.stack([resume["part_from"].values, resume["part_to"].values], axis=-1)
    return (
        sides,
        _row(machine, resume, "part_{}"),
        _or_none(machine, _row(machine, resume, "finished_{}")),
        _or_none(machine, _row(machine, resume, "reached_{}")),
        np.concatenate(
            [resume[name].values for name in ("where_lower", "where", "where_magnitude")]
        ),
        int(resume["boxes"]),
    )


def _or_none(machine: Machine, row: Floats) -> Floats:
    """A row of targets in which what is missing is as low as can be, of lower ends as high."""
    n = len(machine.components)
    none = np.repeat([np.inf, -np.inf], [n, row.size - n])
    return np.where(np.isfinite(row), row, none)


def _row(machine: Machine, resume: xr.Dataset, name: str) -> Floats:
    """The variables of a result as rows of targets. Raises `RequestError` (bad-resume)."""
    lengths = {
        "component": len(machine.components),
        "quantity": len(quantities(machine.components)),
    }
    ends = [resume[name.format(end)] for end in ("lower", "upper", "magnitude")]
    if any(resume.sizes.get(dim) != length for dim, length in lengths.items()):
        raise bad_resume("it is of another machine", f"{dict(resume.sizes)}", f"{lengths}")
    return np.concatenate([np.asarray(values.values, np.float64) for values in ends], axis=-1)


def bad_resume(message: str, found: str, expected: str) -> RequestError:
    """The refusal of a result that no search can go on from."""
    return RequestError(
        Problem(
            "bad-resume",
            f"the search cannot go on from this result: {message}",
            found=found,
            expected=expected,
        )
    )


__all__ = ["SAME", "UNFINISHED", "bad_resume", "by_name", "earlier", "unfinished"]
