"""The files that settings are read from: YAML presets and experiments, ours and those of plug-ins."""

import os
import re
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from mpmbench.core.registry import PACKAGE, plugin_folders, while_plugins_stay
from mpmbench.say import one_line

TARGET = "_target_"

_current = [Path("/")]
_by_path: dict[str, Path] = {}  # experiments that a command line names by their files


class BadInput(Exception):
    """What the user gave cannot be run; the message is one sentence, the exit code 2 by default."""

    def __init__(self, sentence: str, exit_code: int = 2) -> None:
        super().__init__(one_line(sentence))
        self.exit_code = exit_code


class _Loader(yaml.CSafeLoader):
    """YAML as Hydra reads it: 1e-5 is a number, a date is a text, and no key comes twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        keys = [key.value for key, _ in node.value]
        for (key, _), number in zip(node.value, map(keys.count, keys), strict=True):
            if number > 1 and key.value != "<<":
                problem = f"the key {key.value} is there twice"
                raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
        return super().construct_mapping(node, deep)  # type: ignore[no-any-return]


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(
        r"^[-+]?(\d[\d_]*(\.[\d_]*)?([eE][-+]?\d+)?|\.\d[\d_]*([eE][-+]?\d+)?|\.(inf|Inf|nan|NaN))$"
    ),
    list("-+0123456789."),
)
_Loader.yaml_implicit_resolvers = {
    start: [(tag, pattern) for tag, pattern in known if not tag.endswith(":timestamp")]
    for start, known in _Loader.yaml_implicit_resolvers.items()
}


@cache
def read_yaml(path: Path) -> dict[str, Any]:
    """Content of a YAML file; raises `BadInput` with the line when it is none."""
    try:
        # CSafeLoader's own rules come first, so that whole numbers stay whole.
        content = yaml.load(path.read_text(encoding="utf-8"), _Loader)
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        mark = getattr(error, "problem_mark", None)
        place = f"{path}, line {mark.line + 1}" if mark else str(path)
        why = getattr(error, "problem", None) or error
        raise BadInput(f"{place}: not valid YAML: {why}") from None
    if content is not None and not isinstance(content, dict):
        raise BadInput(f"{path}: keys with values are needed, as in `resolution: 8`")
    refuse_targets(content, str(path))
    return content or {}


def refuse_targets(content: Any, place: str) -> None:
    """Raise `BadInput` when settings name code to be called, as Hydra's ``_target_`` does.

    Parameters
    ----------
    content : object
        What a YAML file, an override or the configuration of a result file holds.
    place : str
        Where it stands, for the sentence.
    """
    parts = [content] if isinstance(content, str) else []
    if isinstance(content, dict):
        parts = [*map(str, content), *content.values()]
    elif isinstance(content, (list, tuple)):
        parts = list(content)
    for part in parts:
        if not isinstance(part, str):
            refuse_targets(part, place)
        elif TARGET in part:
            raise BadInput(f"{place}: {TARGET} is refused: settings are values and call no code")


def parsed(text: str) -> Any:
    """A value as YAML has it; raises `BadInput` when it is none."""
    try:
        return yaml.load(text, _Loader)
    except yaml.YAMLError:
        raise BadInput(f"{text}: this value is not understood") from None


@cache
def is_global(path: Path) -> bool:
    """Whether a YAML file sets keys of the whole configuration, and not only those of its group."""
    return "@package _global_" in path.read_text(encoding="utf-8")[:500]


def shipped_folder(name: str) -> Path:
    """`conf` or `experiments`: inside the package in a wheel, beside it in a checkout."""
    inside = PACKAGE / name
    return inside if inside.is_dir() else PACKAGE.parent / name


def here() -> Path:
    """The current folder, or the last one that there was: it may be removed while something runs."""
    with suppress(FileNotFoundError):
        _current[0] = Path.cwd()
    return _current[0]


def joined(*paths: str) -> str:
    """Lists of folders, each written as in ``PATH``, as one list without repetitions."""
    folders = [folder for path in paths for folder in path.split(os.pathsep) if folder]
    return os.pathsep.join(dict.fromkeys(folders))


@while_plugins_stay
def conf_folders() -> list[Path]:
    """Our own folder of presets, then those of plug-ins."""
    theirs = [place / "conf" for place in plugin_folders()]
    return [shipped_folder("conf"), *(place for place in theirs if place.is_dir())]


def presets(group: str) -> dict[str, Path]:
    """Name and YAML file of the options of a group that have one."""
    return {
        file.stem: file
        for folder in reversed(conf_folders())
        for file in (folder / group).glob("*.yaml")
    }


def papers() -> dict[str, Path]:
    """Name and file of every paper that has a report, ours and those of plug-ins, sorted.

    The file is ``papers/<name>/__init__.py``, ``papers/<name>/paper.py`` or ``papers/<name>.py``,
    and it has a line that begins with ``PAPER =``. Raises `BadInput` when two files bring a paper
    of the same name.
    """
    found: dict[str, Path] = {}
    for folder in (PACKAGE, *plugin_folders()):
        for pattern in ("*/__init__.py", "*/paper.py", "*.py"):
            for file in sorted((folder / "papers").glob(pattern)):
                if not re.search(r"^PAPER\b.*=", file.read_text(encoding="utf-8"), re.MULTILINE):
                    continue
                name = file.stem if pattern == "*.py" else file.parent.name
                if name in found:
                    where = f"in {found[name]} and in {file}"
                    raise BadInput(f"the paper {name} is there twice: {where}")
                found[name] = file
    return dict(sorted(found.items()))


def experiment_folders() -> dict[Path, str]:
    """Every folder of experiments, and what the names of its experiments begin with.

    ``experiments`` beside `conf`, in it, and in the folders of plug-ins; a paper may hold its own
    in ``papers/<name>/experiments``, which are then called ``<name>/...``.
    """
    places = [shipped_folder("experiments").parent, *conf_folders(), *plugin_folders()]
    found = {place / "experiments": "" for place in places}
    found |= {
        file.parent / "experiments": f"{name}/"
        for name, file in papers().items()
        if file.parent.name == name
    }
    return {folder: prefix for folder, prefix in found.items() if folder.is_dir()}


def experiments() -> dict[str, Path]:
    """Name (with the folder, as in ``wobbes2020/fig6``) and file of every experiment, sorted."""
    found = {
        prefix + file.relative_to(folder).with_suffix("").as_posix(): file
        for folder, prefix in experiment_folders().items()
        for file in folder.rglob("*.yaml")
        if "plugins"
        not in file.relative_to(folder).parts  # options that an experiment brings along
    }
    return dict(sorted((_by_path | found).items()))


def experiment_of(path: str) -> str:
    """The name under which an experiment in a file of one's own is known from now on: that of the file.

    Raises `BadInput` when there is no such file, or another experiment of this name.
    """
    file = (here() / path).resolve()
    if not file.is_file():
        raise BadInput(f"experiments={path}: there is no such file")
    _by_path.pop(file.stem, None)
    if not re.fullmatch(r"[\w-]+", file.stem):
        raise BadInput(f"experiments={path}: a file named by letters, digits, _ and - is needed")
    if file.stem in experiments():
        there = f"there is an experiment {file.stem} already, in {experiments()[file.stem]}"
        raise BadInput(f"experiments={path}: {there}; rename the file")
    _by_path[file.stem] = file
    read_yaml.cache_clear()  # it may have been edited since
    return file.stem
