"""A result file is there whole or not at all, and read only when it is as it was written."""

import os
import re
import signal
import subprocess
import sys
import time

import netCDF4
import pytest

from mpmbench.results import digest, netcdf, one_move
from tests.support import small, write

DATASET = small()


def test_a_write_that_fails_keeps_the_older_result_and_leaves_nothing(tmp_path, monkeypatch):
    path = tmp_path / "run.nc"
    write(DATASET, path)

    def full(target):
        target.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(digest, "seal", full)
    with pytest.raises(OSError, match="No space"):
        write(DATASET.assign(value=2.0), path)
    assert list(tmp_path.iterdir()) == [path]
    assert netcdf.read_scalars(path)[1]["value"] == (1.0, {"units": "m"})


def test_the_reason_is_the_systems_and_not_the_librarys(tmp_path):
    """On a full disk the netCDF library says that permission was denied, or that there was an error of HDF."""
    path = tmp_path / "run.nc"
    path.with_name(f".{path.name}.{os.getpid()}.tmp").symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space left on device"):
        write(DATASET, path)
    assert list(tmp_path.iterdir()) == []


def test_a_writer_that_is_killed_leaves_no_result_and_its_remains_are_removed(tmp_path):
    code = f"""
import time
from pathlib import Path
from mpmbench.results import digest, netcdf
def stuck(target):
    target.write_bytes(b"half"); print("writing", flush=True); time.sleep(60)
digest.seal = stuck
netcdf.write({{}}, {{}}, Path({str(tmp_path / "run.nc")!r}))
"""
    writer = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert writer.stdout.readline() == "writing\n"
    one_move.remove_leftovers(tmp_path / "run.nc")
    assert len(list(tmp_path.iterdir())) == 1  # the writer is alive
    os.kill(writer.pid, signal.SIGKILL)
    writer.wait()
    assert not (tmp_path / "run.nc").exists()
    write(DATASET, tmp_path / "run.nc")
    assert [path.name for path in tmp_path.iterdir()] == ["run.nc"]


@pytest.mark.parametrize("content", [b"", b"CDF\x01 truncated", b"text"])
def test_a_broken_file_is_no_result(tmp_path, content):
    path = tmp_path / "run.nc"
    path.write_bytes(content)
    attributes, reason = netcdf.look(path)
    assert attributes is None and reason.startswith("cannot be read as netCDF: ")
    with pytest.raises(netcdf.Damaged, match=r"run\.nc: cannot be read"):
        netcdf.read_scalars(path)


def test_a_foreign_file_is_no_result(tmp_path):
    path = tmp_path / "run.nc"
    with netCDF4.Dataset(path, "w") as file:
        file.title = "weather"
    assert netcdf.look(path) == (None, "not a result of mpmbench")
    assert netcdf.look(tmp_path / "nowhere.nc") == (None, "")


def test_a_full_disk_is_named_and_ends_with_exit_code_1(command, folder, monkeypatch):
    """The limit on file sizes stands for a full disk: the child cannot write more than a few hundred kilobytes."""
    code = (
        "import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "from mpmbench.runs.sweep.ledger import RESERVE;"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (RESERVE, RESERVE));"
        "from mpmbench.cli import main; sys.exit(main(['resolution=2000', 'time_step=auto', 'end_time=1e-4']))"
    )
    command("warmup", "method=mpm", "basis=linear")
    began = time.monotonic()
    outcome = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=folder
    )
    assert outcome.returncode == 1, outcome.stderr
    assert ": not written" in outcome.stdout
    assert re.search(
        r"result +the result could not be written to \S+: File too large\n", outcome.stdout
    )
    assert [path for path in folder.rglob("*") if path.is_file()] == []
    assert time.monotonic() - began < 60


def test_threads_may_read_side_by_side(tmp_path):
    """In a process of its own: without a lock the HDF5 library ends it by a segmentation fault."""
    for number in range(20):
        write(DATASET, tmp_path / f"{number}.nc")
    code = (
        "import pathlib; from concurrent.futures import ThreadPoolExecutor; from mpmbench.results import netcdf;"
        f"files = sorted(pathlib.Path({str(tmp_path)!r}).glob('*.nc')) * 10;"
        "print(sum(map(bool, ThreadPoolExecutor(4).map(netcdf.read_attributes, files))))"
    )
    outcome = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (outcome.returncode, outcome.stdout) == (0, "200\n"), outcome.stderr


def test_fields_at_snapshots_name_the_instants(tmp_path):
    """As the convention CF asks: the dimension is called otherwise than the variable with its values."""
    times, fields = ("snapshot", [0.0, 1.0], {"units": "s"}), ("snapshot", [2.0, 3.0], {})
    file = tmp_path / "run.nc"
    netcdf.write({"snapshot_time": times, "density": fields}, {}, file)
    with netCDF4.Dataset(file) as written:
        assert written["density"].coordinates == "snapshot_time"
        assert "coordinates" not in written["snapshot_time"].ncattrs()
