"""What every table of a machine file has in common: strictness, and names."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from truepose.errors import Fault
from truepose.files.dimensions import FREEDOMS
from truepose.files.limits import LONGEST_NAME
from truepose.files.names import fault_of_name
from truepose.files.quantity import refuse
from truepose.files.units import shown_value


class FileTable(BaseModel):
    """A table of the file: no key that it does not know, no value of another type than asked."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


def _one_line(value: str) -> str:
    wrong = fault_of_name(value)
    if wrong is not None:
        refuse(
            Fault(
                "bad-name",
                "a name is one line that is not empty, of at most "
                f"{LONGEST_NAME} characters, all of which are seen",
                found=wrong,
                expected='a name, such as "1" or "left"',
            )
        )
    return value


def _no_pattern(value: str) -> str:
    if any(mark in value for mark in ".*="):
        refuse(
            Fault(
                "bad-name",
                "a part's name holds no point, star or equals sign, which mean something in paths",
                found=shown_value(value),
                expected='a name, such as "1" or "left"',
            )
        )
    return value


def _in_order(value: list[str]) -> list[str]:
    doubled = sorted({freedom for freedom in value if value.count(freedom) > 1})
    if doubled:
        refuse(
            Fault(
                "duplicate-name",
                f"{', '.join(doubled)} appears more than once",
                found=shown_value(value),
                expected="every freedom once",
            )
        )
    if value != sorted(value, key=list(FREEDOMS).index):
        refuse(
            Fault(
                "freedom-order",
                "the freedoms are not in the order x y z a b c",
                found=shown_value(value),
                expected=f"the order {' '.join(FREEDOMS)}",
                hint="poses list their coordinates in this order",
            )
        )
    return value


Name = Annotated[str, AfterValidator(_one_line)]
PartName = Annotated[str, AfterValidator(_one_line), AfterValidator(_no_pattern)]
Freedom = Literal["x", "y", "z", "a", "b", "c"]
Freedoms = Annotated[list[Freedom], Field(min_length=1), AfterValidator(_in_order)]
