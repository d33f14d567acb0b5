"""The command ``export``: particles for ParaView (a VTP file per instant and a PVD file), or everything as CSV."""

import base64
import csv
import io
import os
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import xarray as xr

from mpmbench.results.campaign import flat_settings
from mpmbench.results.netcdf import read_attributes, read_scalars
from mpmbench.runs.sweep.display import shorten
from mpmbench.runs.sweep.execute import check_folder
from mpmbench.settings.schema import BadInput, did_you_mean

FORMATS = ("--vtk", "--csv")
FOLDER = "export"  # beside the results
IDENTITY = ("status", "reason", "problem", "method", "basis", "material")


def main(arguments: list[str]) -> int:
    """``export RESULT --vtk`` or ``--csv``: of one result file, or of all in a folder."""
    given = [argument for argument in arguments if not argument.startswith("-")]
    wanted = [argument for argument in arguments if argument.startswith("-")]
    for option in wanted:
        if option not in FORMATS:
            raise BadInput(
                f"export {option}: there are {' and '.join(FORMATS)}{did_you_mean(option, FORMATS)}"
            )
    if len(given) != 1 or not wanted:
        raise BadInput("export: a result file or a folder of them is needed, and --vtk or --csv")
    source = Path(given[0])
    files = sorted(source.glob("*.nc")) if source.is_dir() else [source]
    if not source.exists():
        raise BadInput(f"export {source}: there is no such file or folder")
    if not files:
        raise BadInput(f"export {source}: there are no result files in it")
    target = (source if source.is_dir() else source.parent).absolute() / FOLDER
    check_folder(target, "export:")
    unreadable = [file for file in files if read_attributes(file) is None]
    if not source.is_dir() and unreadable:
        raise BadInput(f"export {source}: not a readable result of mpmbench")
    for file in unreadable:
        print(f"left out: {file}: not a readable result")
    written: list[Path] = []
    for file in files:
        if file not in unreadable:
            with xr.open_dataset(file, decode_cf=False) as dataset:
                written += vtk(dataset, target, file.stem) if "--vtk" in wanted else []
                written += tables(dataset, target, file.stem) if "--csv" in wanted else []
    if source.is_dir() and "--csv" in wanted:
        written.append(overview([file for file in files if file not in unreadable], target))
    if not written:
        raise BadInput(
            f"export {source}: there are no particles in it, since no run came to its end",
            exit_code=1,
        )
    for file in written:
        print(shorten(str(file)))
    return 1 if unreadable else 0


def vtk(dataset: xr.Dataset, folder: Path, name: str) -> list[Path]:
    """Write a VTP file for each instant and the PVD file that lists them; returns the latter, the one to open.

    Vectors have three components and tensors nine, as VTK wants them; units stand in the names.
    """
    if "position" not in dataset:
        return []
    times = dataset["snapshot_time"].values
    entries = []
    for k, time in enumerate(times.tolist()):
        snapshot = dataset.isel(snapshot=k)
        place = Path(name) / f"{k:05d}.vtp"
        write_whole(folder / place, polydata(snapshot).encode())
        entries.append(
            f'<DataSet timestep="{time!r}" part="0" file={quoteattr(place.as_posix())}/>'
        )
    head = '<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">'
    lines = [
        '<?xml version="1.0"?>',
        head,
        "<Collection>",
        *entries,
        "</Collection>",
        "</VTKFile>",
        "",
    ]
    return [write_whole(folder / f"{name}.pvd", "\n".join(lines).encode())]


def polydata(snapshot: xr.Dataset) -> str:
    """One instant as VTK XML: a vertex for each particle, with all that is known of it."""
    points = padded(snapshot["position"].values)
    n = len(points)
    fields = [
        (f"{label} [{variable.attrs.get('units', '1')}]", padded(variable.values))
        for label, variable in sorted(snapshot.data_vars.items(), key=lambda item: str(item[0]))
        if variable.dims[:1] == ("particle",) and label != "position"
    ]
    parts = [
        '<?xml version="1.0"?>',
        '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        "<PolyData>",
        f'<Piece NumberOfPoints="{n}" NumberOfVerts="{n}" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="0">',
        "<PointData>",
        *(data_array(label, values) for label, values in fields),
        "</PointData>",
        "<Points>",
        data_array("position [m]", points),
        "</Points>",
        "<Verts>",
        data_array("connectivity", np.arange(n, dtype=np.int64)),
        data_array("offsets", np.arange(1, n + 1, dtype=np.int64)),
        "</Verts>",
        "</Piece>",
        "</PolyData>",
        "</VTKFile>",
    ]
    return "\n".join(parts) + "\n"


def data_array(name: str, values: np.ndarray) -> str:
    """An array as an XML element: its length in bytes and its bytes, in base64."""
    kind = "Int64" if np.issubdtype(values.dtype, np.integer) else "Float64"
    data = np.ascontiguousarray(values, "<i8" if kind == "Int64" else "<f8").tobytes()
    text = base64.b64encode(len(data).to_bytes(8, "little") + data).decode()
    components = int(np.prod(values.shape[1:]))
    return (
        f'<DataArray type="{kind}" Name={quoteattr(name)} NumberOfComponents="{components}" format="binary">'
        f"{text}</DataArray>"
    )


def padded(values: np.ndarray) -> np.ndarray:
    """Vectors with three components and tensors with three by three; the missing ones are zero."""
    missing = [(0, 0)] + [(0, 3 - n) for n in values.shape[1:]]
    return np.pad(values, missing)


def tables(dataset: xr.Dataset, folder: Path, name: str) -> list[Path]:
    """Write particles at all instants, and the time series, as two CSV files."""
    written = []
    if "position" in dataset:
        columns = {
            "time [s]": np.repeat(dataset["snapshot_time"].values, dataset.sizes["particle"]),
            "particle": np.tile(np.arange(dataset.sizes["particle"]), dataset.sizes["snapshot"]),
        }
        for label, variable in dataset.data_vars.items():
            if variable.dims[:2] == ("snapshot", "particle"):
                values = variable.values.reshape(len(columns["particle"]), -1)
                columns |= components(str(label), variable, values)
        written.append(write_table(folder / f"{name}-particles.csv", columns))
    if "time" in dataset.coords:
        columns = {"time [s]": dataset["time"].values}
        for label, variable in dataset.data_vars.items():
            if variable.dims[:1] == ("time",):
                columns |= components(
                    str(label), variable, variable.values.reshape(dataset.sizes["time"], -1)
                )
        written.append(write_table(folder / f"{name}-history.csv", columns))
    return written


def components(label: str, variable: xr.DataArray, values: np.ndarray) -> dict[str, np.ndarray]:
    """A column for each component, numbered as in the papers: ``stress_12 [Pa]``."""
    unit = variable.attrs.get("units", "1")
    shape = variable.shape[
        len(variable.shape) - sum(dim in ("dim", "dim2", "axis") for dim in variable.dims) :
    ]
    names = ["".join(str(i + 1) for i in index) for index in np.ndindex(*shape)]
    return {
        f"{label}{'_' + part if part else ''} [{unit}]": values[:, k]
        for k, part in enumerate(names)
    }


def overview(files: list[Path], folder: Path) -> Path:
    """Write all settings and scalars of several runs, a row for each."""
    rows = []
    for file in files:
        attributes, scalars = read_scalars(file)
        row: dict[str, Any] = {"file": file.name} | {key: attributes[key] for key in IDENTITY}
        row |= {key: value for key, value in flat_settings(attributes).items() if key not in row}
        rows.append(
            row
            | {
                f"{key} [{label.get('units', '1')}]": value
                for key, (value, label) in scalars.items()
            }
        )
    names = list(dict.fromkeys(key for row in rows for key in row))
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([[row.get(name, "") for name in names] for row in rows])
    return write_whole(folder / "runs.csv", out.getvalue().encode())


def write_table(path: Path, columns: dict[str, np.ndarray]) -> Path:
    """Write columns of equal length with all their digits."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
    return write_whole(path, out.getvalue().encode())


def write_whole(path: Path, content: bytes) -> Path:
    """Write a file in one move."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        unfinished.write_bytes(content)
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
    return path
