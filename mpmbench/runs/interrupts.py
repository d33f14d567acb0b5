"""What requests to end do to a command."""

import signal
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

ENDING = (signal.SIGTERM, signal.SIGHUP)  # of the system, and of a terminal that is closed


@contextmanager
def handling(handler: Any, *numbers: signal.Signals) -> Iterator[None]:
    """Within, these signals are handled so; threads other than the main one have no say in that."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)


def interrupt(number: int, frame: Any) -> None:
    """Do what Ctrl-C does."""
    raise KeyboardInterrupt


def terminated_like_interrupted() -> AbstractContextManager[None]:
    """Within, a request to terminate does what Ctrl-C does, unless it is ignored as by ``nohup``."""
    heeded = [number for number in ENDING if signal.getsignal(number) != signal.SIG_IGN]
    return handling(interrupt, *heeded)


def uninterrupted() -> AbstractContextManager[None]:
    """Within, Ctrl-C and requests to terminate are ignored."""
    return handling(signal.SIG_IGN, signal.SIGINT, *ENDING)
