"""What the netCDF library makes of a file without a digest, asked in a process of its own.

On a damaged file the library may never come to an end, or crash: one random byte in a thousand
does that. A file that has a digest is not given to it damaged; one of an older version may be.

This file is also the program of that process, which imports nothing else of the package.
"""

import atexit
import json
import os
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from typing import IO, Any

TIME = 20.0  # seconds of CPU time that one file may take
LENGTH = 8  # bytes of the number that tells how long a file is
_one_at_a_time = threading.Lock()
_processes: dict[int, "subprocess.Popen[bytes]"] = {}  # by the process that started it


def fault(content: bytes) -> str:
    """Why the library does not read the bytes of a file; empty when it does."""
    with _one_at_a_time:
        process = _processes.get(os.getpid())
        if process is None:
            process = _processes[os.getpid()] = start()
        assert process.stdin is not None and process.stdout is not None
        try:
            process.stdin.write(len(content).to_bytes(LENGTH, "big") + content)
            process.stdin.flush()
            answer = process.stdout.readline()
        except OSError:
            answer = b""
        if answer.endswith(b"\n"):
            return str(json.loads(answer))
        del _processes[os.getpid()]
        code = end(process)
    if code == -signal.SIGPROF:
        return f"the netCDF library has not come to its end in {TIME:g} s"
    return "the process that read it was killed, or the netCDF library has crashed"


def start() -> "subprocess.Popen[bytes]":
    """Start the process; it ends when its standard input is closed."""
    process = subprocess.Popen(
        [sys.executable, "-P", __file__, str(TIME)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl-C is ours to answer
    )
    atexit.register(end, process)
    return process


def end(process: "subprocess.Popen[bytes]") -> int:
    """End the process, if it is still there; the exit code."""
    process.kill()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with suppress(OSError):
                pipe.close()
    return process.wait()


def serve(asked: IO[bytes], answers: IO[bytes], limit: float) -> None:
    """Answer each file by a line: why the library does not read it, or nothing."""
    while length := asked.read(LENGTH):
        content = asked.read(int.from_bytes(length, "big"))
        signal.setitimer(signal.ITIMER_PROF, limit)
        reason = read_all(content)
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        answers.write(json.dumps(reason).encode() + b"\n")
        answers.flush()


def read_all(content: bytes) -> str:
    """Read all that a file holds; why that cannot be done, or nothing."""
    import netCDF4

    try:
        with netCDF4.Dataset("result", memory=content) as file:
            places: list[Any] = [file, *file.variables.values()]
            for place in places:
                for name in place.ncattrs():
                    place.getncattr(name)
            for variable in file.variables.values():
                if variable.size <= len(content):  # what claims more is refused later
                    variable[...]
    except Exception as error:  # whatever the library makes of bytes that were never a result
        return said(error)
    return ""


def said(error: Exception) -> str:
    """What the library says, without the name that it was told."""
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


if __name__ == "__main__":
    serve(sys.stdin.buffer, sys.stdout.buffer, float(sys.argv[1]))
