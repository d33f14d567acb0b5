"""Our side of Hydra: where it finds options and experiments, and what it does with the cells of a sweep."""

import os
import sys
import tempfile
from collections.abc import Callable, Container, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import hydra
from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.plugins import Plugins
from hydra.errors import HydraException, OverrideParseException
from hydra.plugins.search_path_plugin import SearchPathPlugin
from hydra.plugins.sweeper import Sweeper
from omegaconf import DictConfig, OmegaConf, open_dict
from omegaconf.errors import OmegaConfBaseException

from mpmbench.runs.hydra.composer import Composer
from mpmbench.runs.hydra.source import SCHEME, OptionsSource
from mpmbench.runs.sweep import launchers
from mpmbench.runs.sweep.plan import Plan, make_plan, record_inapplicable
from mpmbench.settings import resolve
from mpmbench.settings.files import read_yaml, shipped_folder
from mpmbench.settings.schema import (
    GROUPS,
    BadInput,
    declared,
    declared_anywhere,
    experiments,
    options,
)


class SearchPath(SearchPathPlugin):
    """Lets Hydra ask us for options and experiments before it looks for files."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        """Put ourselves first."""
        search_path.prepend("mpmbench", f"{SCHEME}://")


def install() -> None:
    """Register the above with Hydra, and have sweeps validated by us."""
    plugins = Plugins.instance()
    plugins.register(OptionsSource)
    plugins.register(SearchPath)
    for sweeper in plugins.discover(Sweeper):
        sweeper.validate_batch_is_legal = plan_batch  # type: ignore[attr-defined]


class NothingToRun(Exception):
    """All cells of the sweep are finished or do not apply."""


@dataclass
class Sweeping:
    """What the command line wants of a sweep; Hydra leaves no other way to hand it to `plan_batch`."""

    announce: Callable[[Plan], Any] = lambda plan: None  # what is done once the plan stands
    only_plan: bool = False  # stop then
    plan: Plan | None = (
        None  # stands already: a launcher has died, and what it left undone is launched again
    )
    single: dict[str, Any] | None = None  # configuration of a run that is no sweep
    done: Callable[[], Container[str]] = tuple  # names of the runs that have ended


sweeping = Sweeping()


def plan_batch(self: Any, batch: list[list[str]]) -> None:
    """Replace the cells of a batch by those that are to be run; called by Hydra before it runs them.

    Raises
    ------
    BadInput
        When any cell is wrong; nothing has run then.
    NothingToRun
        When no cell is left.
    """
    if sweeping.plan is None:
        if self.max_batch_size:
            raise BadInput(
                "hydra.sweeper.max_batch_size: a sweep is checked as a whole before it runs; leave it out"
            )
        loader = self.hydra_context.config_loader
        combinations = [
            cell for overrides in batch for cell in expand_cases(self.config, list(overrides))
        ]
        composer = Composer(lambda choices: loader.load_sweep_config(self.config, choices))
        sweeping.plan = make_plan(
            combinations,
            lambda cell: composer.cell(cell) or compose_cell(loader, self.config, cell),
        )
        launchers.prepare(self.launcher, self.config, sweeping.plan, sweeping.only_plan)
        sweeping.announce(sweeping.plan)
        if sweeping.only_plan:
            raise NothingToRun
        record_inapplicable(sweeping.plan)
        launchers.warm_up(launchers.name_of(self.config.hydra), sweeping.plan)
    done = sweeping.done()
    batch[:] = [cell.overrides for cell in sweeping.plan.to_run if cell.name not in done]
    if not batch:
        raise NothingToRun


def expand_cases(master: DictConfig, overrides: list[str]) -> list[list[str]]:
    """The cells that the experiment's ``cases`` make of one combination; the command line beats a case."""
    cases = [str(case) for case in master.get("cases") or []]
    if not cases:
        return [overrides]
    typed = {override.partition("=")[0] for override in master.hydra.overrides.task}
    cells = []
    for case in cases:
        words = [word for word in case.split() if word.partition("=")[0] not in typed]
        keys = {word.partition("=")[0] for word in words}
        kept = [override for override in overrides if override.partition("=")[0] not in keys]
        cells.append([*kept, *words])
    return cells


def compose_cell(
    loader: Any, master: DictConfig, overrides: list[str]
) -> tuple[dict[str, Any], str]:
    """Configuration of one cell, and why it does not apply, if so.

    A key that the chosen option lacks but another one has is set aside for composing and then put
    back.
    """
    try:
        return resolved(loader.load_sweep_config(master, list(overrides)))
    except HydraException:
        below = [
            text for text in overrides if text.startswith(tuple(f"{group}." for group in GROUPS))
        ]
        choices = loader.load_sweep_config(
            master, [text for text in overrides if text not in below]
        )
        foreign = [text for text in below if not _has(choices, text.partition("=")[0])]
        if not foreign:
            raise
        composed = loader.load_sweep_config(
            master, [text for text in overrides if text not in foreign]
        )
        for override in OverridesParser.create().parse_overrides(foreign):
            group, _, key = override.key_or_group.partition(".")
            with open_dict(composed[group]):
                composed[group][key] = override.value()
        return resolved(composed)


def _has(composed: DictConfig, key: str) -> bool:
    group, _, name = key.partition(".")
    return name in declared(group, composed[group].name)


def resolved(composed: DictConfig) -> tuple[dict[str, Any], str]:
    """Plain configuration of what Hydra composed, and why it does not apply, if so."""
    task = OmegaConf.masked_copy(composed, [str(key) for key in composed if key != "hydra"])
    return resolve.resolve(task, composed.hydra)


def as_sweep(pairs: Sequence[str]) -> list[str]:
    """Pairs for a sweep, with keys below groups as choices of one.

    Hydra applies single values to the options chosen first, where a key of another option does not
    exist; it leaves choices to the cells.
    """
    parser = OverridesParser.create()
    rewritten = []
    for pair in pairs:
        key, _, value = pair.partition("=")
        group, _, name = key.partition(".")
        if (
            group in GROUPS
            and name in declared_anywhere(group)
            and not parser.parse_override(pair).is_sweep_override()
        ):
            pair = f"{key}=choice({value})"
        rewritten.append(pair)
    return rewritten


def wants_many(flags: Sequence[str], pairs: Sequence[str]) -> bool:
    """Whether the command line or the experiment asks for a sweep."""
    chosen = next((pair.partition("=")[2] for pair in pairs if pair.startswith("experiments=")), "")
    hydra = read_yaml(experiments()[chosen]).get("hydra", {}) if chosen in experiments() else {}
    return "-m" in flags or "--multirun" in flags or hydra.get("mode") == "MULTIRUN"


def call_hydra(
    task: Callable[[Any], None], flags: Sequence[str], pairs: Sequence[str], ledger: Path
) -> None:
    """Let Hydra compose, and run `task` on every composed configuration; `ledger` is the folder of its sweeps.

    Raises
    ------
    BadInput
        When the command line cannot be composed.
    """

    def action() -> None:
        arguments = [
            *flags,
            *(as_sweep(pairs) if wants_many(flags, pairs) else pairs),
            f"hydra.sweep.dir={ledger}",
        ]
        before, sys.argv = sys.argv, ["mpmbench", *arguments]
        try:
            hydra.main(
                version_base="1.3", config_path=str(shipped_folder("conf")), config_name="config"
            )(task)()
        except NothingToRun:
            pass
        finally:
            sys.argv = before

    with_hydra(action, pairs)


def plan_only(announce: Callable[[Plan], Any], flags: Sequence[str], pairs: Sequence[str]) -> None:
    """Plan a sweep and run none of it."""
    sweeping.plan, sweeping.announce, sweeping.only_plan = None, announce, True
    with tempfile.TemporaryDirectory(prefix="mpmbench-plan-") as folder:
        try:
            call_hydra(lambda config: None, flags, pairs, Path(folder))
        finally:
            sweeping.only_plan = False


def compose_many(combinations: Sequence[Sequence[str]]) -> list[tuple[dict[str, Any], str]]:
    """Configuration of each combination of overrides, and why it does not apply, if so; nothing runs.

    Raises
    ------
    BadInput
        When an override is wrong.
    """

    def action() -> list[tuple[dict[str, Any], str]]:
        with hydra.initialize_config_dir(str(shipped_folder("conf")), version_base="1.3"):
            composer = Composer(
                lambda pairs: hydra.compose("config", pairs, return_hydra_config=True)
            )
            return [
                composer.cell(pairs) or resolved(composer.compose(list(pairs)))
                for pairs in combinations
            ]

    done: list[tuple[dict[str, Any], str]] = with_hydra(
        action, [pair for pairs in combinations for pair in pairs]
    )
    return done


def with_hydra(action: Callable[[], Any], pairs: Sequence[str]) -> Any:
    """Do something with Hydra and turn its complaints into one sentence."""
    os.environ["HYDRA_FULL_ERROR"] = "1"  # Hydra raises instead of printing
    GlobalHydra.instance().clear()
    install()
    with in_one_sentence(pairs):
        return action()


@contextmanager
def in_one_sentence(pairs: Sequence[str]) -> Iterator[None]:
    """Turn what Hydra raises into `BadInput`."""
    try:
        yield
    except (HydraException, OmegaConfBaseException, ValueError) as error:
        raise readable(error, pairs) from None


def readable(error: Exception, pairs: Sequence[str]) -> BadInput:
    """One sentence for what Hydra has to say."""
    if isinstance(error, OverrideParseException):
        return BadInput(
            f"{error.override}: this value is not understood; quote it if it holds special characters"
        )
    text = " ".join(str(error).split()) or " ".join(
        str(error.__cause__ or type(error).__name__).split()
    )
    for pair in pairs:
        key = pair.partition("=")[0]
        group, _, name = key.partition(".")
        if text.startswith(f"Could not override '{key}'") and group in GROUPS:
            owners = [option for option in options(group) if name in declared(group, option)]
            return BadInput(
                f"{pair}: the chosen {group} has no {name}, which belongs to {', '.join(owners)}"
            )
        if "Ambiguous value" in text and f"'{pair}'" in text:
            return BadInput(f"{pair}: several values need -m, which runs each of them")
        if key == "hydra/launcher" and "Could not find" in text:
            extra = "slurm" if "submitit" in pair else "joblib"
            known = {"joblib", "submitit_local", "submitit_slurm"}
            if pair.partition("=")[2] in known:
                return BadInput(
                    f"{pair}: this launcher is an extra; install it by pip install 'mpmbench[{extra}]'"
                )
            return BadInput(
                f"{pair}: there is no such launcher; there are basic, {', '.join(sorted(known))}"
            )
    return BadInput(
        text.partition(" To append to your config")[0].partition(" Set the environment")[0]
    )
