"""Results for ParaView and as tables, read back."""

import base64
import csv
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr

from mpmbench.report.fields import names_of
from tests.runs.conftest import start


@pytest.fixture(scope="module")
def campaign(tmp_path_factory) -> Path:
    """A plate with three instants, a bar, and a run that does not apply."""
    folder = tmp_path_factory.mktemp("exported")
    place = f"output_dir={folder}"
    plate = start(
        "problem=plate_axis_aligned",
        "resolution=4",
        "end_time=1e-3",
        "snapshot_times=[5e-4]",
        place,
    )
    bar = start("-m", "resolution=4", "basis=linear,bspline", "basis.degree=2", place)
    assert (plate.wait(), bar.wait()) == (0, 0)
    return folder / "default"


@pytest.fixture
def plate(campaign) -> Path:
    return next(campaign.glob("*-plate_axis_aligned-*.nc"))


def read_array(element) -> np.ndarray:
    """A data array of a VTK XML file, by its specification."""
    raw = base64.b64decode(element.text)
    assert int.from_bytes(raw[:8], "little") == len(raw) - 8
    kind = {"Float64": "<f8", "Int64": "<i8"}[element.get("type")]
    return np.frombuffer(raw[8:], kind).reshape(-1, int(element.get("NumberOfComponents")))


def instants(folder: Path) -> list[tuple[float, Path]]:
    """Times and files of the one PVD file in a folder."""
    (index,) = folder.glob("*.pvd")
    entries = ElementTree.parse(index).getroot().find("Collection")
    return [(float(entry.get("timestep")), folder / entry.get("file")) for entry in entries]


def test_particles_for_paraview_hold_what_the_result_holds(plate, command):
    assert command("export", str(plate), "--vtk").code == 0
    series = instants(plate.parent / "export")
    dataset = xr.load_dataset(plate, decode_cf=False)
    assert (
        [time for time, _ in series] == dataset.snapshot_time.values.tolist() == [0.0, 5e-4, 1e-3]
    )
    for k, (_, file) in enumerate(series):
        piece = ElementTree.parse(file).getroot().find("PolyData/Piece")
        n = int(piece.get("NumberOfPoints"))
        assert n == int(piece.get("NumberOfVerts")) == dataset.sizes["particle"]
        snapshot = dataset.isel(snapshot=k)
        points = read_array(piece.find("Points/DataArray"))
        assert np.array_equal(points[:, :2], snapshot.position) and not points[:, 2].any()
        arrays = {element.get("Name"): read_array(element) for element in piece.find("PointData")}
        stress = arrays["stress [Pa]"].reshape(n, 3, 3)
        assert np.array_equal(stress[:, :2, :2], snapshot.stress) and not stress[:, 2].any()
        assert np.array_equal(arrays["velocity_exact [m s-1]"][:, :2], snapshot.velocity_exact)
        assert np.array_equal(arrays["volume [m2]"][:, 0], snapshot.volume)
        offsets, connectivity = (read_array(element) for element in reversed(piece.find("Verts")))
        assert np.array_equal(connectivity[:, 0], np.arange(n)) and np.array_equal(
            offsets[:, 0], np.arange(1, n + 1)
        )


def test_the_vtk_package_reads_it(plate, command):
    vtk = pytest.importorskip("vtk")
    numpy_support = pytest.importorskip("vtk.util.numpy_support")
    assert command("export", str(plate), "--vtk").code == 0
    dataset = xr.load_dataset(plate, decode_cf=False)
    for k, (_, file) in enumerate(instants(plate.parent / "export")):
        reader = vtk.vtkXMLPolyDataReader()
        reader.SetFileName(str(file))
        reader.Update()
        data = reader.GetOutput()
        assert data.GetNumberOfPoints() == data.GetNumberOfVerts() == dataset.sizes["particle"]
        points = numpy_support.vtk_to_numpy(data.GetPoints().GetData())
        assert np.array_equal(points[:, :2], dataset.position[k])
        velocity = numpy_support.vtk_to_numpy(data.GetPointData().GetArray("velocity [m s-1]"))
        assert np.array_equal(velocity[:, :2], dataset.velocity[k])
        assert data.GetPointData().GetArray("stress [Pa]").GetNumberOfComponents() == 9


def test_tables_hold_all_digits(plate, command):
    assert command("export", str(plate), "--csv").code == 0
    dataset = xr.load_dataset(plate, decode_cf=False)
    rows = list(csv.DictReader((plate.parent / "export" / f"{plate.stem}-particles.csv").open()))
    assert len(rows) == 3 * dataset.sizes["particle"]
    last = rows[-1]
    assert (float(last["time [s]"]), int(last["particle"])) == (1e-3, dataset.sizes["particle"] - 1)
    assert float(last["stress_12 [Pa]"]) == dataset.stress.values[-1, -1, 0, 1]
    assert float(last["position_2 [m]"]) == dataset.position.values[-1, -1, 1]
    history = list(csv.DictReader((plate.parent / "export" / f"{plate.stem}-history.csv").open()))
    assert [
        float(row["kinetic_energy [J]"]) for row in history
    ] == dataset.kinetic_energy.values.tolist()
    assert float(history[-1]["momentum_2 [kg m s-1]"]) == dataset.momentum.values[-1, 1]


def test_a_campaign_is_one_row_per_run(campaign, command):
    outcome = command("export", str(campaign), "--csv")
    assert outcome.code == 0
    rows = {row["file"]: row for row in csv.DictReader((campaign / "export/runs.csv").open())}
    assert len(rows) == len(list(campaign.glob("*.nc"))) == 3
    for name, row in rows.items():
        with netCDF4.Dataset(campaign / name) as file:
            assert row["status"] == file.status
            if file.status == "ok":
                assert float(row["error_stress_rms [Pa]"]) == float(file["error_stress_rms"][...])
                assert row["resolution"] == "4"
    assert {row["status"] for row in rows.values()} == {"ok", "not_applicable"}


def test_what_cannot_be_exported_is_said(campaign, command, folder):
    for arguments, sentence in (
        ((), "a result file or a folder of them is needed"),
        ((str(campaign),), "--vtk or --csv"),
        ((str(campaign), "--vtu"), "did you mean --vtk"),
        (("nowhere.nc", "--vtk"), "no such file or folder"),
        ((str(folder), "--vtk"), "no result files"),
    ):
        outcome = command("export", *arguments)
        assert outcome.code == 2 and sentence in outcome.err and outcome.err.count("\n") == 1
    (folder / "broken.nc").write_bytes(b"CDF\x01")
    assert (
        "export broken.nc: cannot be read as netCDF" in command("export", "broken.nc", "--csv").err
    )
    empty = next(
        file for file in campaign.glob("*.nc") if netCDF4.Dataset(file).status == "not_applicable"
    )
    outcome = command("export", str(empty), "--vtk")
    assert outcome.code == 1 and "there are no particles in it" in outcome.err


@pytest.mark.slow  # a metal on a line is compiled for it; what a result holds is asked above
def test_derived_fields_have_their_names_everywhere(tmp_path, command):
    """Of a metal in 1D, whose axes out of the line count: in the result, for ParaView and as a table."""
    metal = ("material=thermo_viscoplastic", "material.yield_stress=1", "method=mpm")
    place = f"output_dir={tmp_path}"
    run = start(
        "problem=bar_fixed_ends", "basis=linear", "resolution=4", "end_time=0.1", *metal, place
    )
    assert run.wait() == 0
    (file,) = tmp_path.glob("default/*.nc")
    dataset = xr.load_dataset(file, decode_cf=False)
    names = {"pressure": "Pa", "von_mises": "Pa", "plastic_strain": "1", "temperature": "K"}
    assert {name: dataset[name].units for name in names} == names
    last = dataset.isel(snapshot=-1)
    assert last.plastic_strain.max() > 0.0 and (last.temperature >= 300.0).all()
    radial = 1.5 * np.abs(last.stress.values[:, 0, 0] + last.pressure.values)
    assert last.von_mises.values == pytest.approx(radial)  # (sigma_11 - sigma_22) with equal others
    assert dataset.dissipated_energy[0] == 0.0 < dataset.dissipated_energy[-1]
    assert float(dataset.energy_drift) < 0.05
    stretch = last.deformation_gradient.values[:, 0, 0]  # in 1D all there is of F
    assert stretch == pytest.approx(last.volume.values / dataset.volume.values[0], rel=1e-12)
    assert np.ptp(stretch) > 0.0 and names_of(dataset).count("deformation_gradient") == 1
    assert command("export", str(file), "--vtk", "--csv").code == 0
    piece = ElementTree.parse(instants(file.parent / "export")[-1][1]).getroot()
    arrays = {one.get("Name"): read_array(one) for one in piece.iter("DataArray")}
    (table,) = (file.parent / "export").glob("*-particles.csv")
    with open(table, encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))[-dataset.sizes["particle"] :]
    assert arrays["deformation_gradient [1]"][:, 0].tolist() == stretch.tolist()
    for name, unit in names.items():
        assert arrays[f"{name} [{unit}]"][:, 0].tolist() == last[name].values.tolist()
        assert [float(row[f"{name} [{unit}]"]) for row in rows] == last[name].values.tolist()
