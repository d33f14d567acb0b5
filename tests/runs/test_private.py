"""Folders whose content is run, or decides whose turn it is, are of this user alone."""

import os
import stat
import tempfile
from pathlib import Path

import pytest

from mpmbench.results.private import private_folder, temporary_folder
from mpmbench.runs.process import environment, exclusive
from mpmbench.runs.sweep import ledger
from mpmbench.settings.schema import BadInput


def mode(folder: Path) -> int:
    return stat.S_IMODE(folder.stat().st_mode)


def test_it_is_made_so_that_nobody_else_can_enter(tmp_path):
    before = os.umask(0)
    try:
        folder = private_folder(tmp_path / "a" / "b")
    finally:
        os.umask(before)
    assert mode(folder) == 0o700
    folder.chmod(0o755)  # as earlier versions made it
    (folder / "kernel").write_text("kept")
    assert private_folder(folder) == folder and mode(folder) == 0o700
    assert (folder / "kernel").read_text() == "kept"


def a_link(place: Path) -> None:
    (place.parent / "other").mkdir(mode=0o700)
    place.symlink_to(place.parent / "other")


def a_dangling_link(place: Path) -> None:
    place.symlink_to(place.parent / "nowhere")


def a_file(place: Path) -> None:
    place.write_text("")


def open_to_all(place: Path) -> None:
    place.mkdir()
    place.chmod(0o777)


def open_to_the_group(place: Path) -> None:
    place.mkdir()
    place.chmod(0o770)


def of_somebody_else(place: Path) -> None:
    if os.getuid() != 0:
        pytest.skip("only root can give a folder away")
    place.mkdir(mode=0o755)
    os.chown(place, 65534, 65534)


BAD = {
    a_link: "is no folder",
    a_dangling_link: "is no folder",
    a_file: "is no folder",
    open_to_all: "can be written by others",
    open_to_the_group: "can be written by others",
    of_somebody_else: "belongs to another user",
}
bad_place = pytest.mark.parametrize("make", BAD, ids=[make.__name__ for make in BAD])


@bad_place
def test_a_folder_that_others_may_have_filled_is_refused(tmp_path, make):
    make(tmp_path / "place")
    with pytest.raises(PermissionError, match=BAD[make]):
        private_folder(tmp_path / "place")
    assert not (tmp_path / "nowhere").exists()


@bad_place
def test_kernels_come_from_no_folder_of_others(tmp_path, monkeypatch, make):
    cache, temporary = tmp_path / "cache", tmp_path / "temporary"
    for folder in (cache, temporary):
        folder.mkdir()
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    make(cache / "mpmbench")
    own = temporary / f"mpmbench-{os.getuid()}"
    assert environment.cache_folder().parent == own and mode(own) == 0o700
    own.rename(temporary / "away")
    make(own)
    with pytest.raises(BadInput, match="XDG_CACHE_HOME") as refused:
        environment.cache_folder()
    assert str(refused.value).count(BAD[make]) == 2 and refused.value.exit_code == 2


@bad_place
def test_locks_lie_in_no_folder_of_others(tmp_path, monkeypatch, make):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    make(tmp_path / f"mpmbench-{os.getuid()}")
    with pytest.raises(BadInput, match=f"{BAD[make]}.*XDG_RUNTIME_DIR"), exclusive.turn(alone=True):
        pass


def test_locks_lie_in_a_private_folder(tmp_path, monkeypatch):
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with exclusive.turn(alone=False):
        assert mode(tmp_path / f"mpmbench-{os.getuid()}") == 0o700


def test_a_sweep_leaves_folders_of_others_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    for name, owner in (("a", "[]"), ("b", "{}"), ("c", "nothing")):
        (tmp_path / f"{ledger.PREFIX}{name}").mkdir()
        (tmp_path / f"{ledger.PREFIX}{name}/owner").write_text(owner)
    (tmp_path / f"{ledger.PREFIX}link").symlink_to(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(os, "getuid", lambda: os.geteuid() + 1)  # these are of somebody else
        with ledger.opened():
            pass
    assert len(list(tmp_path.iterdir())) == 4
    with ledger.opened() as one:  # ours, and of no command that runs
        assert mode(one.folder) == 0o700
        assert [path.name for path in tmp_path.iterdir() if path != one.folder] == [
            f"{ledger.PREFIX}link"
        ]


def test_a_folder_is_removed_even_if_its_maker_is_interrupted_at_once(tmp_path, monkeypatch):
    mkdir = Path.mkdir

    def make(folder, mode):
        mkdir(folder, mode)
        raise KeyboardInterrupt

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(Path, "mkdir", make)
    with pytest.raises(KeyboardInterrupt), temporary_folder("some-"):
        pass
    assert not list(tmp_path.iterdir())
