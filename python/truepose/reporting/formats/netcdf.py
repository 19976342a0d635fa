"""NetCDF 4: the Dataset as it is, in SI, every variable with its units."""

from __future__ import annotations

import io
from importlib.util import find_spec
from pathlib import Path

from truepose.errors import Problem, RequestError
from truepose.reporting.result import Result


def write(result: Result, path: Path) -> None:
    """Write the Dataset to `path`. Raises `RequestError` (extra-missing) without h5netcdf."""
    missing = [name for name in ("h5netcdf", "h5py") if find_spec(name) is None]
    if missing:
        raise RequestError(
            Problem(
                "extra-missing",
                "writing NetCDF needs packages that are not installed",
                found="no " + " and no ".join(missing),
                expected="h5netcdf and h5py",
                hint="pip install 'truepose[netcdf]'",
            )
        )
    # In memory first: HDF5 leaves with a segmentation fault where a file cannot be written.
    content = io.BytesIO()
    result.dataset.to_netcdf(content, engine="h5netcdf")
    path.write_bytes(content.getbuffer())
