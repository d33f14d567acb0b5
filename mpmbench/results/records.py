"""What a folder of result files holds, as tables: one row per file, read without running anything."""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mpmbench.results.bookkeeping import with_later
from mpmbench.results.layout import KINDS
from mpmbench.results.netcdf import (
    Damaged,
    History,
    Scalar,
    read_arrays,
    read_histories,
    read_scalars,
)
from mpmbench.results.timings import load_of
from mpmbench.settings.trees import dotted

ATTRIBUTES = (
    "status",
    "problem",
    "method",
    "basis",
    "material",
    "mass",
    "timing_context",
    "reason",
    "config_hash",
    "digest",
)
NUMBERS = ("resolution", "time_step", "particles_per_cell")
PROVENANCE = (
    *("git_commit", "git_dirty", "code_hash"),
    *("python", "host", "cpu", "threads"),
)
# Keys that say where, when and how patiently something ran, not what was computed.
BOOKKEEPING = {
    *("output_dir", "campaign", "on_error", "rerun", "timing", "repeats", "report"),
    *("experiments", "cases", "seed", "snapshot_times"),
    *(f"{kind}{name}" for kind in KINDS for name in ("", ".name", "._name_")),
}


@dataclass(frozen=True)
class Campaign:
    """The result files of one folder, as far as they are as they were written.

    Attributes
    ----------
    folder : Path
    runs : DataFrame
        One row per readable file, index its name: the attributes of `ATTRIBUTES` and `NUMBERS`, all
        scalars, and as ``load`` how many processors were busy with other work.
    settings : DataFrame
        The configuration of each run, keys joined by dots (``method.mass``), bookkeeping left out;
        same index.
    units, names : dict
        Units and long names of the scalars.
    provenance : DataFrame
        Versions, commit and machine of each run; same index.
    unreadable : dict
        Reason by name of each file that is damaged or no result file.
    """

    folder: Path
    runs: pd.DataFrame
    settings: pd.DataFrame
    units: dict[str, str]
    names: dict[str, str]
    provenance: pd.DataFrame
    unreadable: dict[str, str]

    def only(self, files: Any) -> "Campaign":
        """The same with some of the runs: those of a column of files, or of a mask."""
        return self.each(lambda table: table.loc[files])

    def each(self, change: Callable[[pd.DataFrame], pd.DataFrame]) -> "Campaign":
        """The same with its tables of runs changed alike."""
        names = ("runs", "settings", "provenance")
        return replace(self, **{key: change(getattr(self, key)) for key in names})

    def variables(self, file: str, wanted: Iterable[str]) -> dict[str, np.ndarray]:
        """Those of the wanted variables that the file has, loaded; snapshots keep their first axis."""
        return read_arrays(self.folder / file, wanted)

    def histories(self, file: str) -> dict[str, History]:
        """The series over time of a file, ``time`` among them."""
        return read_histories(self.folder / file)

    @property
    def unverified(self) -> list[str]:
        """Files of an older version, which have no digest that would tell whether they were changed."""
        return [str(file) for file in self.runs.index if not self.runs.loc[file, "digest"]]


def read_campaign(folder: Path) -> Campaign:
    """Read all result files of a folder.

    Raises
    ------
    FileNotFoundError
        When there is no such folder or no result file in it; the message says where there are some.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise FileNotFoundError(f"{folder} is not a folder with result files")
    files = sorted(file for file in folder.glob("*.nc") if not file.name.startswith("."))
    if not files:
        nearby = sorted({file.parent.name for file in folder.glob("*/*.nc")})
        hint = f"; there are some in {', '.join(nearby)}" if nearby else ""
        raise FileNotFoundError(f"{folder} has no result files (*.nc){hint}")

    rows, settings, provenance = {}, {}, {}
    units: dict[str, str] = {}
    names: dict[str, str] = {}
    unreadable: dict[str, str] = {}
    for file in files:
        try:
            attributes, scalars = read_scalars(file)
        except Damaged as damaged:
            unreadable[file.name] = damaged.reason
            continue
        rows[file.name] = _row(attributes, scalars)
        settings[file.name] = _settings(attributes)
        provenance[file.name] = {
            key: value
            for key, value in attributes.items()
            if key in PROVENANCE or key.endswith("version")
        }
        for name, (_, said) in scalars.items():
            units.setdefault(name, said.get("units", ""))
            names.setdefault(name, said.get("long_name", name.replace("_", " ")))
    configurations, origins = _table(settings, object), _table(provenance, object)
    return Campaign(folder, _table(rows), configurations, units, names, origins, unreadable)


def _table(rows: dict[str, dict[str, Any]], dtype: Any = None) -> pd.DataFrame:
    columns = list(dict.fromkeys(key for row in rows.values() for key in row))
    return pd.DataFrame.from_dict(rows, orient="index", columns=columns, dtype=dtype)


def _row(attributes: dict[str, Any], scalars: dict[str, Scalar]) -> dict[str, Any]:
    """Attributes and scalars of one file."""
    row: dict[str, Any] = {key: str(attributes.get(key, "")) for key in ATTRIBUTES}
    row |= {key: _number(attributes.get(key)) for key in NUMBERS}
    row["load"] = load_of(attributes)
    return row | {name: value for name, (value, _) in scalars.items() if name not in row}


def _settings(attributes: dict[str, Any]) -> dict[str, Any]:
    """Its flattened configuration."""
    settings = {
        key: str(value) if isinstance(value, list) else value  # so that they can be compared
        for key, value in dotted(with_later(json.loads(attributes["config"]))).items()
        if key not in BOOKKEEPING and not key.startswith(("limits.", "hydra."))
    }
    return settings | {"material": str(attributes["material"])}


def _number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        return float("nan")
