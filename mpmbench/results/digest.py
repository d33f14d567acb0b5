"""A digest in every result file, of all its other bytes: damage is found before anything is read.

It stands in the file, in the variable ``digest``, after a text by which it is found in the bytes.
The HDF5 library keeps a variable of text as it is, without a checksum of its own that a later
change would break. So the digest covers names, shapes, numbers and attributes alike, costs no more
than reading the file once, and is checked before the library is given a damaged file to parse.
"""

import hashlib
import os
from pathlib import Path

VARIABLE = "digest"
MARK = b"SHA-256 of all other bytes of this file: "
LENGTH = 2 * hashlib.sha256().digest_size  # characters
EMPTY = MARK + b"0" * LENGTH  # what the variable holds until the rest of the file is written


def seal(path: Path) -> None:
    """Write the digest of a file into it, and see to it that the disk has it.

    Raises
    ------
    OSError
        When the file has no place for it, since it was not written whole.
    """
    with open(path, "r+b") as file:
        content = file.read()
        start = _start(content)
        if start < 0:
            raise OSError(f"{path} was not written whole")
        file.seek(start)
        file.write(_of_others(content, start))
        file.flush()
        os.fsync(file.fileno())


def stored(content: bytes) -> str:
    """The digest that the bytes of a file carry; empty when there is none."""
    start = _start(content)
    return content[start : start + LENGTH].decode("latin-1") if start >= 0 else ""


def fits(content: bytes) -> bool:
    """Whether the digest that the bytes of a file carry is the one that they have."""
    return stored(content).encode("latin-1") == _of_others(content, _start(content))


def _start(content: bytes) -> int:
    """Where the digest stands; -1 when there is none."""
    found = content.find(MARK)
    return found + len(MARK) if found >= 0 else -1


def _of_others(content: bytes, start: int) -> bytes:
    view = memoryview(content)
    found = hashlib.sha256(view[:start])
    found.update(view[start + LENGTH :])
    return found.hexdigest().encode()
