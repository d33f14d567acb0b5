"""Shows Hydra the options of each group, put together from declarations and presets, and the experiments."""

from hydra.core.object_type import ObjectType
from hydra.plugins.config_source import ConfigLoadError, ConfigResult, ConfigSource
from omegaconf import OmegaConf

from mpmbench.settings.files import experiments
from mpmbench.settings.schema import GROUPS, composed, options

SCHEME = "mpmbench"


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
            config = OmegaConf.load(experiments()[name])
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
