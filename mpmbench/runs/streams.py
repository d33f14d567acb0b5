"""Standard output that may be closed, full or gone: what is printed is lost, the work goes on."""

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

SILENT = (errno.EPIPE, errno.EBADF)  # somebody closed it, as ``| head`` does, and knows


def open_what_is_closed() -> None:
    """Give a process that was started without one of its standard streams an empty one.

    Its next file would take the place of that stream.
    """
    for descriptor, mode in ((0, os.O_RDONLY), (1, os.O_WRONLY), (2, os.O_WRONLY)):
        try:
            os.fstat(descriptor)
        except OSError:
            nothing = os.open(os.devnull, mode)
            if nothing != descriptor:
                os.dup2(nothing, descriptor)
                os.close(nothing)
            os.set_inheritable(descriptor, True)
    for name, descriptor in (("stdout", 1), ("stderr", 2)):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(descriptor, "w", closefd=False))


class Forgiving:
    """A text stream that drops what it cannot write, and says so once if nobody wanted that."""

    def __init__(self, stream: TextIO, complain: TextIO | None = None) -> None:
        self._stream, self._complain = stream, complain

    def write(self, text: str) -> int:
        """Write as much as the stream takes; characters that it does not know become escapes."""
        try:
            return self._stream.write(text)
        except UnicodeEncodeError:
            encoding = self._stream.encoding
            return self.write(text.encode(encoding, "backslashreplace").decode(encoding))
        except OSError as error:
            self._give_up(error)
        except ValueError:  # it is closed
            pass
        return len(text)

    def flush(self) -> None:
        """Flush what can be flushed."""
        try:
            self._stream.flush()
        except OSError as error:
            self._give_up(error)
        except ValueError:
            pass

    def _give_up(self, error: OSError) -> None:
        """Let all that follows go nowhere."""
        with suppress(OSError, ValueError):
            nothing = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nothing, self._stream.fileno())
            os.close(nothing)
        if self._complain is not None and error.errno not in SILENT:
            why = f"{str(error.strerror).lower()}; what is computed is kept"
            self._complain.write(f"mpmbench: standard output cannot be written: {why}\n")
            self._complain.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def forgiving() -> Iterator[None]:
    """Within, standard output and standard error are `Forgiving`."""
    open_what_is_closed()
    before = sys.stdout, sys.stderr
    errors = Forgiving(sys.stderr)
    output: Any = Forgiving(sys.stdout, errors)  # type: ignore[arg-type]
    sys.stdout, sys.stderr = output, errors  # type: ignore[assignment]
    try:
        yield
    finally:
        output.flush()
        errors.flush()
        sys.stdout, sys.stderr = before
