"""Environment of the processes that compute: the cache of kernels, threads of libraries."""

import os
import shutil
import tempfile
import time
from collections.abc import MutableMapping
from contextlib import suppress
from pathlib import Path

from mpmbench.results.identity import sources_hash
from mpmbench.settings.files import PACKAGE, joined

KEEP_DAYS = 30


def cache_folder() -> Path:
    """Folder of the kernels compiled from exactly these sources.

    numba does not notice a change in another file that a kernel calls, so every version of the
    sources has a folder of its own; those that nobody used for a month are removed. Plug-ins are
    sources too.
    """
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "mpmbench"
    folder = home / sources_hash()
    try:
        home.mkdir(parents=True, exist_ok=True)
        start_from(home / sources_hash(with_plugins=False), folder)
        folder.mkdir(exist_ok=True)
        os.utime(folder)
    except OSError:
        folder = Path(tempfile.gettempdir()) / f"mpmbench-{os.getuid()}" / folder.name
        folder.mkdir(parents=True, exist_ok=True)
        return folder
    for other in home.iterdir():
        if time.time() - other.stat().st_mtime > KEEP_DAYS * 86400:
            shutil.rmtree(other, ignore_errors=True)
    return folder


def start_from(plain: Path, folder: Path) -> None:
    """Begin a cache for plug-ins with links to what is compiled without them.

    That fits, since a plug-in adds types and functions and replaces none; numba itself never writes
    into a file.
    """
    if folder.exists() or not plain.exists():
        return
    unfinished = folder.with_name(f".{folder.name}.{os.getpid()}")
    try:
        shutil.copytree(plain, unfinished, copy_function=link)
        unfinished.rename(folder)
    except OSError:  # no links here, or another process was faster
        shutil.rmtree(unfinished, ignore_errors=True)


def link(source: str, target: str) -> None:
    """Link one file, unless it was temporary and is gone."""
    with suppress(FileNotFoundError):
        os.link(source, target)


def prepare(environment: MutableMapping[str, str]) -> None:
    """Set what must be known before numba and the linear algebra libraries are imported."""
    environment["NUMBA_CACHE_DIR"] = str(cache_folder())
    environment["NUMBA_THREADING_LAYER"] = "workqueue"  # survives a fork
    environment["NUMBA_NUM_THREADS"] = str(os.cpu_count() or 1)  # a launcher may have set it to 1
    environment["OMP_WAIT_POLICY"] = "passive"
    for library in ("OPENBLAS", "OMP", "MKL", "VECLIB_MAXIMUM"):
        environment[f"{library}_NUM_THREADS"] = "1"  # the same bits for every number of threads
    make_known(environment)


def make_known(environment: MutableMapping[str, str]) -> None:
    """Let other processes find the package where it was found here."""
    environment["PYTHONPATH"] = joined(str(PACKAGE.parent), environment.get("PYTHONPATH", ""))
