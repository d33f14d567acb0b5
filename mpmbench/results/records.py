"""What a folder of result files holds, as tables: one row per file, read without running anything."""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from mpmbench.results.bookkeeping import with_later
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
)
NUMBERS = ("resolution", "time_step", "particles_per_cell")
KINDS = ("method", "basis", "material", "problem")
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
    """The result files of one folder.

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
        Reason by name of each file that is no result file.
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
        with open_result(self.folder / file) as dataset:
            return {name: dataset[name].values for name in wanted if name in dataset}


def open_result(file: Path) -> xr.Dataset:
    """One result file, opened lazily; values stay as they are stored (times in seconds)."""
    return xr.open_dataset(file, engine="netcdf4", decode_cf=False, cache=False)


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
            with open_result(file) as dataset:
                row, config = _row(dataset, units, names)
                origin = {
                    key: value
                    for key, value in dataset.attrs.items()
                    if key in PROVENANCE or key.endswith("version")
                }
        except (OSError, ValueError, KeyError, RuntimeError) as error:
            unreadable[file.name] = (str(error) or type(error).__name__).splitlines()[0]
            continue
        rows[file.name], settings[file.name], provenance[file.name] = row, config, origin
    configurations, origins = _table(settings, object), _table(provenance, object)
    return Campaign(folder, _table(rows), configurations, units, names, origins, unreadable)


def _table(rows: dict[str, dict[str, Any]], dtype: Any = None) -> pd.DataFrame:
    columns = list(dict.fromkeys(key for row in rows.values() for key in row))
    return pd.DataFrame.from_dict(rows, orient="index", columns=columns, dtype=dtype)


def _row(
    dataset: xr.Dataset, units: dict[str, str], names: dict[str, str]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Attributes and scalars of one file, and its flattened configuration."""
    attributes = dataset.attrs
    if "status" not in attributes:
        raise ValueError("no attribute 'status': not a result file of mpmbench")
    row: dict[str, Any] = {key: str(attributes.get(key, "")) for key in ATTRIBUTES}
    row |= {key: _number(attributes.get(key)) for key in NUMBERS}
    row["load"] = load_of(attributes)
    for name, variable in dataset.data_vars.items():
        if variable.ndim == 0 and np.issubdtype(variable.dtype, np.number):
            row[str(name)] = float(variable.values)
            units.setdefault(str(name), str(variable.attrs.get("units", "")))
            said = variable.attrs.get("long_name", str(name).replace("_", " "))
            names.setdefault(str(name), str(said))
    config = with_later(json.loads(attributes.get("config", "{}")))
    settings = {
        key: str(value) if isinstance(value, list) else value  # so that they can be compared
        for key, value in dotted(config).items()
        if key not in BOOKKEEPING and not key.startswith(("limits.", "hydra."))
    }
    return row, settings | {"material": row["material"]}


def _number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        return float("nan")
