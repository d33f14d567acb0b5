"""Environment of the processes that compute: the cache of kernels, threads of libraries."""

import os
import shutil
import time
from collections.abc import Iterator, MutableMapping
from contextlib import contextmanager, suppress
from pathlib import Path

from mpmbench.results.identity import sources_hashes
from mpmbench.results.private import cache_home
from mpmbench.settings.files import PACKAGE, BadInput, joined

KEEP_DAYS = 30
NUMBA_SETTINGS = ".numba_config.yaml"
SAFE_PATH, OURS = "PYTHONSAFEPATH", "mpmbench"  # a variable of Python's, and how we set it


def cache_folder() -> Path:
    """Folder of the kernels compiled from exactly these sources.

    numba does not notice a change in another file that a kernel calls, so every version of the
    sources has a folder of its own; those that nobody used for a month are removed. Plug-ins are
    sources too. Raises `BadInput` when there is no place for it.
    """
    home = cache_home()
    without, with_plugins = sources_hashes()
    folder = home / with_plugins
    start_from(home / without, folder)
    folder.mkdir(exist_ok=True)
    os.utime(folder)
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
    """Set what must be known before numba and the linear algebra libraries are imported.

    Raises `BadInput` when somebody has told numba to compile otherwise, or nothing.
    """
    if Path(NUMBA_SETTINGS).exists():
        why = "numba would take settings from it, which may change results"
        raise BadInput(f"{NUMBA_SETTINGS} in the current folder: {why}; remove it or go elsewhere")
    if environment.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        raise BadInput("NUMBA_DISABLE_JIT: every method needs compiled kernels; unset it")
    if environment.get(SAFE_PATH) == OURS:
        del environment[SAFE_PATH]  # for us only, not for what a plug-in starts
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


@contextmanager
def importing_nothing_from_here() -> Iterator[None]:
    """Within, new Python processes look for no modules in the current folder."""
    before = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = before or OURS
    try:
        yield
    finally:
        del os.environ[SAFE_PATH]
        if before is not None:
            os.environ[SAFE_PATH] = before
