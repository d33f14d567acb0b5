"""What compiling costs: CPU seconds of each kernel in the first run of all, the dearest first."""

import json
import os
import subprocess
import sys
import tempfile

# In a process of its own, whose cache of kernels is empty.
LISTEN = """\
import json
import os
import sys
import time

from mpmbench.runs.process.environment import prepare

prepare(os.environ)
from numba.core import event

from mpmbench import case
from mpmbench.runs.hydra.compose import compose_many

inside, seconds = [], {}


class Kernels(event.Listener):
    # a kernel that another one calls is compiled within that: each has its own time alone

    def on_start(self, event):
        inside.append([time.process_time(), 0.0])

    def on_end(self, event):
        began, others = inside.pop()
        took = time.process_time() - began
        if inside:
            inside[-1][1] += took
        function = event.data["dispatcher"].py_func
        name = f"{function.__module__.removeprefix('mpmbench.')}.{function.__qualname__}"
        number, known = seconds.get(name, (0, 0.0))
        seconds[name] = number + 1, known + took - others


((config, _),) = compose_many([sys.argv[1:]])
event.register("numba:compile", Kernels())
case.solve(config)
json.dump(seconds, sys.stdout)
"""


def compiling(*pairs: str) -> None:
    """CPU seconds of each kernel, without those that are compiled for it, of a run with these settings."""
    with tempfile.TemporaryDirectory() as name:
        environment = {**os.environ, "XDG_CACHE_HOME": name}
        command = [sys.executable, "-c", LISTEN, *pairs]
        text = subprocess.run(command, env=environment, check=True, capture_output=True).stdout
    kernels: dict[str, tuple[int, float]] = json.loads(text)
    total = sum(seconds for _, seconds in kernels.values())
    print(
        f"\nCompiling the kernels of a run, CPU seconds: {total:.2f} in all, {len(kernels)} kernels"
    )
    print(f"{'kernel':64} {'variants':>8} {'s':>6}")
    for kernel, (number, seconds) in sorted(kernels.items(), key=lambda item: -item[1][1]):
        print(f"{kernel:64} {number:8} {seconds:6.2f}")
