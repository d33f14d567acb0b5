"""What a request to end does to a command."""

import signal
from typing import Any


class TerminatedLikeInterrupted:
    """While active, a request to terminate does what Ctrl-C does."""

    def __enter__(self) -> None:
        def interrupt(number: int, frame: Any) -> None:
            raise KeyboardInterrupt

        self.before = signal.signal(signal.SIGTERM, interrupt)

    def __exit__(self, *error: object) -> None:
        signal.signal(signal.SIGTERM, self.before)
