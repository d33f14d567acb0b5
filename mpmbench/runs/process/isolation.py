"""Children that compute: watched from outside, and killed when a limit is reached.

Nothing short of this contains a hang inside compiled code or a segmentation fault. A child is used
again after a run that ended well and replaced after anything else.
"""

import atexit
import os
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import psutil

from mpmbench.core.registry import plugin_files
from mpmbench.runs.process.environment import prepare
from mpmbench.runs.process.messages import Line, NoMessage
from mpmbench.runs.process.server import kill_group

WATCH_EVERY = 0.05  # seconds between two looks at the memory of a child
LIST_EVERY = 1.0  # seconds between two looks at which processes it has started
CLOSE_WITHIN = 10.0  # seconds that a server has for ending what it started
SEND_WITHIN = 600.0  # seconds for a request to be taken


@dataclass(eq=False)
class Ended(Exception):
    """A child that did not answer: it died, or it was killed for reaching a limit."""

    status: str
    reason: str
    time_reached: float = 0.0  # simulated time [s] of the last message about progress
    solver_time: float = 0.0  # wall-clock time [s] since the solver started


class NotStarted(Ended):
    """A child that did not even begin."""


@dataclass
class Server:
    """Our end of the process that children are forked from (`mpmbench.runs.process.server`)."""

    control: socket.socket
    process: subprocess.Popen[bytes]
    relevant: dict[str, str]  # what it would have to be started anew for

    @classmethod
    def start(cls, environment: dict[str, str], relevant: dict[str, str]) -> "Server":
        """Start it; it imports the heavy libraries while the caller goes on."""
        ours, theirs = socket.socketpair()
        command = [sys.executable, "-P", "-m", "mpmbench.runs.process.server"]
        command += [str(theirs.fileno()), str(os.getpid())]
        descriptors = (theirs.fileno(),)
        process = subprocess.Popen(
            command, pass_fds=descriptors, env=environment, start_new_session=True
        )
        theirs.close()
        return cls(ours, process, relevant)

    def child(self) -> "Child":
        """A new child."""
        ours, theirs = socket.socketpair()
        with theirs:
            descriptors = [theirs.fileno()]
            pid = self._exchange(lambda: socket.send_fds(self.control, [b"child"], descriptors))
        if pid < 0:  # there is none: so many bytes say why
            raise NotStarted("crashed", self.control.recv(-pid, socket.MSG_WAITALL).decode())
        return Child(self, Line(ours), pid)

    def exit_code(self, pid: int) -> int:
        """How a child ended: its exit code, or minus the number of the signal that killed it."""
        try:
            return self._exchange(lambda: self.control.sendall(struct.pack("q", pid)))
        except (OSError, Ended):
            return -signal.SIGKILL  # children end with the server

    def _exchange(self, send: Callable[[], object]) -> int:
        """Send a request and return its answer; a server that was not waited for is closed."""
        try:
            send()
            data = self.control.recv(8, socket.MSG_WAITALL)
        except BaseException:
            self.close()
            raise
        if len(data) < 8:
            reason = "the process that starts the solver did not start or was killed"
            raise NotStarted("crashed", reason)
        return int(struct.unpack("q", data)[0])

    def descendants(self) -> list[psutil.Process]:
        """All processes that the server has started, and that these have."""
        with suppress(psutil.Error):
            return list(psutil.Process(self.process.pid).children(recursive=True))
        return []

    def close(self) -> None:
        """End the server and whatever it started."""
        self.control.close()
        self.process.terminate()
        try:
            self.process.wait(CLOSE_WITHIN)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


@dataclass
class Child:
    """A process that answers the requests of `mpmbench.runs.process.worker`."""

    server: Server
    line: Line
    pid: int
    progress: tuple[float, float] | None = None  # fraction and simulated time of the solver
    solver_started: float = 0.0  # on the clock of `time.monotonic`
    watched: "list[psutil.Process]" = field(default_factory=list)  # it and what it has started
    listed: float = 0.0  # when these were looked up, on the same clock

    def ask(
        self,
        *request: Any,
        limits: dict[str, Any],
        on_progress: Callable[[float, float], None] | None = None,
        on_part: Callable[[Any], None] | None = None,
    ) -> Any:
        """Send a request and wait for its answer, within the limits; `on_part` takes parts of it.

        The limit of the set-up counts for each part. Raises `Ended` when the child died or reached
        a limit; it is gone then.
        """
        self.progress = None
        phase, deadline = "setup", time.monotonic() + limits["setup"]
        try:
            self.line.send(request, SEND_WITHIN)
            while True:
                patience = min(WATCH_EVERY, max(1e-3, deadline - time.monotonic()))
                match self.line.receive(patience):
                    case None:
                        pass
                    case ["done", answer]:
                        return answer
                    case ["failed", str(reason)]:
                        raise self.ended("crashed", reason)
                    case ["part", part] if on_part is not None:
                        on_part(part)
                        deadline = time.monotonic() + limits["setup"]
                    case ["progress", float(fraction), float(simulation_time)]:
                        if self.progress is None:
                            self.solver_started = time.monotonic()
                            phase, deadline = "time", self.solver_started + limits["time"]
                        self.progress = fraction, simulation_time
                        if on_progress:
                            on_progress(fraction, simulation_time)
                    case other:
                        raise NoMessage(f"{str(other)[:40]} is no message")
                if time.monotonic() >= deadline:
                    raise self.ended("timeout", f"stopped at limits.{phase} = {limits[phase]:g} s")
                if limits["memory"] is not None and self.memory() > limits["memory"]:
                    reason = f"stopped at limits.memory = {limits['memory']:g} MiB"
                    raise self.ended("out_of_memory", reason)
        except (EOFError, OSError):
            raise self.ended("crashed", f"the process {how_it_ended(self.end())}") from None
        except NoMessage as error:
            self.end()
            what = f"something else wrote to the pipe of the process: {error}"
            raise self.ended("crashed", what) from None
        except BaseException:
            self.end()
            raise

    def ended(self, status: str, reason: str) -> Ended:
        """The exception for a child that ends here, with how far the run had come."""
        if self.progress is None:
            return Ended(status, f"{reason}, before the solver had started")
        fraction, simulation_time = self.progress
        text = f"{reason}, {fraction:.0%} done, at t = {simulation_time:.6g} s"
        return Ended(status, text, simulation_time, time.monotonic() - self.solver_started)

    def memory(self) -> float:
        """Resident memory [MiB] of the child and of all that it has started; 0 when it is gone.

        What these share counts for each of them.
        """
        now = time.monotonic()
        if not self.watched or now - self.listed > LIST_EVERY:
            self.listed = now
            self.watched = self.server.descendants() if self.watched else self.itself()
        total = 0
        for process in self.watched:
            with suppress(psutil.Error):
                total += process.memory_info().rss
        return total / 2**20

    def itself(self) -> list[psutil.Process]:
        """The child, as long as it is there."""
        with suppress(psutil.Error):
            return [psutil.Process(self.pid)]
        return []

    def end(self) -> int:
        """Kill the child and what it has started, if it is still there, and say how it ended."""
        self.line.close()
        # The server keeps the number until it is asked how the child ended.
        kill_group(self.pid)
        return self.server.exit_code(self.pid)


def how_it_ended(code: int) -> str:
    """Words for an exit code."""
    if code < 0:
        return f"was ended by {signal.Signals(-code).name}"
    return f"left with exit code {code} and no result"


class Processes:
    """The server of this process and the child that requests go to, started on use.

    A server serves as long as the environment and the plug-ins are those that it was started with.
    """

    def __init__(self) -> None:
        self.server: Server | None = None
        self.child: Child | None = None
        atexit.register(self.close)

    def warm_up(self) -> Server:
        """Start the server, or start it anew when plug-ins or sources have changed."""
        environment = dict(os.environ)
        prepare(environment)
        relevant = {
            "cache": environment["NUMBA_CACHE_DIR"],
            "plugins": environment.get("MPMBENCH_PLUGINS", ""),
            "files": plugin_state(),
        }
        old = self.server
        if old is not None and (old.process.poll() is not None or old.relevant != relevant):
            self.close()
        if self.server is None:
            self.server = Server.start(environment, relevant)
        return self.server

    def new_child(self) -> Child:
        """A new child, of a new server if need be; raises `Ended` when none starts."""
        try:
            return (self.server or self.warm_up()).child()
        except (OSError, Ended):
            self.close()
            return self.warm_up().child()

    def ask(self, *request: Any, **watched: Any) -> Any:
        """Have a child answer a request, see `Child.ask`; the child before when it ended well."""
        if self.server is not None and self.server.relevant.get("files") != plugin_state():
            self.close()  # a plug-in was edited: what is loaded would fit neither it nor its cache
        child, self.child = self.child, None
        if child is not None and not child.line.is_silent():  # it was killed while it waited
            child.end()
            child = None
        child = child or self.new_child()
        answer = child.ask(*request, **watched)
        if isinstance(answer, dict) and answer.get("status", "ok") not in ("ok", "not_applicable"):
            child.end()
        else:
            self.child = child
        return answer

    def renew(self) -> None:
        """Let the next request go to a new child."""
        child, self.child = self.child, None
        if child is not None:
            child.end()

    def close(self) -> None:
        """End the server and its children."""
        if self.server is not None:
            self.server.close()
        self.server = self.child = None


def plugin_state() -> str:
    """What changes when a plug-in file is added, removed, renamed or edited."""
    try:
        stats = [(str(file), file.stat()) for file in plugin_files()]
    except OSError:  # one is being replaced
        return ""
    return str([(name, stat.st_mtime_ns, stat.st_size) for name, stat in stats])


# Those of this process: starting them takes a second, so that a notebook's calls and a launcher's
# worker share them.
processes = Processes()
