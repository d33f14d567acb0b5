"""Jobs under one of Hydra's launchers: joblib on one machine, submitit on a cluster."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any

from hydra._internal.callbacks import Callbacks
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.core.plugins import Plugins
from hydra.types import HydraContext, RunMode
from omegaconf import open_dict

from mpmbench.runs.hydra.compose import comes_of_interruption, composing, words_of_hydra


def call(function: Callable[[str], None], names: Sequence[str], folder: Path, config: Any) -> None:
    """What a launcher does in its own processes: call a function with the name of the job.

    Where there are `names`, with each of them instead that no other job has taken.
    """
    if not names:
        function(HydraConfig.get().job.name)
    for name in names:
        if takes(folder, name):
            function(name)


def takes(folder: Path, name: str) -> bool:
    """Whether this process is the first to take a name."""
    try:
        mark_of(folder, name).touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


def mark_of(folder: Path, name: str) -> Path:
    """The file that says that a name is taken."""
    return folder / f"{name}.taken"


def launch(
    pairs: Sequence[str],
    function: Callable[[str], None],
    names: Sequence[str],
    folder: Path,
    workers: int,
) -> None:
    """Have the launcher that the command line chooses call a function with each name, and wait.

    It may leave its own files in `folder`; joblib starts so many workers unless the command line
    says how many. Hydra keeps two whole configurations for each job until all have ended, so that a
    worker of joblib is one job. Raises `BadInput` when there is no such launcher, and whatever a
    job or the launcher raises.
    """
    with composing(pairs):
        ours = GlobalHydra.instance().hydra
        assert ours is not None
        words = [*words_of_hydra(pairs), f"hydra.sweep.dir={folder}"]
        config = ours.compose_config(
            "config", words, run_mode=RunMode.MULTIRUN, with_log_configuration=False
        )
        jobs, queue = list(names), []
        if "n_jobs" in config.hydra.launcher:
            if config.hydra.launcher.n_jobs == -1:
                with open_dict(config.hydra.launcher):
                    config.hydra.launcher.n_jobs = workers
            number = max(workers, config.hydra.launcher.n_jobs)
            jobs, queue = [f"worker{k}" for k in range(number)], list(names)
            for name in names:  # a worker that was killed may have taken it
                mark_of(folder, name).unlink(missing_ok=True)
        HydraConfig.instance().set_config(config)
        launcher = Plugins.instance().instantiate_launcher(
            hydra_context=HydraContext(ours.config_loader, Callbacks(config)),
            task_function=partial(call, function, queue, folder),
            config=config,
        )
    try:
        with _cluster_of(config):
            for job in launcher.launch([[f"hydra.job.name={name}"] for name in jobs], 0):
                _ = job.return_value  # raises what the job has raised
    except Exception as error:
        if comes_of_interruption(error):
            raise KeyboardInterrupt from None
        raise


def _cluster_of(config: Any) -> AbstractContextManager[None]:
    """What has to be done around jobs of SLURM, and around others nothing."""
    if config.hydra.runtime.choices["hydra/launcher"] != "submitit_slurm":
        return nullcontext()
    from mpmbench.runs.hydra import slurm

    return slurm.jobs()
