"""What a run is known by: hashes of its configuration and of its code, and its file."""

import hashlib
import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from mpmbench.core.registry import PACKAGES, places, plugin_files, plugins_of
from mpmbench.results import meanings
from mpmbench.results.bookkeeping import NOT_PART_OF_A_RUN, without_later
from mpmbench.settings.files import PACKAGE, here

SOLVER = ("core", "problems", "analysis", "case")
# What marks a file whose functions are compiled, and what it imports of the package.
COMPILES = re.compile(
    r"^@(compiled|kernel|lean|inlined|summing|implements|fallback|generated|intrinsic|overload|njit)\b"
    r"|^\w+ = (compiled|lean|inlined|summing|njit)\(",
    re.MULTILINE,
)
IMPORTS = re.compile(
    r"^(?:from|import) mpmbench\.([\w.]+)(?: import (\([^)]*\)|[^(\n]*))?", re.MULTILINE
)
LONGEST_NAME = 180  # bytes for the words in the name of a file, which may have 255 in all


def config_json(config: dict[str, Any]) -> str:
    """Canonical JSON text of a configuration."""
    return json.dumps(config, sort_keys=True, separators=(",", ":"))


def config_hash(config: dict[str, Any]) -> str:
    """Hash of the settings that a result depends on; it is the same as before keys came later."""
    config = without_later(config)
    relevant = {key: value for key, value in config.items() if key not in NOT_PART_OF_A_RUN}
    return hashlib.sha256(config_json(relevant).encode()).hexdigest()[:16]


def result_path(config: dict[str, Any]) -> Path:
    """Absolute path of the file that the run with this configuration leaves."""
    method, basis, problem = (config[group]["name"] for group in ("method", "basis", "problem"))
    words = f"{method}-{basis}-{problem}".encode()[:LONGEST_NAME].decode(errors="ignore")
    name = f"{words}-n{config['resolution']}-{config_hash(config)[:8]}.nc"
    return here() / config["output_dir"] / config["campaign"] / name


@cache
def solver_files() -> dict[str, Path]:
    """Every source file of the solver by its path in the package, in a fixed order."""
    files = [file for room in SOLVER for file in sorted((PACKAGE / room).rglob("*.py"))]
    return {str(file.relative_to(PACKAGE)): file for file in files}


def sources_hashes() -> tuple[str, str]:
    """Hashes of all sources that a kernel is compiled from, without and with those of plug-ins.

    Programs with the same one may share their kernels.

    These are the files that have compiled functions and all that they import, for a kernel keeps
    the values of what it names. A problem in plain Python or a time loop is none of them: after a
    change there nothing is compiled anew.
    """
    digest = hashlib.sha256()
    hashes = []
    for files in (kernel_files(), plugin_files()):
        for file in files:
            digest.update(str(file).encode() + b"\0" + file.read_bytes() + b"\0")
        hashes.append(digest.hexdigest()[:16])
    return hashes[0], hashes[1]


def kernel_files() -> list[Path]:
    """Every file of the solver with compiled functions, or that such a file imports, in a fixed order."""
    ours = solver_files()
    text = {name: file.read_text(encoding="utf-8") for name, file in ours.items()}
    waiting = [name for name in ours if COMPILES.search(text[name])]
    found: set[str] = set()
    while waiting:
        name = waiting.pop()
        found.add(name)
        imported = {
            f"{one.replace('.', '/')}{ending}"
            for module, names in IMPORTS.findall(text[name])
            for one in (module, *(f"{module}.{word}" for word in re.findall(r"\w+", names)))
            for ending in (".py", "/__init__.py")
        }
        waiting += [one for one in imported if one in ours and one not in found]
    return [ours[name] for name in sorted(found)]


def code_digests(config: dict[str, Any]) -> dict[str, str]:
    """Digest of each source file that a result depends on, by its path in the package.

    These are the driver of a case, the chosen plug-ins and all that they import of the package.
    """
    ours = solver_files()
    waiting = {name: ours[name] for name in ("case/build.py", "core/registry.py")}
    for kind, option in _chosen(config).items():
        chosen = places(kind).get(option)
        if chosen is not None:
            name = chosen.partition(".")[2].replace(".", "/") + ".py"
            waiting[name] = ours[name]
        else:
            waiting |= {file.name: file for file in plugins_of(kind, option)}
    found: dict[str, str] = {}
    while waiting:
        name, file = waiting.popitem()
        found[name], imported = meanings.meaning(file, file.stat().st_mtime_ns)
        waiting |= {one: ours[one] for one in imported if one in ours and one not in found}
    meanings.keep()
    return dict(sorted(found.items()))


def _chosen(config: dict[str, Any]) -> dict[str, Any]:
    """The names under which what a configuration chooses is registered."""
    names = {kind: config[kind]["name"] for kind in PACKAGES if kind in config}
    names["method"] = config["method"].get("time") or names["method"]
    return names | {"transfer": config["method"].get("transfer", "flip")}


def digests_of_many() -> Callable[[dict[str, Any]], dict[str, str]]:
    """A function as `code_digests` that looks for the files of the same choices only once."""
    known: dict[tuple[Any, ...], dict[str, str]] = {}

    def digests(config: dict[str, Any]) -> dict[str, str]:
        chosen = tuple(_chosen(config).items())
        if chosen not in known:
            known[chosen] = code_digests(config)
        return known[chosen]

    return digests


def code_hash(digests: dict[str, str]) -> str:
    """One hash of `code_digests`."""
    return hashlib.sha256(json.dumps(digests, sort_keys=True).encode()).hexdigest()[:16]


def changed_files(attributes: dict[str, Any], now: dict[str, str]) -> list[str]:
    """Source files that have other digests `now` than when a result was made."""
    before: dict[str, str] = json.loads(attributes["code_files"])
    return sorted(name for name in {*before, *now} if before.get(name) != now.get(name))
