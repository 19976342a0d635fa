"""NetCDF 4: the Dataset as it is, in SI, every variable with its units."""

from __future__ import annotations

import io
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

from truepose.errors import Problem, RequestError
from truepose.files.text_file import FileKind, require_input
from truepose.reporting.result import Result

if TYPE_CHECKING:
    import xarray as xr

ENGINE: Final = "h5netcdf"

RESULT = FileKind("a result in NetCDF", ".nc")

MOST_BYTES = 1_000_000_000
"""Of a result that is read."""


def write(result: Result, path: Path) -> None:
    """Write the Dataset to `path`. Raises `RequestError` (extra-missing) without h5netcdf."""
    _require("writing")
    # In memory first: HDF5 leaves with a segmentation fault where a file cannot be written.
    content = io.BytesIO()
    result.dataset.to_netcdf(content, engine=ENGINE)
    path.write_bytes(content.getbuffer())


def read(path: Path) -> xr.Dataset:
    """The Dataset that `write` wrote to `path`, all of it in memory.

    Raises `RequestError` (extra-missing) without h5netcdf, and for what cannot be read
    (file-missing, file-is-directory, file-unreadable, file-too-large, output-is-input).
    """
    _require("reading")
    require_input(path, RESULT)
    import xarray as xr

    try:
        with xr.open_dataset(io.BytesIO(path.read_bytes()), engine=ENGINE) as dataset:
            if dataset.nbytes > MOST_BYTES:
                raise RequestError(
                    Problem(
                        "file-too-large",
                        f"{path} holds too much",
                        str(path),
                        found=f"{dataset.nbytes / 1e6:,.0f} MB",
                        expected=f"at most {MOST_BYTES / 1e6:,.0f} MB",
                    )
                )
            return dataset.load()
    except (OSError, ValueError, KeyError, RuntimeError) as failure:
        raise RequestError(
            Problem(
                "file-unreadable",
                f"{path} is no result in NetCDF",
                str(path),
                found=str(failure),
                expected="a result that --output wrote to a file ending in .nc",
            )
        ) from None


def _require(what: str) -> None:
    missing = [name for name in (ENGINE, "h5py") if find_spec(name) is None]
    if missing:
        raise RequestError(
            Problem(
                "extra-missing",
                f"{what} NetCDF needs packages that are not installed",
                found="no " + " and no ".join(missing),
                expected="h5netcdf and h5py",
                hint="pip install 'truepose[netcdf]'",
            )
        )
