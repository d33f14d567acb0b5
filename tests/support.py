"""What tests of several rooms share: the smallest result, and changes to files that stay results."""

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import netCDF4
import pytest
import xarray as xr

from mpmbench.results import digest, netcdf
from mpmbench.results.version import SCHEMA_VERSION

CONFIG = {
    "problem": {"name": "bar_fixed_ends"},
    "method": {"name": "mpm", "time": "explicit", "transfer": "flip", "mass": "lumped"},
    "basis": {"name": "linear"},
    "material": {"name": "linear_elastic"},
    "resolution": 8,
    "time_step": 1e-5,
    "end_time": 1e-3,
    "particles_per_cell": 4,
    "threads": 1,
    "timing": "shared",
    "repeats": 3,
    "snapshot_times": [1e-4],
    "campaign": "small",
    "limits": {"time": 100.0, "setup": 100.0, "memory": None},
}


def slow_if(costly: bool, *values: Any) -> Any:
    """One case of a test, slow where it is costly: kernels are compiled for each dimension, basis and material."""
    return pytest.param(*values, marks=[pytest.mark.slow] if costly else [])


def unbroken(printed: str) -> str:
    """What was printed, with lines whole again that had to be broken: they go on eight columns further in."""
    return re.sub(r"\n {8,}", " ", printed)


def small(**attributes: Any) -> xr.Dataset:
    """The smallest dataset that is a result, with one number."""
    names = {kind: CONFIG[kind]["name"] for kind in ("problem", "method", "basis", "material")}
    counts = {key: CONFIG[key] for key in ("resolution", "particles_per_cell", "threads")}
    attrs = {
        "schema_version": SCHEMA_VERSION,
        "status": "ok",
        "reason": "",
        "config": json.dumps(CONFIG),
        "config_hash": "0123456789abcdef",
        "code_hash": "0123456789abcdef",
        "code_files": "{}",
        **names,
        **counts,
        "mass": "lumped",
        "time_step": 1e-5,
        "started": "2020-01-01T00:00:00+00:00",
        "host": "here",
        "cpu": "none",
        "timing_context": "shared",
    }
    return xr.Dataset({"value": ((), 1.0, {"units": "m"})}, attrs=attrs | attributes)


def write(dataset: xr.Dataset, path: Path) -> None:
    """Write a dataset as a result."""
    variables = {
        str(name): (one.dims, one.values, one.attrs) for name, one in dataset.variables.items()
    }
    netcdf.write(variables, dataset.attrs, path)


@contextmanager
def edited(file: Path) -> Iterator[netCDF4.Dataset]:
    """A result file open for changes; its digest fits afterwards, as if it had been written so."""
    with netCDF4.Dataset(file, "a") as data:
        yield data
    digest.seal(file)
