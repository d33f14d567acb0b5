"""The command ``export``: particles for ParaView (a VTP file per instant and a PVD file), or everything as CSV."""

import base64
import csv
import io
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import xarray as xr

from mpmbench.commands.places import attributes_of, results_in
from mpmbench.results.campaign import flat_settings
from mpmbench.results.cells import csv_cell
from mpmbench.results.netcdf import load, look, read_scalars, unverified
from mpmbench.results.one_move import in_one_move
from mpmbench.runs.sweep.display import shorten
from mpmbench.runs.sweep.execute import check_folder
from mpmbench.say import BELOW, in_lines, one_line, say
from mpmbench.settings.schema import BadInput, did_you_mean

FORMATS = ("--vtk", "--csv")
FOLDER = "export"  # beside the results
IDENTITY = ("status", "reason", "problem", "method", "basis", "material")
SERIES = """\
<?xml version="1.0"?>
<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">
<Collection>
{entries}
</Collection>
</VTKFile>
"""
INSTANT = """\
<?xml version="1.0"?>
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<PolyData>
<Piece NumberOfPoints="{n}" NumberOfVerts="{n}" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="0">
<PointData>
{fields}
</PointData>
<Points>
{points}
</Points>
<Verts>
{connectivity}
{offsets}
</Verts>
</Piece>
</PolyData>
</VTKFile>
"""


def main(arguments: list[str]) -> int:
    """``export RESULT --vtk`` or ``--csv``: of one result file, or of all in a folder."""
    given = [argument for argument in arguments if not argument.startswith("-")]
    wanted = [argument for argument in arguments if argument.startswith("-")]
    for option in wanted:
        if option not in FORMATS:
            hint = did_you_mean(option, FORMATS)
            raise BadInput(f"export {option}: there are {' and '.join(FORMATS)}{hint}")
    if len(given) != 1 or not wanted:
        raise BadInput("export: a result file or a folder of them is needed, and --vtk or --csv")
    source = Path(given[0])
    if not source.exists():
        raise BadInput(f"export {source}: there is no such file or folder")
    if source.is_dir():
        files = {file: look(file) for file in results_in("export", source)}
    else:
        files = {source: (attributes_of("export", source), "")}
    readable = {file: attributes for file, (attributes, _) in files.items() if attributes}
    target = (source if source.is_dir() else source.parent).absolute() / FOLDER
    check_folder(target, "export:")
    for file, (attributes, damage) in files.items():
        if attributes is None:
            say(*in_lines(f"left out: {file}: {damage}", BELOW))
    told = unverified(file for file, attributes in readable.items() if not attributes["digest"])
    if told:
        say(*in_lines(told, BELOW))
    written: list[Path] = []
    for file in readable:
        dataset = load(file)
        written += vtk(dataset, target, file.stem) if "--vtk" in wanted else []
        written += tables(dataset, target, file.stem) if "--csv" in wanted else []
    if source.is_dir() and "--csv" in wanted:
        written.append(overview(list(readable), target))
    if not written:
        nothing = "there are no particles in it, since no run came to its end"
        raise BadInput(f"export {source}: {nothing}", exit_code=1)
    for file in written:
        say(shorten(str(file)))
    return 0 if len(readable) == len(files) else 1


def vtk(dataset: xr.Dataset, folder: Path, name: str) -> list[Path]:
    """Write a VTP file for each instant and the PVD file that lists them; returns the latter, the one to open.

    Vectors have three components and tensors nine, as VTK wants them; units stand in the names.
    """
    if "position" not in dataset:
        return []
    entries = []
    for k, time in enumerate(dataset["snapshot_time"].values.tolist()):
        place = Path(name) / f"{k:05d}.vtp"
        write_whole(folder / place, polydata(dataset.isel(snapshot=k)))
        file = quoteattr(place.as_posix())
        entries.append(f'<DataSet timestep="{time!r}" part="0" file={file}/>')
    return [write_whole(folder / f"{name}.pvd", SERIES.format(entries="\n".join(entries)))]


def polydata(snapshot: xr.Dataset) -> str:
    """One instant as VTK XML: a vertex for each particle, with all that is known of it."""
    points = padded(snapshot["position"].values)
    n = len(points)
    fields = [
        data_array(f"{label} [{variable.attrs.get('units', '1')}]", padded(variable.values))
        for label, variable in sorted(snapshot.data_vars.items(), key=lambda item: str(item[0]))
        if variable.dims[:1] == ("particle",) and label != "position"
    ]
    return INSTANT.format(
        n=n,
        fields="\n".join(fields),
        points=data_array("position [m]", points),
        connectivity=data_array("connectivity", np.arange(n, dtype=np.int64)),
        offsets=data_array("offsets", np.arange(1, n + 1, dtype=np.int64)),
    )


def data_array(name: str, values: np.ndarray) -> str:
    """An array as an XML element: its length in bytes and its bytes, in base64."""
    kind = "Int64" if np.issubdtype(values.dtype, np.integer) else "Float64"
    data = np.ascontiguousarray(values, "<i8" if kind == "Int64" else "<f8").tobytes()
    text = base64.b64encode(len(data).to_bytes(8, "little") + data).decode()
    components = int(np.prod(values.shape[1:]))
    return (
        f'<DataArray type="{kind}" Name={quoteattr(one_line(name))} NumberOfComponents="{components}" format="binary">'
        f"{text}</DataArray>"
    )


def padded(values: np.ndarray) -> np.ndarray:
    """Vectors with three components and tensors with three by three; the missing ones are zero."""
    missing = [(0, 0)] + [(0, 3 - n) for n in values.shape[1:]]
    return np.pad(values, missing)


def tables(dataset: xr.Dataset, folder: Path, name: str) -> list[Path]:
    """Write particles at all instants, and the time series, as two CSV files."""
    parts: dict[str, tuple[tuple[str, ...], dict[str, np.ndarray]]] = {}
    if "position" in dataset:
        instants, particles = dataset.sizes["snapshot"], dataset.sizes["particle"]
        first = {
            "time [s]": np.repeat(dataset["snapshot_time"].values, particles),
            "particle": np.tile(np.arange(particles), instants),
        }
        parts["particles"] = ("snapshot", "particle"), first
    if "time" in dataset.coords:
        parts["history"] = ("time",), {"time [s]": dataset["time"].values}
    for dims, columns in parts.values():
        for label, variable in dataset.data_vars.items():
            if variable.dims[: len(dims)] == dims:
                columns |= components(str(label), variable, len(dims))
    return [
        write_table(
            folder / f"{name}-{part}.csv",
            columns,
            zip(*(column.tolist() for column in columns.values()), strict=True),
        )
        for part, (_, columns) in parts.items()
    ]


def components(label: str, variable: xr.DataArray, rows: int) -> dict[str, np.ndarray]:
    """A column for each component, as ``stress_12 [Pa]``; the first axes number the rows."""
    unit, shape = variable.attrs.get("units", "1"), variable.shape[rows:]
    values = variable.values.reshape(-1, int(np.prod(shape)))
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
        for key, (value, label) in scalars.items():
            row[f"{key} [{label.get('units', '1')}]"] = value
        rows.append(row)
    names = list(dict.fromkeys(key for row in rows for key in row))
    table = ([row.get(name, "") for name in names] for row in rows)
    return write_table(folder / "runs.csv", names, table)


def write_table(path: Path, names: Iterable[str], rows: Iterable[Iterable[Any]]) -> Path:
    """Write a CSV file; numbers keep all their digits, and no text is a formula."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(map(csv_cell, names))
    writer.writerows(map(csv_cell, row) for row in rows)
    return write_whole(path, out.getvalue())


def write_whole(path: Path, content: str) -> Path:
    """Write a text file in one move."""
    with in_one_move(path) as unfinished:
        unfinished.write_text(content, encoding="utf-8")
    return path
