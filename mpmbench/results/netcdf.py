"""The result file: written whole or not at all, and read back."""

import os
import threading
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import xarray as xr

from mpmbench.results.one_move import in_one_move
from mpmbench.results.timings import UNITS
from mpmbench.settings.schema import BadInput

STATUSES = (
    "ok", "diverged", "broke_down", "not_converged", "timeout", "crashed", "out_of_memory", "interrupted",
    "not_applicable",
)  # fmt: skip
_one_at_a_time = threading.Lock()  # the HDF5 library crashes when two threads read
HEADERS = 2**16  # bytes that a file holds besides its arrays, about


def write(dataset: xr.Dataset, path: Path) -> None:
    """Write `dataset` to `path`: under a temporary name, then moved into place.

    Raises
    ------
    OSError
        When the folder or the disk cannot take it; the temporary file is gone and an older result
        is kept.
    """
    with in_one_move(path) as temporary:
        try:
            dataset.to_netcdf(temporary, engine="netcdf4")
            with open(temporary, "rb+") as file:
                os.fsync(file.fileno())
        except (OSError, RuntimeError) as error:  # the netCDF library hides that a disk is full
            raise refusal(temporary, dataset.nbytes) or OSError(str(error)) from None


def refusal(place: Path, size: int) -> OSError | None:
    """What the system says to a file of that size [bytes] and its headers; None when it takes one."""
    try:
        place.write_bytes(bytes(size + HEADERS))
    except OSError as error:
        return error
    return None


def read_attributes(path: Path) -> dict[str, Any] | None:
    """Attributes of a result file; None when it does not exist or is no result."""
    try:
        with _one_at_a_time, netCDF4.Dataset(path) as file:
            attributes = plain_attributes(file)
    except OSError:
        return None
    is_result = "config_hash" in attributes and attributes.get("status") in STATUSES
    return attributes if is_result else None


def plain_attributes(file: netCDF4.Dataset) -> dict[str, Any]:
    """Attributes of an open file as text, numbers and lists of numbers; timings always as lists."""
    found = {name: file.getncattr(name) for name in file.ncattrs()}
    numbers = {name: value.tolist() for name, value in found.items() if hasattr(value, "tolist")}
    timings = {name: np.atleast_1d(found.get(name, [])).tolist() for name in UNITS}
    return found | numbers | timings


def read_scalars(path: Path) -> tuple[dict[str, Any], dict[str, tuple[Any, dict[str, str]]]]:
    """Attributes and scalar variables (value and attributes) of a result file.

    Raises
    ------
    BadInput
        When the file cannot be read or is no result of this program.
    """
    try:
        with _one_at_a_time, netCDF4.Dataset(path) as file:
            attributes = plain_attributes(file)
            scalars: dict[str, tuple[Any, dict[str, str]]] = {}
            for name, variable in file.variables.items():
                if variable.dimensions == ():
                    value = np.ma.filled(variable[...].astype(float), np.nan)[()]
                    known = [key for key in ("units", "long_name") if key in variable.ncattrs()]
                    scalars[name] = (value, {key: str(variable.getncattr(key)) for key in known})
    except (OSError, RuntimeError, ValueError) as error:
        raise BadInput(f"{path}: cannot be read as netCDF: {error}") from None
    if "config_hash" not in attributes:
        raise BadInput(f"{path}: not a result of mpmbench")
    return attributes, scalars
