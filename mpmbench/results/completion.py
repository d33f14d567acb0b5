"""The mark of a complete experiment: what its results depend on, and which files they are."""

import json
from pathlib import Path
from typing import Any

NAME = ".complete.json"


def read(folder: Path) -> dict[str, Any]:
    """The stamp in a folder of results; empty when there is none."""
    try:
        content = json.loads((folder / NAME).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def write(folder: Path, inputs: str, names: set[str]) -> None:
    """Mark the experiment in a folder as complete: a digest of all `inputs`, and its result files.

    Other files in the folder are of an earlier version of the experiment.
    """
    files = {name: size_and_time(folder / name) for name in sorted(names)}
    content = {"inputs": inputs, "files": files}
    (folder / NAME).write_text(json.dumps(content, indent=0) + "\n", encoding="utf-8")


def is_valid(folder: Path, inputs: str) -> bool:
    """Whether nothing has changed since: neither what the results depend on, nor the files."""
    content = read(folder)
    files = content.get("files", {})
    return content.get("inputs") == inputs and all(
        (folder / name).exists() and size_and_time(folder / name) == mark
        for name, mark in files.items()
    )


def size_and_time(file: Path) -> list[int]:
    """Size [bytes] and time of the last change [ns] of a file."""
    stat = file.stat()
    return [stat.st_size, stat.st_mtime_ns]
