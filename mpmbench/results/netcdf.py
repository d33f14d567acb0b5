"""The result file: written whole or not at all, and read back only when it is as it was written.

Nothing else opens result files.
"""

import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import netCDF4
import numpy as np

from mpmbench.results import apart, digest, layout
from mpmbench.results.one_move import in_one_move
from mpmbench.results.timings import UNITS

if TYPE_CHECKING:
    import xarray as xr  # a third of a second, which a run can do without

Variables = Mapping[str, tuple[Any, ...]]  # by name: dimensions, values and labels
Taken = TypeVar("Taken")
SNAPSHOTS = "snapshot_time"  # the variable with the instants of what has the dimension `snapshot`
Scalar = tuple[float, dict[str, str]]  # value, and its units and long name as far as it has them


@dataclass(frozen=True)
class History:
    """A series over time and its unit."""

    values: np.ndarray
    unit: str


_one_at_a_time = threading.Lock()  # the HDF5 library crashes when two threads read
HEADERS = 2**16  # bytes that a file holds besides its arrays, about


class Damaged(Exception):
    """A file that is no result, or not as it was written; `reason` says why without its name."""

    def __init__(self, path: Path, reason: str) -> None:
        printable = "".join(sign if sign.isprintable() else " " for sign in reason)
        self.reason = " ".join(printable.split())
        super().__init__(f"{path}: {self.reason}")


class Missing(Damaged):
    """A file that is not there."""


def write(variables: Variables, attributes: Mapping[str, Any], path: Path) -> None:
    """Write variables with their digest to `path`: under a temporary name, then moved into place.

    Raises
    ------
    OSError
        When the folder or the disk cannot take it; the temporary file is gone and an older result
        is kept.
    ValueError, TypeError
        When a variable is none that a file can hold.
    """
    text = {"long_name": "checked whenever this file is read"}
    seal = np.frombuffer(digest.EMPTY, dtype="S1")
    with in_one_move(path) as temporary:
        try:
            with netCDF4.Dataset(temporary, "w") as file:
                # First of all, so that what is left of a file that was cut has it.
                variable, array = define(file, digest.VARIABLE, ("text",), seal, text)
                variable[...] = array
                file.setncatts(attributes)
                # All are defined before any has values: the library writes its headers once for that.
                defined = [
                    define(file, name, (dims,) if isinstance(dims, str) else dims, values, labels)
                    for name, (dims, values, labels) in variables.items()
                ]
                for variable, array in defined:
                    variable[...] = array
            digest.seal(temporary)
        except (OSError, RuntimeError) as error:  # the netCDF library hides that a disk is full
            size = sum(np.asarray(values).nbytes for _, values, _ in variables.values())
            raise refusal(temporary, size) or OSError(str(error)) from None


def define(
    file: netCDF4.Dataset, name: str, dims: Iterable[str], values: Any, labels: Mapping[str, str]
) -> tuple[netCDF4.Variable, np.ndarray]:
    """Define one variable, with what the convention CF wants readers to know of it; it and its values."""
    dims, array = tuple(dims), np.asarray(values)
    if len(dims) != array.ndim:
        raise ValueError(f"{name} has {array.ndim} axes, and {len(dims)} names for them")
    for dim, size in zip(dims, array.shape, strict=True):
        known = file.dimensions.get(dim) or file.createDimension(dim, size)
        if len(known) != size:
            raise ValueError(f"{name}: {dim} has {size} entries here and {len(known)} elsewhere")
    kind: Any = array.dtype
    if kind.kind == "U":
        kind, array = str, array.astype(object)
    elif kind.kind not in "iufS":
        raise TypeError(f"{name}: numbers or text are needed, and not {kind}")
    unknown = np.nan if array.dtype.kind == "f" else None
    variable = file.createVariable(name, kind, dims, fill_value=unknown)
    variable.setncatts(labels)
    if "snapshot" in dims and name != SNAPSHOTS:
        variable.coordinates = SNAPSHOTS
    return variable, array


def refusal(place: Path, size: int) -> OSError | None:
    """What the system says to a file of that size [bytes] and its headers; None when it takes one."""
    try:
        place.write_bytes(bytes(size + HEADERS))
    except OSError as error:
        return error
    return None


def read_attributes(path: Path) -> dict[str, Any]:
    """Attributes of a result file: text, numbers and lists of numbers; timings always as lists.

    ``digest`` is among them, empty for a file of an older version: what it holds is unverified.

    Raises
    ------
    Damaged
        When the file is no result of this program, was changed after it had been written, or is not
        there (`Missing`).
    """
    return _read(path, lambda file: None)[0]


def look(path: Path) -> tuple[dict[str, Any] | None, str]:
    """Attributes of a result file, or why it is damaged; neither when there is no such file."""
    try:
        return read_attributes(path), ""
    except Missing:
        return None, ""
    except Damaged as damaged:
        return None, damaged.reason


def read_scalars(path: Path) -> tuple[dict[str, Any], dict[str, Scalar]]:
    """Attributes and scalar variables of a result file; raises like `read_attributes`."""

    def take(file: netCDF4.Dataset) -> dict[str, Scalar]:
        found = {}
        for name, variable in layout.variables_of(file).items():
            if variable.dimensions == () and layout.is_numeric(variable):
                said = {key: variable.getncattr(key) for key in layout.labels_of(variable)}
                found[name] = (float(variable[...]), said)
        return found

    return _read(path, take)


def read_arrays(path: Path, wanted: Iterable[str]) -> dict[str, np.ndarray]:
    """Those of the wanted variables that a result file has; raises like `read_attributes`."""

    def take(file: netCDF4.Dataset) -> dict[str, np.ndarray]:
        known = layout.variables_of(file)
        return {name: known[name][...] for name in wanted if name in known}

    return _read(path, take)[1]


def read_histories(path: Path) -> dict[str, History]:
    """Numbers over the time of a result file by name, ``time`` among them; raises like `read_attributes`."""

    def take(file: netCDF4.Dataset) -> dict[str, History]:
        found = {}
        for name, variable in layout.variables_of(file).items():
            if variable.dimensions == ("time",) and layout.is_numeric(variable):
                unit = variable.getncattr("units") if "units" in variable.ncattrs() else ""
                found[name] = History(np.asarray(variable[...], dtype=float), unit)
        return found

    return _read(path, take)[1]


def load(path: Path) -> "xr.Dataset":
    """A whole result file in memory; times stay numbers of seconds; raises like `read_attributes`."""
    import xarray as xr

    def take(file: netCDF4.Dataset) -> "xr.Dataset":
        store = xr.backends.NetCDF4DataStore(file)
        hidden = [name for name in file.variables if name not in layout.variables_of(file)]
        return xr.open_dataset(store, decode_cf=False).drop_vars(hidden).load()

    return _read(path, take)[1]


def read_end_state(path: Path) -> tuple[np.ndarray, str] | None:
    """The numbers at the end of a run, and what they are, as JSON; None where the file has none.

    Raises like `read_attributes`.
    """

    def take(file: netCDF4.Dataset) -> tuple[np.ndarray, str] | None:
        names = (layout.END_STATE, f"{layout.END_STATE}_places")
        if any(name not in file.variables for name in names):
            return None
        row, places = (file.variables[name][...] for name in names)
        text = np.asarray(places, dtype=np.uint8).tobytes().decode(errors="replace")
        return np.asarray(row, dtype=float).ravel(), text

    return _read(path, take)[1]


def unverified(files: Iterable[Any]) -> str:
    """A sentence about files of an older version, which have no digest; empty without any."""
    number = len(list(files))
    those = f"{number} files have" if number > 1 else "one file has"
    told = (
        f"unverified: {those} no digest, since an older version of mpmbench wrote results without"
    )
    return told if number else ""


def _read(path: Path, take: Callable[[netCDF4.Dataset], Taken]) -> tuple[dict[str, Any], Taken]:
    """Attributes of a result file, and what `take` takes from it, once all of it has been checked."""
    content = _content(path)
    try:
        with _one_at_a_time, netCDF4.Dataset(path.name, memory=content) as file:
            file.set_auto_maskandscale(False)
            attributes = plain_attributes(file) | {digest.VARIABLE: digest.stored(content)}
            layout.check(attributes, file, len(content))
            return attributes, take(file)
    except layout.Unfit as error:
        raise Damaged(path, str(error)) from None
    except Exception as error:  # whatever the library makes of bytes that were never a result
        raise Damaged(path, f"cannot be read as netCDF: {apart.said(error)}") from None


def _content(path: Path) -> bytes:
    """The bytes of a file, which fit their digest or are at least known to be readable."""
    try:
        if path.exists() and not path.is_file():  # to read a pipe would take for ever
            raise Damaged(path, "is no file")
        content = path.read_bytes()
    except FileNotFoundError:
        if path.is_symlink():
            raise Damaged(path, "is a link to nothing") from None
        raise Missing(path, "there is no such file") from None
    except (OSError, MemoryError) as error:
        raise Damaged(path, f"cannot be read: {getattr(error, 'strerror', error)}") from None
    if not digest.stored(content):
        reason = apart.fault(content)
        if reason:
            raise Damaged(path, f"cannot be read as netCDF: {reason}")
    elif not digest.fits(content):
        raise Damaged(path, "was changed after it had been written: its digest does not fit")
    return content


def plain_attributes(file: netCDF4.Dataset) -> dict[str, Any]:
    """Attributes of an open file as text, numbers and lists of numbers; timings always as lists."""
    found = {name: file.getncattr(name) for name in file.ncattrs()}
    numbers = {name: value.tolist() for name, value in found.items() if hasattr(value, "tolist")}
    timings = {name: np.atleast_1d(found.get(name, [])).tolist() for name in UNITS}
    return found | numbers | timings
