"""Folders that nobody else can write to: what lies in them is run, or decides whose turn it is."""

import errno
import os
import secrets
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from mpmbench.settings.files import BadInput


def private_folder(place: Path) -> Path:
    """`place` as a folder of this user, made where it is not there, that others cannot enter.

    Raises
    ------
    PermissionError
        When it is no folder but, for example, a link to one, when it belongs to another user, or
        when others could have written to it: what lies in it may then be theirs.
    """
    place.parent.mkdir(parents=True, exist_ok=True)
    with suppress(FileExistsError):
        place.mkdir(mode=0o700)
    found = place.lstat()
    if not stat.S_ISDIR(found.st_mode):
        why = "is no folder"
    elif found.st_uid != os.getuid():
        why = "belongs to another user"
    elif found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        why = "can be written by others"
    else:
        place.chmod(0o700)
        return place
    raise PermissionError(errno.EPERM, why, str(place))


@contextmanager
def temporary_folder(prefix: str) -> Iterator[Path]:
    """A new folder of this user for as long as the context lasts.

    Its name is known before it is made: what interrupts a command just after that, when
    `tempfile.TemporaryDirectory` does not yet know what it has to remove, leaves nothing behind.
    """
    folder = Path(tempfile.gettempdir()) / f"{prefix}{secrets.token_hex(8)}"
    try:
        folder.mkdir(mode=0o700)
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def cache_home() -> Path:
    """Where compiled kernels are kept, and what else may be computed anew.

    What numba finds there it runs: the folder has to be this user's alone.

    Raises
    ------
    BadInput
        When neither the user's cache nor the system's temporary folder has such a place.
    """
    own = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "mpmbench"
    refused = []
    for home in (own, Path(tempfile.gettempdir()) / f"mpmbench-{os.getuid()}"):
        try:
            return private_folder(home)
        except OSError as error:
            refused.append(f"{home} {str(error.strerror).lower()}")
    what = "compiled kernels, which are run, need a folder that only this user can write to"
    raise BadInput(f"{what}: {' and '.join(refused)}; name another one in XDG_CACHE_HOME")
