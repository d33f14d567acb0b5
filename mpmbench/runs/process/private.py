"""Folders that nobody else can write to: what lies in them is run, or decides whose turn it is."""

import errno
import os
import stat
from contextlib import suppress
from pathlib import Path


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
