"""The first run of all compiles on two processors."""

import os
from pathlib import Path

import pytest

from mpmbench.case.compiling import beside, is_first_of_all


def test_a_task_is_done_beside_and_may_fail(tmp_path: Path) -> None:
    file, here = tmp_path / "done", []

    def task() -> None:
        here.append("there")
        file.write_text("yes")
        raise OSError("nobody hears this")

    with beside(task):
        here.append("here")
    assert file.read_text() == "yes" and here == ["here"]


def test_who_waits_is_told_what_went_wrong_here(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="here"), beside((tmp_path / "done").touch):
        raise ValueError("here")
    assert (tmp_path / "done").exists()


def test_a_cache_without_kernels_is_that_of_a_first_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    assert not is_first_of_all()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert is_first_of_all()
    (tmp_path / "transfer_1").mkdir()
    (tmp_path / "transfer_1" / "carry.g2p-46.py311.nbi").touch()
    assert not is_first_of_all()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "other"))
    assert is_first_of_all()
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    assert not is_first_of_all()
