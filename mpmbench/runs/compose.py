"""Our side of Hydra: where it finds options and experiments, and what it does with the cells of a sweep."""

from collections.abc import Callable, Sequence
from typing import Any

from hydra._internal.core_plugins.file_config_source import FileConfigSource
from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.object_type import ObjectType
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.plugins import Plugins
from hydra.errors import HydraException
from hydra.plugins.config_source import ConfigResult
from hydra.plugins.search_path_plugin import SearchPathPlugin
from hydra.plugins.sweeper import Sweeper
from omegaconf import DictConfig, OmegaConf, open_dict

from mpmbench.runs import settings, sweep
from mpmbench.runs.schema import GROUPS, BadInput, conf_folders, declared, declared_anywhere, shipped_folder


class ExperimentsSource(FileConfigSource):
    """Shows the folder ``experiments`` beside ``conf`` as a group of that name, and none of its neighbours."""

    @staticmethod
    def scheme() -> str:
        """Its part of a search path entry."""
        return "experiments"

    def _ours(self, config_path: str) -> bool:
        return config_path == "experiments" or config_path.startswith("experiments/")

    def load_config(self, config_path: str) -> ConfigResult:
        """One experiment."""
        return super().load_config(config_path)

    def is_group(self, config_path: str) -> bool:
        """Whether this is a folder of experiments."""
        return config_path == "" or (self._ours(config_path) and super().is_group(config_path))

    def is_config(self, config_path: str) -> bool:
        """Whether this is an experiment."""
        return self._ours(config_path) and super().is_config(config_path)

    def list(self, config_path: str, results_filter: ObjectType | None) -> list[str]:
        """Experiments and folders of them."""
        if config_path == "":
            return ["experiments"] if results_filter in (None, ObjectType.GROUP) else []
        return super().list(config_path, results_filter) if self._ours(config_path) else []


class OptionFolders(SearchPathPlugin):
    """Adds the experiments and the ``conf`` folders of plug-ins to Hydra's search path."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        """Append the folders."""
        search_path.append("mpmbench", f"experiments://{shipped_folder('experiments').parent}")
        for folder in conf_folders()[1:]:
            search_path.append("mpmbench-plugins", f"file://{folder}")


def install() -> None:
    """Register the above with Hydra, and have sweeps validated by us."""
    plugins = Plugins.instance()
    plugins.register(ExperimentsSource)
    plugins.register(OptionFolders)
    for sweeper in plugins.discover(Sweeper):
        sweeper.validate_batch_is_legal = plan_batch  # type: ignore[assignment,method-assign]


class NothingToRun(Exception):
    """All cells of the sweep are finished or do not apply."""


announce: Callable[[sweep.Plan], None] = print  # set by the command line: what is said once the plan stands
only_plan = False  # set by `status`: stop after planning


def plan_batch(self: Any, batch: list[list[str]]) -> None:
    """Replace the cells of a batch by those that are to be run; called by Hydra before it runs them.

    Raises
    ------
    BadInput
        When any cell is wrong; nothing has run then.
    NothingToRun
        When no cell is left.
    """
    loader = self.hydra_context.config_loader
    combinations = [cell for overrides in batch for cell in expand_cases(self.config, list(overrides))]
    plan = sweep.make_plan(combinations, lambda overrides: compose_cell(loader, self.config, overrides))
    announce(plan)
    if only_plan:
        raise NothingToRun
    plan.save(sweep.ledger())
    sweep.record_inapplicable(plan)
    if not plan.to_run:
        raise NothingToRun
    batch[:] = [cell.overrides for cell in plan.to_run]


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


def compose_cell(loader: Any, master: DictConfig, overrides: list[str]) -> tuple[dict[str, Any], str]:
    """Configuration of one cell, and why it does not apply, if so.

    A key that the chosen option lacks but another one has is set aside for composing and then put back.
    """
    try:
        return resolved(loader.load_sweep_config(master, list(overrides)))
    except HydraException:
        below = [text for text in overrides if text.partition("=")[0].partition(".")[0] in GROUPS and "." in text.partition("=")[0]]
        choices = loader.load_sweep_config(master, [text for text in overrides if text not in below])
        foreign = [text for text in below if not _has(choices, text.partition("=")[0])]
        if not foreign:
            raise
        composed = loader.load_sweep_config(master, [text for text in overrides if text not in foreign])
        for override in OverridesParser.create().parse_overrides(foreign):
            group, _, key = override.key_or_group.partition(".")
            with open_dict(composed[group]):
                composed[group][key] = override.value()
        return resolved(composed)


def _has(composed: DictConfig, key: str) -> bool:
    group, _, name = key.partition(".")
    return name in declared(group, composed[group].name)


def resolved(composed: DictConfig) -> tuple[dict[str, Any], str]:
    hydra = composed.hydra
    task = OmegaConf.masked_copy(composed, [str(key) for key in composed if key != "hydra"])
    return settings.resolve(task, hydra)


def as_sweep(pairs: Sequence[str]) -> list[str]:
    """Pairs for a sweep, with keys below groups as choices of one.

    Hydra applies single values to the options chosen first, where a key of another option does not exist; it leaves
    choices to the cells.
    """
    parser = OverridesParser.create()
    rewritten = []
    for pair in pairs:
        key, _, value = pair.partition("=")
        group, _, name = key.partition(".")
        if group in GROUPS and name in declared_anywhere(group) and not parser.parse_override(pair).is_sweep_override():
            pair = f"{key}=choice({value})"
        rewritten.append(pair)
    return rewritten


def readable(error: Exception, pairs: Sequence[str]) -> BadInput:
    """One sentence for what Hydra has to say."""
    text = str(error) or str(error.__cause__ or type(error).__name__)
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    first = lines[0] if lines else type(error).__name__
    for pair in pairs:
        key, _, value = pair.partition("=")
        group, _, name = key.partition(".")
        if first.startswith(f"Could not override '{key}'") and name:
            owners = [option for option in _options(group) if name in declared(group, option)]
            return BadInput(f"{pair}: the chosen {group} has no {name}, only {', '.join(owners)} has")
        if "Ambiguous value" in first and f"'{pair}'" in first:
            return BadInput(f"{pair}: several values need -m, which runs each of them")
    return BadInput(" ".join(line for line in lines[:2] if "HYDRA_FULL_ERROR" not in line))


def _options(group: str) -> list[str]:
    from mpmbench.runs.schema import options

    return list(options(group)) if group in GROUPS else []
