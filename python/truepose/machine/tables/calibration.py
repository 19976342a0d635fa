"""`[calibration]`: how the numbers of a calibrated machine file came about."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, Field

from truepose.errors import Fault
from truepose.files.file_table import FileTable, Name
from truepose.files.quantity import refuse
from truepose.files.units import shown_value

_HASH = re.compile(r"[0-9a-f]{64}")


def _sha256(value: str) -> str:
    if not _HASH.fullmatch(value):
        refuse(
            Fault(
                "bad-hash",
                "a hash is the SHA-256 of a file's bytes",
                found=shown_value(value),
                expected="64 digits among 0-9 and a-f",
            )
        )
    return value


def _rms(value: float) -> float:
    if not 0.0 <= value < float("inf"):
        refuse(
            Fault(
                "negative" if value < 0.0 else "not-finite",
                "the rms of residuals is a number of zero or more",
                found=shown_value(value),
                expected="a plain number of zero or more",
            )
        )
    return value


def _count(value: int) -> int:
    if value < 0:
        refuse(
            Fault(
                "negative",
                "a number of observations is zero or more",
                found=shown_value(value),
                expected="a whole number of zero or more",
            )
        )
    return value


Hash = Annotated[str, AfterValidator(_sha256)]
Rms = Annotated[float, AfterValidator(_rms)]
Count = Annotated[int, AfterValidator(_count)]


class CalibrationTable(FileTable):
    """Where a calibrated machine file comes from: written by `truepose calibrate`, not by hand."""

    data: Name = Field(description="Name of the file of measurements.")
    data_hash: Hash = Field(description="SHA-256 of that file.")
    machine: Name = Field(description="Name of the machine file that was calibrated.")
    machine_hash: Hash = Field(description="SHA-256 of that file.")
    date: Name = Field(description="The date that the caller gave.")
    version: Name = Field(description="The version of truepose that calibrated.")
    observations: Count = Field(description="How many measured numbers were fitted.")
    residual_rms_before: Rms = Field(
        description="Rms of the residuals before, each divided by its uncertainty."
    )
    residual_rms_after: Rms = Field(description="The same after the fit.")
    residual_rms_held_out: Rms | None = Field(
        None, description="The same after, of measurements that were kept from the fit."
    )
    warning: list[str] = Field(
        default_factory=list, description="What speaks against the result, which was forced."
    )
