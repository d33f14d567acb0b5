"""Where a result comes from: versions, machine, commit."""

import os
import platform
import subprocess
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from mpmbench import __version__
from mpmbench.results import identity
from mpmbench.results.version import SCHEMA_VERSION
from mpmbench.settings.files import PACKAGE

LIBRARIES = ("numpy", "scipy", "numba", "llvmlite", "xarray", "netCDF4", "hydra-core")


def attributes(config: dict[str, Any]) -> dict[str, Any]:
    """Attributes of the result file that are known before the run; plain text and numbers only."""
    digests = identity.code_digests(config)
    return {
        "Conventions": "CF-1.11",
        "schema_version": SCHEMA_VERSION,
        "title": f"mpmbench: {config['method']['name']} on {config['problem']['name']}",
        **{kind: config[kind]["name"] for kind in ("problem", "method", "basis", "material")},
        "mass": config["method"].get("mass", ""),
        **{
            key: config[key] for key in ("resolution", "time_step", "particles_per_cell", "threads")
        },
        "timing_context": "shared",
        "config": identity.config_json(config),
        "config_hash": identity.config_hash(config),
        "code_hash": identity.code_hash(digests),
        "code_files": identity.config_json(digests),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        **machine(),
    }


@cache
def machine() -> dict[str, Any]:
    """What stays the same for all runs of this process."""
    commit, dirty = git()
    return {
        "mpmbench_version": __version__,
        "git_commit": commit,
        "git_dirty": dirty,
        "python": platform.python_version(),
        "host": platform.node(),
        "cpu": processor(),
        "cpu_count": os.cpu_count() or 1,
        "operating_system": platform.platform(),
    }


@cache
def library_versions() -> dict[str, str]:
    """Version of every library that takes part, as ``<name>_version``."""
    versions = {}
    for library in LIBRARIES:
        try:
            versions[f"{library.replace('-', '_')}_version"] = version(library)
        except PackageNotFoundError:
            continue
    return versions


def git() -> tuple[str, str]:
    """Commit of the checkout, and whether its solver was edited: yes, no or unknown."""
    if not (PACKAGE.parent / ".git").exists():
        return kept_commit()
    try:
        commit = _git("rev-parse", "HEAD")
        changes = _git("status", "--porcelain", "--untracked-files=no", "--", "mpmbench", "conf")
    except (OSError, subprocess.SubprocessError):
        return "unknown", "unknown"
    return commit, "yes" if changes else "no"


def kept_commit() -> tuple[str, str]:
    """What building the package has written down of its checkout (`hatch_build.py`)."""
    try:
        commit, edited = (PACKAGE / "commit.txt").read_text(encoding="utf-8").split()
    except (OSError, ValueError):
        return "unknown", "unknown"
    return commit, edited


def _git(*arguments: str) -> str:
    command = ["git", "-C", str(PACKAGE.parent), *arguments]
    return subprocess.run(
        command, capture_output=True, text=True, check=True, timeout=10
    ).stdout.strip()


def processor() -> str:
    """Name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
