"""The process that children are forked from; it has loaded all heavy libraries once.

Run as ``python -m mpmbench.runs.process.server DESCRIPTOR PARENT``. The client sends a socket to get a
child that serves it, or the number of a child to learn how it ended. When the client goes away the
server ends, and its children end with it.
"""

import os
import signal
import socket
import struct
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection


def end_with_parent(parent: int) -> None:
    """Ask the kernel to kill this process when its parent ends (Linux)."""
    if sys.platform == "linux":
        import ctypes

        set_parent_death_signal = 1
        ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def main(descriptor: int, parent: int) -> None:
    """Serve requests until the client hangs up."""
    end_with_parent(parent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the client decides what ends
    control = socket.socket(fileno=descriptor)
    try:
        answer_requests(control)
    except ConnectionError:  # the client went away while it waited for an answer
        return


def answer_requests(control: socket.socket) -> None:
    """Start children and tell how they ended, until the client hangs up."""
    from mpmbench.runs.process import worker

    server = os.getpid()
    while True:
        request, descriptors, _, _ = socket.recv_fds(control, 8, 1)
        if not request:
            return
        if descriptors:
            pid = os.fork()
            if pid == 0:
                control.close()
                end_with_parent(server)
                serve(worker.serve, Connection(descriptors[0]))
            os.close(descriptors[0])
            control.sendall(struct.pack("q", pid))
        else:
            _, status = os.waitpid(struct.unpack("q", request)[0], 0)
            control.sendall(struct.pack("q", os.waitstatus_to_exitcode(status)))


def serve(answer: Callable[[Connection], None], connection: Connection) -> None:
    """Run the child's loop; the child never returns into the server's code."""
    code = 1
    try:
        answer(connection)
        code = 0
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else 1
    finally:
        os._exit(code)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
