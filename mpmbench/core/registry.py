"""Plug-ins by name: a file that registers a name is all that a new option needs.

Nothing is imported before it is asked for, so that a run compiles and loads only what it uses.
"""

import importlib
import importlib.util
import os
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import cache, partial, wraps
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from mpmbench.core.moved import keep_old_places

PACKAGE = Path(__file__).parents[1]
PACKAGES = {
    "basis": "mpmbench.core.bases",
    "contact": "mpmbench.core.contact",
    "material": "mpmbench.core.materials",
    "method": "mpmbench.core.loops",
    "problem": "mpmbench.problems",
    "transfer": "mpmbench.core.transfer",
}
_registered: dict[str, dict[str, Any]] = {kind: {} for kind in PACKAGES}
_broken: dict[str, BaseException] = {}  # plug-in files that cannot be imported, by module
PREFIX = "mpmbench_plugin_"  # of the names that plug-in files have as modules
VARIABLE = "MPMBENCH_PLUGINS"
Plugin = TypeVar("Plugin")
Found = TypeVar("Found")


class BrokenPlugin(ImportError):
    """A plug-in that cannot be had; the cause is what its file raised, if it did."""


def register(kind: str, name: str) -> Callable[[Plugin], Plugin]:
    """Class or function decorator that makes a plug-in known as ``<kind>=<name>``."""

    def decorate(plugin: Plugin) -> Plugin:
        known = _registered[kind].get(name)
        if known is not None and known.__module__ != plugin.__module__:
            raise ValueError(
                f"{kind}={name} is registered twice: by {known.__module__} and by {plugin.__module__}"
            )
        _registered[kind][name] = plugin
        return plugin

    return decorate


def get(kind: str, name: str) -> Any:
    """The plug-in ``<kind>=<name>``.

    Raises
    ------
    BrokenPlugin
        When the file that registers it cannot be imported, or when there are two.
    KeyError
        When no file and no plug-in registers this name.
    """
    ours = [module for known, module in places(kind).items() if known == name]
    theirs = [module for module, file in plugin_modules().items() if name in _named(kind, file)]
    if len(ours + theirs) > 1:
        raise BrokenPlugin(
            f"{kind}={name} is registered twice: by {' and by '.join(ours + theirs)}"
        )
    if name not in _registered[kind]:
        _import(ours or theirs or plugin_modules())
    if name not in _registered[kind]:
        for module in theirs or plugin_modules():
            if module in _broken:
                file = plugin_modules()[module]
                sentence = f"{kind}={name}: the plug-in {file.name} cannot be imported"
                raise BrokenPlugin(sentence) from _broken[module]
    return _registered[kind][name]


@cache
def places(kind: str) -> dict[str, str]:
    """Module of each of our own plug-ins of one kind by name, read without importing."""
    folder = PACKAGE / PACKAGES[kind].partition(".")[2].replace(".", "/")
    return {
        name: ".".join(("mpmbench", *file.relative_to(PACKAGE).with_suffix("").parts))
        for file in sorted(folder.rglob("*.py"))
        for name in _named(kind, file)
    }


def _named(kind: str, file: Path) -> list[str]:
    """Names of one kind that a file registers, read from its text."""
    mark = rf"""register\(\s*["']{kind}["'],\s*["'](\w+)["']"""
    return re.findall(mark, file.read_text(encoding="utf-8", errors="replace"))


def is_ours(file: Path) -> bool:
    """Whether a file is one of our own; the samples of plug-ins are none, although they come along."""
    return file.is_relative_to(PACKAGE) and not file.is_relative_to(PACKAGE / "samples")


def names(kind: str) -> list[str]:
    """All names of one kind, sorted."""
    load_plugins()
    return sorted({*places(kind), *_registered[kind]})


def while_plugins_stay(find: Callable[..., Found]) -> Callable[..., Found]:
    """Keep what a function has found as long as ``MPMBENCH_PLUGINS`` is the same."""
    kept = cache(lambda variable, *arguments: find(*arguments))
    return wraps(find)(lambda *arguments: kept(os.environ.get(VARIABLE, ""), *arguments))


@while_plugins_stay
def plugin_folders() -> list[Path]:
    """Folders of ``MPMBENCH_PLUGINS`` and of the entry points ``mpmbench.plugins``, each once."""
    named = os.environ.get(VARIABLE, "").split(os.pathsep)
    folders = [Path(part).resolve() for part in named if part]
    for entry in entry_points(group="mpmbench.plugins"):
        spec = importlib.util.find_spec(entry.value)
        places = spec.submodule_search_locations if spec is not None else None
        folders.extend(Path(place).resolve() for place in places or [])
    return list(dict.fromkeys(folders))


def plugin_files() -> list[Path]:
    """The Python files of all plug-in folders, in a fixed order."""
    return [
        file
        for folder in plugin_folders()
        for file in sorted(folder.glob("*.py"))
        if file.stem != "__init__"
    ]


def plugin_modules() -> dict[str, Path]:
    """Every plug-in file by its name as a module; a second of that name gets a mark."""
    modules: dict[str, Path] = {}
    for file in plugin_files():
        name = PREFIX + re.sub(r"\W", "_", file.stem)
        while name in modules:
            name += "_"
        modules[name] = file
    return modules


def plugins_of(kind: str, name: str) -> list[Path]:
    """The plug-in files that ``<kind>=<name>`` may come from: those that name it, else all."""
    return [file for file in plugin_files() if name in _named(kind, file)] or plugin_files()


def load_plugins() -> None:
    """Import every plug-in file; each registers what it brings."""
    _import(plugin_modules())


def load_file(file: Path) -> str:
    """Import one plug-in file from any folder, and return its name as a module.

    Raises `BrokenPlugin` when it cannot be imported.
    """
    file = file.resolve()
    known = {place: name for name, place in plugin_modules().items()}
    name = known.get(file, PREFIX + re.sub(r"\W", "_", file.stem))
    forget_other(name, file)
    if name not in sys.modules:
        spec = importlib.util.spec_from_loader(name, PluginLoader(name, str(file)))
        assert spec is not None and spec.loader is not None
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    if name in _broken:
        raise BrokenPlugin(f"the plug-in {file.name} cannot be imported") from _broken[name]
    return name


def _import(modules: Iterable[str]) -> None:
    files = plugin_modules()
    for module in modules:
        if module in files:
            forget_other(module, files[module])
        importlib.import_module(module)


def forget_other(module: str, file: Path) -> None:
    """Forget a module of this name that is not of this file.

    An empty one stands there when the cache of kernels asked before the file's folder was known.
    """
    there = sys.modules.get(module)
    if there is not None and there.__file__ != str(file):
        del sys.modules[module]
        _broken.pop(module, None)
        _unregister(module)


def _unregister(module: str) -> None:
    for known in _registered.values():
        for name in [n for n, one in known.items() if one.__module__ == module]:
            del known[name]


class PluginModules(MetaPathFinder):
    """Finds plug-in files as modules.

    Whatever has been compiled for a plug-in's classes stays in the cache of kernels under the name
    of its module, and a look into the cache imports that. A file that is broken or gone, or has no
    such class any more, gives an empty one: it concerns only the runs that use it.
    """

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if not name.startswith(PREFIX):
            return None
        file = str(plugin_modules().get(name, f"{name}.py"))
        return importlib.util.spec_from_file_location(name, file, loader=PluginLoader(name, file))


class PluginLoader(SourceFileLoader):
    """Runs a plug-in file, and keeps what it raises for those who ask for the plug-in."""

    def path_stats(self, path: str) -> Any:
        """Keep no bytecode, which would count for a file that is edited within the same second."""
        raise OSError

    def exec_module(self, module: ModuleType) -> None:
        keep_old_places()
        try:
            super().exec_module(module)
        except (Exception, SystemExit) as error:
            _broken[module.__name__] = error
            _unregister(module.__name__)
        vars(module).setdefault("__getattr__", partial(_stand_in, module))


def _stand_in(module: ModuleType, name: str) -> type:
    """An empty class in the place of one that the cache of kernels names."""
    if name.startswith("__"):
        raise AttributeError(name)
    setattr(module, name, type(name, (), {"__module__": module.__name__}))
    return getattr(module, name)  # type: ignore[no-any-return]


sys.meta_path.insert(0, PluginModules())
