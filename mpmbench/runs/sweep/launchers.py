"""Sweeps under Hydra's launchers: joblib on one machine, submitit on a cluster."""

import hashlib
import os
import sys
import time
from pathlib import Path
from typing import Any

from mpmbench.results.identity import config_json
from mpmbench.runs.process import environment, isolation
from mpmbench.runs.sweep import execute
from mpmbench.runs.sweep.ledger import LOOK_EVERY
from mpmbench.runs.sweep.plan import LASTING, Plan
from mpmbench.say import say
from mpmbench.settings.arguments import value_of
from mpmbench.settings.schema import GROUPS, BadInput

SEQUENTIAL = ("basic", "")


def end_workers(launcher: str) -> None:
    """Wait for the workers of a launcher to go when they have nothing more to do."""
    if launcher == "joblib":
        # Asking joblib for its workers would import it, which fails after an import that was
        # interrupted half-way.
        loky = sys.modules.get("joblib.externals.loky.reusable_executor")
        workers = getattr(loky, "_executor", None)
        if workers is not None:
            workers.shutdown(kill_workers=True)
    elif launcher not in SEQUENTIAL:
        time.sleep(2 * LOOK_EVERY)


def shared_folder(launcher: str, pairs: list[str]) -> Path | None:
    """Where the ledger must lie so that jobs see it; None when any folder will do."""
    if launcher != "submitit_slurm":
        return None
    output = Path(value_of("output_dir", pairs, "results")).absolute()
    execute.check_folder(output)
    output.mkdir(parents=True, exist_ok=True)
    return output


def check(launcher: str, plan: Plan) -> None:
    """Raise `BadInput` when runs are to be timed in a way that the launcher cannot."""
    timed = any(cell.config["timing"] == "exclusive" for cell in plan.to_run)
    if launcher == "submitit_slurm" and timed:
        where = "repeats run on this machine and not on the cluster's"
        raise BadInput(f"timing=exclusive: {where}; time without a launcher")


def workers_for(plan: Plan) -> int:
    """Number of runs side by side that this machine has processors for."""
    threads = max((cell.config["threads"] for cell in plan.to_run), default=1)
    return min(max(1, (os.cpu_count() or 1) // threads), max(1, len(plan.to_run)))


def warm_up(plan: Plan) -> None:
    """Compile the kernels of a parallel sweep once, before its workers would each do it.

    Runs that differ in numbers only share their kernels; those compiled already are known by a mark
    beside the cache.
    """
    kinds: dict[str, dict[str, Any]] = {}
    for cell in sorted(plan.to_run, key=lambda cell: cell.work, reverse=True):
        kinds[kernels_of(cell.config)] = cell.config  # the smallest run of a kind comes last
    marks = environment.cache_folder() / "compiled"
    missing = [kind for kind in kinds if not (marks / kind).exists()]
    for number, kind in enumerate(missing, 1):
        chosen = ", ".join(kinds[kind][group]["name"] for group in ("method", "basis", "problem"))
        say(f"compiling {number}/{len(missing)}: {chosen}")
        if compile_kernels(kinds[kind]) == "ok":
            marks.mkdir(exist_ok=True)
            (marks / kind).touch()


def kernels_of(config: dict[str, Any]) -> str:
    """A name for what is compiled: all choices that are words or whole numbers."""
    choices = {
        group: {key: value for key, value in config[group].items() if not isinstance(value, float)}
        for group in GROUPS
    }
    return hashlib.sha256(config_json(choices).encode()).hexdigest()[:16]


def compile_kernels(config: dict[str, Any]) -> str:
    """Run one step of a configuration and keep nothing; ``ok``, or why nothing was compiled."""
    step, end_time = config["time_step"], config["end_time"]
    short = config | {"end_time": end_time * 1e-6 if step == "auto" else min(end_time, step)}
    try:
        answer = isolation.processes.ask("solve", short, limits=execute.limits_of(config))
        status, reason = answer["status"], answer["reason"]
    except isolation.Ended as end:
        status, reason = end.status, end.reason
    # A step that fails by its numbers has compiled its kernels first.
    return "ok" if status in LASTING else f"{status}, {reason}"
