"""The process that children are forked from; it has loaded all heavy libraries once.

Run as ``python -m mpmbench.runs.process.server DESCRIPTOR PARENT``. The client sends a socket to get a
child that serves it, or the number of a child to end it and learn how it ended. Whatever a child has
started ends with it. When the client goes away the server ends, and its children end with it.
"""

import ctypes
import os
import signal
import socket
import struct
import sys
from collections.abc import Callable
from contextlib import suppress

import psutil

from mpmbench.runs.process.messages import Line
from mpmbench.runs.process.reasons import explain
from mpmbench.runs.streams import forgiving

PARENT_DEATH_SIGNAL, CHILD_SUBREAPER = 1, 36  # of prctl
ROUNDS, PAUSE = 20, 0.5  # so often what is left is killed, with at most so many seconds for it


def control_process(option: int, value: int) -> None:
    """Set an option of this process (Linux)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value)


def end_with_parent(parent: int, sent: signal.Signals) -> None:
    """Ask the kernel to send this process a signal when its parent ends (Linux)."""
    control_process(PARENT_DEATH_SIGNAL, sent)
    if os.getppid() != parent:
        os._exit(1)


def main(descriptor: int, parent: int) -> None:
    """Serve requests until the client hangs up."""
    end_with_parent(parent, signal.SIGTERM)
    control_process(CHILD_SUBREAPER, 1)  # what outlives a child comes to us
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the client decides what ends
    control = socket.socket(fileno=descriptor)
    children: set[int] = set()
    with forgiving():
        try:
            answer_requests(control, children)
        except (ConnectionError, SystemExit):  # the client went away, or asked us to
            pass
        finally:
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            for child in list(children):
                with suppress(ChildProcessError):  # it had been waited for
                    end_group(child, children)
    os._exit(0)


def leave(*_: object) -> None:
    """End in an orderly way."""
    raise SystemExit


def answer_requests(control: socket.socket, children: set[int]) -> None:
    """Start children and end them, until the client hangs up."""
    try:
        from mpmbench.runs.process import worker
    except BaseException as error:  # a library that is missing, too old or broken
        socket.recv_fds(control, 8, 1)
        said = f"its libraries cannot be loaded: {explain(error)}".encode(errors="replace")
        control.sendall(struct.pack("q", -len(said)) + said)
        return

    signal.signal(signal.SIGTERM, leave)  # until here there was nothing to clean up
    server = os.getpid()
    while True:
        request, descriptors, _, _ = socket.recv_fds(control, 8, 1)
        if not request:
            return
        if descriptors:
            pid = os.fork()
            if pid == 0:
                serve(worker.serve, control, descriptors[0], server)
            children.add(pid)
            os.close(descriptors[0])
            control.sendall(struct.pack("q", pid))
        else:
            code = end_group(struct.unpack("q", request)[0], children)
            control.sendall(struct.pack("q", code))


def serve(
    answer: Callable[[Line], None], control: socket.socket, descriptor: int, server: int
) -> None:
    """Run the child's loop in a session of its own; the child never returns into the server's code."""
    code = 1
    try:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        os.setsid()
        control.close()
        end_with_parent(server, signal.SIGKILL)
        answer(Line(socket.socket(fileno=descriptor)))
        code = 0
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else 1
    finally:
        os._exit(code)


def kill_group(pid: int) -> None:
    """Kill a child and what it has started, as far as that has not left its process group."""
    for kill in (os.killpg, os.kill):  # it may not have its group yet
        with suppress(ProcessLookupError, PermissionError):
            kill(pid, signal.SIGKILL)


def end_group(pid: int, children: set[int]) -> int:
    """End a child and whatever it has started; how it ended: exit code, or minus a signal's number."""
    kill_group(pid)
    _, status = os.waitpid(pid, 0)
    children.discard(pid)
    for _ in range(ROUNDS):  # what it has left behind is ours now
        left = [one for one in psutil.Process().children() if one.pid not in children]
        if not left:
            break
        for process in left:
            with suppress(psutil.Error):
                process.kill()
        psutil.wait_procs(left, timeout=PAUSE)
    return os.waitstatus_to_exitcode(status)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
