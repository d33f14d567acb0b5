"""Shows Hydra the options of each group, put together from declarations and presets, and the experiments."""

from pathlib import Path

from hydra.core.object_type import ObjectType
from hydra.plugins.config_source import ConfigLoadError, ConfigResult, ConfigSource
from omegaconf import OmegaConf

from mpmbench.settings.files import BadInput, experiments, read_yaml
from mpmbench.settings.schema import GROUPS, composed, options

SCHEME = "mpmbench"


def check_experiment(file: Path) -> None:
    """Raise `BadInput` for what an experiment sets of Hydra besides the sweep itself.

    Hydra can be told to call functions, to set variables of the environment and to run commands of
    a shell. Launchers and what belongs to them are chosen on the command line.
    """
    body = read_yaml(file).get("hydra") or {}
    sweeper = body.get("sweeper") or {} if isinstance(body, dict) else {}
    if not isinstance(body, dict) or set(body) - {"mode", "sweeper"} or set(sweeper) - {"params"}:
        raise BadInput(
            f"{file}: of hydra an experiment sets mode and sweeper.params only; all else is given "
            "on the command line, as in hydra/launcher=joblib"
        )


class OptionsSource(ConfigSource):
    """A tree of configurations by name: ``basis/maxent``, ``experiments/wobbes2020/fig6``."""

    @staticmethod
    def scheme() -> str:
        return SCHEME

    def available(self) -> bool:
        return True

    def load_config(self, config_path: str) -> ConfigResult:
        """One option or experiment; each sets keys of the whole configuration."""
        group, _, name = config_path.removesuffix(".yaml").partition("/")
        if not self.is_config(config_path):
            raise ConfigLoadError(f"Config not found : {config_path}")
        if group == "experiments":
            check_experiment(experiments()[name])
            config = OmegaConf.create(read_yaml(experiments()[name]))
        else:
            config = OmegaConf.create(composed(group, name))
        header: dict[str, str | None] = {"package": "_global_"}
        return ConfigResult(self.provider, f"{SCHEME}://", config, header)  # type: ignore[arg-type]

    def is_group(self, config_path: str) -> bool:
        return config_path == "" or bool(below(config_path))

    def is_config(self, config_path: str) -> bool:
        group, _, name = config_path.removesuffix(".yaml").partition("/")
        return name in names(group)

    def list(self, config_path: str, results_filter: ObjectType | None) -> list[str]:
        """Names directly below another: groups, configurations, or both."""
        found = set()
        for rest in below(config_path):
            first, _, deeper = rest.partition("/")
            if results_filter in (None, ObjectType.GROUP if deeper else ObjectType.CONFIG):
                found.add(first)
        return sorted(found)


def below(config_path: str) -> list[str]:
    """Every configuration below a name, without that."""
    start = f"{config_path.rstrip('/')}/".lstrip("/")
    group = start.partition("/")[0]
    groups = [group] if group else [*GROUPS, "experiments"]
    paths = [f"{one}/{name}" for one in groups for name in names(one)]
    return [path.removeprefix(start) for path in paths if path.startswith(start)]


def names(group: str) -> list[str]:
    """Names in a group; none for a group that is not ours."""
    if group == "experiments":
        return list(experiments())
    return list(options(group)) if group in GROUPS else []
