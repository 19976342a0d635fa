"""Words of the key `varies`: with what the variable of an error has another value."""

from __future__ import annotations

from typing import Final, Literal

MACHINE: Final = "machine"
RUN: Final = "run"
POSITION: Final = "position"
DIRECTION: Final = "direction"
VISIT: Final = "visit"

ByItself = Literal["machine", "run", "visit"]
"""What any error may vary with."""

HINT = "docs/variation.md says what varies with what"
