"""Result files are input: what was changed since it was written is named and left out, all else is used."""

import hashlib
import json
import re
import shutil
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr

import mpmbench
from mpmbench.commands.compare import NOT_COMPARABLE
from mpmbench.results import apart, digest, netcdf
from mpmbench.settings.files import PACKAGE
from tests.support import CONFIG, edited, small, unbroken, write


@pytest.fixture
def file(tmp_path) -> Path:
    """A small result."""
    write(small(), tmp_path / "run.nc")
    return tmp_path / "run.nc"


def changed(file: Path, at: int, value: int) -> None:
    """Change one byte of a file."""
    content = bytearray(file.read_bytes())
    content[at] ^= value
    file.write_bytes(content)


def test_the_digest_is_that_of_all_other_bytes_and_anybody_can_read_it(file):
    with netCDF4.Dataset(file) as data:
        said = netCDF4.chartostring(data["digest"][:]).item()
    text, _, found = said.rpartition(": ")
    assert text == "SHA-256 of all other bytes of this file"
    others = file.read_bytes().replace(found.encode(), b"")
    assert found == hashlib.sha256(others).hexdigest() == netcdf.read_attributes(file)["digest"]


def test_any_changed_byte_is_found(file):
    whole = file.read_bytes()
    number = whole.find(np.float64(1.0).tobytes())
    places = np.random.default_rng(0).integers(len(whole), size=60).tolist()
    for at in (number, number + 6, whole.find(digest.MARK), *places):
        changed(file, at, 1 << at % 8)
        for read in (netcdf.read_attributes, netcdf.read_scalars, netcdf.load):
            with pytest.raises(netcdf.Damaged, match=r"run\.nc: "):
                read(file)
        file.write_bytes(whole)
    assert netcdf.read_scalars(file)[1]["value"][0] == 1.0
    assert list(netcdf.load(file).variables) == ["value"]


def test_a_file_of_an_older_version_is_read_and_said_to_be_unverified(tmp_path, command):
    small(schema_version=1).to_netcdf(tmp_path / "old.nc")
    assert netcdf.read_attributes(tmp_path / "old.nc")["digest"] == ""
    said = "no digest, since an older version of mpmbench wrote results without"
    assert "unverified: an older version wrote no digest" in unbroken(command("status", ".").out)
    assert f"unverified: one file has {said}" in unbroken(command("merge", "all", ".").out)
    assert f"unverified: one file has {said}" in unbroken(command("compare", ".", "all").out)
    assert f"unverified: one file has {said}" in unbroken(command("export", ".", "--csv").out)
    with pytest.warns(UserWarning, match=said):
        assert float(mpmbench.open_campaign(tmp_path).value) == 1.0
    small().to_netcdf(tmp_path / "new.nc")
    assert netcdf.look(tmp_path / "new.nc") == (None, "its digest is missing")


def test_a_file_that_the_library_does_not_come_to_an_end_with_is_named(tmp_path, monkeypatch):
    """The size of an object in the heap of HDF5, which has no checksum, is made wrong."""
    dataset = small(schema_version=1).assign(series=("time", np.zeros(4)))
    dataset.assign_coords(time=np.arange(4.0)).to_netcdf(tmp_path / "old.nc")
    heap = (tmp_path / "old.nc").read_bytes().find(b"GCOL")
    monkeypatch.setattr(apart, "TIME", 0.5)
    monkeypatch.setattr(apart, "_processes", {})
    reasons = set()
    for value in (8 ^ 63, 8 ^ 48):
        changed(tmp_path / "old.nc", heap + 24, value)
        reasons.add(netcdf.look(tmp_path / "old.nc")[1])
        changed(tmp_path / "old.nc", heap + 24, value)
    assert "" not in reasons
    assert any("has not come to its end in 0.5 s" in reason for reason in reasons), reasons
    assert netcdf.look(tmp_path / "old.nc")[1] == ""


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    (
        ("schema_version", 99, "schema_version = 99: one of 1, 2, 3, 4 is needed"),
        ("status", "splendid", "status = 'splendid': one of ok, diverged, "),
        ("status", [1, 2], r"status = \[1, 2\]: one of"),
        ("reason", 5.0, "reason = 5.0: text is needed"),
        ("resolution", -8, "resolution = -8: a whole number from 1 on is needed"),
        ("time_step", np.inf, "time_step = inf: a number greater than 0"),
        ("host", [1.0, 2.0], r"host = \[1.0, 2.0\]: text is needed"),
        ("solver_times", "long", r"solver_times = \['long'\]: numbers is needed"),
        ("note", [1, 2], r"note = \[1, 2\]: text or a number is needed"),
        ("config", "[" * 9999, "config is no JSON"),
        ("config", "[]", "config is no mapping"),
        ("config", CONFIG | {"method": "mpm"}, "config: method is no mapping"),
        ("config", CONFIG | {"basis": {"name": 1}}, "config: basis.name = 1: text is needed"),
        ("config", CONFIG | {"limits": {"time": "x"}}, "config: limits = .*a mapping of numbers"),
        ("config", CONFIG | {"basis": {"name": "a", "b": [[1]]}}, "config: basis.b = "),
        ("config", CONFIG | {"end_time": 10**400}, "config: end_time = 1000000000"),
        ("code_files", '{"a": 1}', "code_files: a = 1: text is needed"),
    ),
)
def test_what_is_no_result_is_said_and_why(file, name, value, reason):
    with edited(file) as data:
        data.setncattr(name, json.dumps(value) if isinstance(value, dict) else value)
    attributes, said = netcdf.look(file)
    assert attributes is None and re.match(reason, said), said


def test_arrays_have_their_dimensions_and_fit_into_the_file(tmp_path):
    path = tmp_path / "run.nc"
    write(small().assign(position=(("particle", "dim"), np.zeros((3, 1)))), path)
    reason = "variable position: the dimensions snapshot, particle, dim are needed"
    assert netcdf.look(path)[1] == reason
    write(small().assign(time=("time", ["a", "b"])), path)
    assert netcdf.look(path)[1] == "variable time: numbers are needed"
    with edited(path) as data:
        data.renameVariable("time", "words")
        data.createDimension("many", 10**13)
        data.createVariable("much", "f8", ("many",), chunksizes=(1024,))
    assert "and it has" in netcdf.look(path)[1]
    path.unlink()
    path.symlink_to(tmp_path / "nowhere")
    assert netcdf.look(path)[1] == "is a link to nothing"
    (tmp_path / "nowhere").mkdir()
    assert netcdf.look(path)[1] == "is no file"


def test_one_damaged_file_blocks_no_command_and_is_named(folder, command):
    good, bad = (
        small().assign(file=((), 1.0)),
        small(config_hash="b" * 16, config=json.dumps(CONFIG | {"cfl": 0.5})),
    )
    write(good, folder / "a/good.nc")
    write(bad, folder / "a/bad.nc")
    shutil.copytree(folder / "a", folder / "whole")
    changed(folder / "a/bad.nc", 3000, 1)
    why = "was changed after it had been written: its digest does not fit"
    out = command("status", "a").out
    assert max(map(len, out.splitlines())) <= 80
    out = unbroken(out)
    assert re.search(rf"damaged +bad +{why}", out) and re.search(r"good +ok", out)
    assert re.search(rf"damaged +bad +{why}", unbroken(command("status", "a/bad.nc").out))
    outcome = command("merge", "merged", "a")
    assert (outcome.code, f"left out: a/bad.nc: {why}" in unbroken(outcome.out)) == (1, True)
    assert [path.name for path in (folder / "merged").iterdir()] == ["good.nc"]
    outcome = command("export", "a", "--csv")
    assert (outcome.code, f"left out: a/bad.nc: {why}" in unbroken(outcome.out)) == (1, True)
    assert "good.nc" in (folder / "a/export/runs.csv").read_text()
    outcome = command("compare", "whole", "a")
    assert outcome.code != NOT_COMPARABLE and f"left out: a/bad.nc: {why}" in unbroken(outcome.out)
    assert "1 runs in both, 1 only in A" in outcome.out
    with pytest.warns(UserWarning, match=rf"left out: a/bad\.nc: {why}"):
        assert mpmbench.open_campaign("a").value == 1.0
    outcome = command("report", "a")
    assert outcome.code == 0
    page = (folder / "a/report/index.html").read_text()
    assert f"<code>bad.nc</code>: {why}" in page
    for words in (("rerun", "a/bad.nc"), ("export", "a/bad.nc", "--csv")):
        outcome = command(*words)
        assert outcome.code == 2 and outcome.err == f"mpmbench: {words[0]} a/bad.nc: {why}\n"
    outcome = command("merge", "a", "whole")
    assert f"replaced: bad.nc: {why}" in unbroken(outcome.out) and outcome.code == 0
    assert "damaged" not in command("status", "a").out


def test_a_sweep_names_a_damaged_file_and_computes_it_again(folder, command):
    sweep = ("-m", "resolution=4", "end_time=1e-4")
    assert command(*sweep).code == 0
    (file,) = folder.rglob("*.nc")
    expected = netcdf.load(file)
    changed(file, file.read_bytes().find(expected.velocity.values.tobytes()) + 50, 1)
    why = "was changed after it had been written: its digest does not fit"
    for words in (sweep, ()):
        out = command("status", *words).out
        assert re.search(rf"damaged +{file.stem} +{why}", unbroken(out))
        assert max(map(len, out.splitlines())) <= 80
    assert "1 runs: 1 damaged" in command("status", *sweep).out
    outcome = command(*sweep)
    assert outcome.code == 0 and "1 to run" in outcome.out
    assert f"damaged, to be computed again: {file.stem}: {why}" in unbroken(outcome.out)
    xr.testing.assert_equal(netcdf.load(file).velocity, expected.velocity)
    assert "1 runs: 1 fresh" in command("status", *sweep).out


def test_nothing_else_opens_netcdf():
    openers = re.compile(r"open_(mf)?dataset|load_dataset|netCDF4\.Dataset\(|h5py|open_zarr")
    found = {
        str(file.relative_to(PACKAGE))
        for file in PACKAGE.rglob("*.py")
        if openers.search(file.read_text(encoding="utf-8"))
    }
    assert found == {"results/netcdf.py", "results/apart.py"}
