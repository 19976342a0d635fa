"""What a test says of itself, and what it is asked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class TestOption:
    """An option of a test on the command line: `--NAME`.

    `doc`: a sentence; `dimension`: of a quantity, a key of `files.dimensions.DIMENSIONS`, or
    "place" (coordinates by name), "word", "file"; `required`: whether the test cannot be without.
    """

    __test__ = False  # to pytest, which collects by name

    doc: str
    dimension: str
    required: bool = False


@dataclass(frozen=True)
class MachineTest:
    """A test: its `name`, one sentence of `doc`, the `standard` with its edition.

    `options` by name. `run(machine, samples=, seed=, probability=, progress=, ...)` takes those
    that were given, quantities in SI, and returns the result. `reporting`: the module that shows
    it, with `summary` and `tables` (machine, result) and `csv_text` (result); `page`: the one of
    its HTML page, with `write(machine, result, path)`.
    """

    name: str
    doc: str
    standard: str
    options: Mapping[str, TestOption]
    run: Callable[..., xr.Dataset]
    reporting: str
    page: str
