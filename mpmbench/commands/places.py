"""Files and folders that a command is given; what is wrong with one of them is one sentence."""

from pathlib import Path
from typing import Any

from mpmbench.results.netcdf import Damaged, read_attributes
from mpmbench.settings.schema import BadInput


def results_in(command: str, folder: Path) -> list[Path]:
    """The result files of a folder, sorted; raises `BadInput` when there are none."""
    if not folder.is_dir():
        raise BadInput(f"{command} {folder}: there is no such folder")
    files = sorted(folder.glob("*.nc"))
    if not files:
        raise BadInput(f"{command} {folder}: there are no result files in it")
    return files


def attributes_of(command: str, file: Path) -> dict[str, Any]:
    """Attributes of a result file; raises `BadInput` when it is none, or damaged."""
    try:
        return read_attributes(file)
    except Damaged as damaged:
        raise BadInput(f"{command} {damaged}") from None


def result_files(command: str, source: Path) -> list[Path]:
    """One result file, or all of a folder; raises `BadInput` when there are none."""
    if source.is_dir():
        return results_in(command, source)
    if not source.exists():
        raise BadInput(f"{command} {source}: there is no such file or folder")
    return [source]
