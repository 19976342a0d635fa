"""`[accuracy]`: what is asked of the machine."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field
from pydantic.json_schema import JsonSchemaValue

from truepose.files.file_table import FileTable
from truepose.files.quantity import AllowedAngle, AllowedLength, FileType
from truepose.files.units import QuantityError, UnitSystem, shown_value, type_phrase
from truepose.files.wording import did_you_mean
from truepose.machine.workspace import WORST

_PERCENTAGE = re.compile(
    r"\s*+[+-]?(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?+\s*+(?:%|percent)?\s*+\Z"
)
_EXPECTED = f'"{WORST}", or a coverage between 0 and 1, such as "95 %" or 0.95'


@dataclass(frozen=True)
class _Coverage(FileType):
    """The worst case, None, or a share of all machines between 0 and 1, both excluded."""

    def read(self, value: Any, units: UnitSystem) -> float | None:
        if value == WORST:
            return None
        if isinstance(value, str) and not _PERCENTAGE.match(value):
            raise QuantityError(
                "unknown-choice",
                f"expected {_EXPECTED}, found {shown_value(value)}",
                found=shown_value(value),
                expected=_EXPECTED,
                hint=did_you_mean(value, [WORST]) or 'a coverage is written "95 %" or 0.95',
            )
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise QuantityError(
                "wrong-type",
                f"expected {_EXPECTED}, found {type_phrase(value)}",
                found=shown_value(value),
                expected=_EXPECTED,
            )
        coverage = units.read(value, self.dimension)
        if not 0.0 < coverage < 1.0:
            raise QuantityError(
                "bad-probability",
                "a coverage is between 0 and 1, or between 0 % and 100 %, both excluded",
                found=shown_value(value),
                expected=_EXPECTED,
                hint=_hint(coverage, percent="%" in str(value) or "percent" in str(value)),
            )
        return coverage

    def json_schema(self) -> JsonSchemaValue:
        number = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}
        return {
            "anyOf": [number, {"type": "string"}],
            "x-takes": f'`"{WORST}"`, or a coverage such as `"95 %"` or `0.95`',
        }


def _hint(coverage: float, *, percent: bool) -> str:
    """What was most likely meant by a coverage outside (0, 1)."""
    if 1.0 < coverage < 100.0 and not percent:
        return f'{coverage:g} % is written "{coverage:g} %" or {coverage / 100.0:g}'
    if coverage >= 1.0:
        return f'at = "{WORST}" asks it of every machine inside the bands'
    return "a coverage is the share of all machines whose error may not exceed the target"


class AccuracyTable(FileTable):
    """The error that is allowed at the tool point."""

    target: AllowedLength | None = Field(None, description="Largest position error allowed.")
    angle_target: AllowedAngle | None = Field(
        None, description="Largest orientation error allowed, where the platform turns."
    )
    at: Annotated[float | None, _Coverage("ratio")] = Field(
        None,
        description="What must keep it at the worst pose: every machine inside the bands, or this "
        "share of all machines, drawn from the distributions with their correlations. "
        f'Default: `"{WORST}"`.',
    )
