"""How busy the machine is with other work while a run is under way (Linux; elsewhere unknown).

Others are all processes but the one that computes, the one that it was forked from, and the command
that these belong to. Other runs of a sweep that goes on in parallel count as others.
"""

import os
import time
from dataclasses import dataclass
from pathlib import Path

import psutil

TICK = 1.0 / os.sysconf("SC_CLK_TCK")  # [s], the unit of the kernel's sums
TRUSTED = 0.2  # relative deviation of the kernel's sum of all times from processors x time


@dataclass(frozen=True)
class Reading:
    """Sums since the machine or the processes started [s]."""

    time: float
    total: float  # of all processors, idle or not
    busy: float
    stolen: float  # by other guests of the same host
    own: float  # of our processes


def reading() -> Reading | None:
    """The sums now; None where the system does not tell."""
    try:
        # user, nice, system, idle, wait for input and output, two kinds of interrupts, steal
        line = Path("/proc/stat").read_text().partition("\n")[0].split()
        user, nice, system, idle, waiting, hard, soft, stolen = (TICK * int(n) for n in line[1:9])
        busy = user + nice + system + hard + soft
        total = busy + idle + waiting + stolen
        return Reading(time.perf_counter(), total, busy, stolen, own_time())
    except (OSError, ValueError, psutil.Error):
        return None


def own_time() -> float:
    """CPU time [s] of this process, of its parent and of the command."""
    server = psutil.Process(os.getppid())
    times = [one.cpu_times() for one in (server, server.parent()) if one is not None]
    return time.process_time() + sum(spent.user + spent.system for spent in times)


def load_between(before: Reading | None, after: Reading | None) -> dict[str, float]:
    """Processors kept busy by others, and processors stolen by other guests, on average.

    Not a number where it is unknown: without readings, or when the times of all processors do not
    add up, as in a container that hides them.
    """
    unknown = {"load_by_others": float("nan"), "steal": float("nan")}
    if before is None or after is None:
        return unknown
    passed = after.time - before.time
    processors = os.cpu_count() or 1
    expected, rounding = processors * passed, processors * TICK
    if passed < TICK or abs(after.total - before.total - expected) > TRUSTED * expected + rounding:
        return unknown
    others = (after.busy - before.busy) - (after.own - before.own)
    return {
        "load_by_others": max(0.0, others) / passed,
        "steal": (after.stolen - before.stolen) / passed,
    }
