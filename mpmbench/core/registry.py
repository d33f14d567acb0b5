"""Plug-ins by name: a file ``bases/<name>.py`` that registers ``<name>`` is all that a new option needs.

Nothing is imported before it is asked for, so that a run compiles and loads only what it uses.
"""

import importlib
import importlib.util
import os
import re
import sys
from collections.abc import Callable
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, TypeVar

from mpmbench.core.moved import keep_old_places

PACKAGE = Path(__file__).parents[1]
PACKAGES = {
    "basis": "mpmbench.core.bases",
    "material": "mpmbench.core.materials",
    "method": "mpmbench.core.loops",
    "problem": "mpmbench.problems",
}
_registered: dict[str, dict[str, Any]] = {kind: {} for kind in PACKAGES}
_plugins_loaded = False
Plugin = TypeVar("Plugin")


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
    KeyError
        When no file and no plug-in registers this name.
    """
    if name not in _registered[kind] and name in places(kind):
        importlib.import_module(places(kind)[name])
    if name not in _registered[kind]:
        load_plugins()
    return _registered[kind][name]


@cache
def places(kind: str) -> dict[str, str]:
    """Module of each of our own plug-ins of one kind, by name; read from the text, without importing."""
    folder = PACKAGE / PACKAGES[kind].partition(".")[2].replace(".", "/")
    mark = re.compile(rf'register\("{kind}", "(\w+)"\)')
    return {
        name: ".".join(("mpmbench", *file.relative_to(PACKAGE).with_suffix("").parts))
        for file in sorted(folder.rglob("*.py"))
        for name in mark.findall(file.read_text(encoding="utf-8"))
    }


def names(kind: str) -> list[str]:
    """All names of one kind, sorted."""
    load_plugins()
    return sorted({*places(kind), *_registered[kind]})


def plugin_folders() -> list[Path]:
    """Folders of ``MPMBENCH_PLUGINS`` (separated as in PATH) and of the entry points ``mpmbench.plugins``."""
    folders = [
        Path(part).resolve()
        for part in os.environ.get("MPMBENCH_PLUGINS", "").split(os.pathsep)
        if part
    ]
    for entry in entry_points(group="mpmbench.plugins"):
        spec = importlib.util.find_spec(entry.value)
        places = spec.submodule_search_locations if spec is not None else None
        folders.extend(Path(place).resolve() for place in places or [])
    return folders


def plugin_files() -> list[Path]:
    """The Python files of all plug-in folders, in a fixed order."""
    return [
        file
        for folder in plugin_folders()
        for file in sorted(folder.glob("*.py"))
        if file.stem != "__init__"
    ]


def load_plugins() -> None:
    """Import every plug-in file once; each registers what it brings."""
    global _plugins_loaded
    if _plugins_loaded:
        return
    _plugins_loaded = True
    for file in plugin_files():
        load_file(file)


def load_file(file: Path) -> None:
    """Import one plug-in file under its own name."""
    name = f"mpmbench_plugin_{file.stem}"
    if name in sys.modules:
        return
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"{file} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    keep_old_places()
    spec.loader.exec_module(module)
