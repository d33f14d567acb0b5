"""Messages between a command and the process that computes for it: JSON, one a line.

Whatever else a plug-in writes to the same place is noticed, and not waited for.
"""

import json
import socket
from collections.abc import Sequence
from typing import Any

CHUNK = 2**18  # bytes that are taken at once
LONGEST = 2**28  # bytes of a message: what is longer is none


class NoMessage(Exception):
    """Something else has come where a message should."""


class Line:
    """One end of a connection."""

    def __init__(self, end: socket.socket) -> None:
        self.end = end
        self.waiting = bytearray()  # what has come of the next messages

    def send(self, message: Sequence[Any], within: float | None = None) -> None:
        """Send a message; raises `OSError` when the other end is gone, or too slow [s]."""
        self.end.settimeout(within)
        self.end.sendall(json.dumps(message, default=plain).encode() + b"\n")

    def receive(self, seconds: float | None = None) -> list[Any] | None:
        """The next message, a list; None when it is not complete within so many seconds.

        Raises `EOFError` when the other end is closed, `NoMessage` for what is none.
        """
        self.end.settimeout(seconds)
        while b"\n" not in self.waiting:
            try:
                chunk = self.end.recv(CHUNK)
            except (TimeoutError, BlockingIOError):
                return None
            if not chunk:
                raise EOFError
            self.waiting += chunk
            if b"\n" not in chunk and seconds is not None:
                self._refuse_too_long()
                return None
        text, _, self.waiting = self.waiting.partition(b"\n")
        try:
            message = json.loads(text)
        except (ValueError, RecursionError):
            message = None
        if not isinstance(message, list):
            raise NoMessage(f"{bytes(text[:40])!r} is no message")
        return message

    def _refuse_too_long(self) -> None:
        if len(self.waiting) > LONGEST:
            raise NoMessage(f"{len(self.waiting)} bytes are no message")

    def is_silent(self) -> bool:
        """Whether nothing waits to be received, not even the end."""
        if self.waiting:
            return False
        self.end.settimeout(0)
        try:
            self.end.recv(1, socket.MSG_PEEK)
        except BlockingIOError:
            return True
        except OSError:
            pass
        return False

    def close(self) -> None:
        """Hang up."""
        self.end.close()


def plain(value: Any) -> Any:
    """What JSON takes instead of an array or a number of numpy, else the text."""
    return value.tolist() if hasattr(value, "tolist") else str(value)
