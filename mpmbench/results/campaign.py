"""All results of a campaign as one labelled array per scalar: the cube."""

import json
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from mpmbench.results.bookkeeping import NOT_PART_OF_A_RUN, with_later
from mpmbench.results.netcdf import Damaged, read_scalars, unverified
from mpmbench.settings.schema import GROUPS
from mpmbench.settings.trees import dotted
from mpmbench.settings.words import in_yaml

# In this order, and whenever they vary; any other setting only where these do not tell two runs
# apart.
AXES = (
    *("problem", "method_name", "basis", "material"),
    *("resolution", "time_step", "particles_per_cell"),
)
INEXACT = (None, "nearest", "pad", "ffill", "backfill", "bfill")  # what xarray means by method=


class _Selecting:
    """Refuses ``sel(method="otm")``, which xarray would silently pass over."""

    __slots__ = ()

    def sel(self, indexers: Any = None, method: Any = None, *rest: Any, **labels: Any) -> Any:
        """As that of xarray; the dimension of the methods is ``method_name``."""
        refuse_method(method)
        return super().sel(indexers, method, *rest, **labels)  # type: ignore[misc]


class CubeArray(_Selecting, xr.DataArray):
    """A DataArray of a `Cube`."""

    __slots__ = ()


class Cube(_Selecting, xr.Dataset):
    """A Dataset whose methods are chosen by ``method_name``."""

    __slots__ = ()

    def __getitem__(self, key: Any) -> Any:
        found = super().__getitem__(key)
        return CubeArray(found) if isinstance(found, xr.DataArray) else found


def refuse_method(method: Any) -> None:
    """Raise `ValueError` for a method of ours where xarray expects a way to look up labels."""
    if isinstance(method, str | None) and method in INEXACT:
        return
    raise ValueError(
        f"sel(method={method!r}): the dimension of the methods is called method_name, because "
        f"method= tells xarray how to look up inexact labels; use sel(method_name={method!r})"
    )


def open_campaign(path: str | Path) -> Cube:
    """Scalars of every run in a folder of results, over the settings that vary.

    Parameters
    ----------
    path : str or Path
        A campaign's folder, for example ``results/quickstart``.

    Returns
    -------
    Cube
        An `xarray.Dataset` with dimensions ``method_name``, ``basis``, ``resolution``, ``time_step``,
        ... as far as they vary, and others by their full key (``"material.density"``); what is the
        same for all runs is an attribute. The scalars are variables with their units, not-a-number
        where there is no run or no value. ``status`` (``"missing"`` where there is no run),
        ``reason`` and ``file`` are variables too. A warning names each file that is damaged, and
        tells how many are of an older version that wrote no digest.

    Raises
    ------
    FileNotFoundError
        When the folder holds no results.

    Examples
    --------
    >>> cube = mpmbench.open_campaign("results/quickstart")       # doctest: +SKIP
    >>> cube.error_displacement_rms.sel(method_name="otm").plot()  # doctest: +SKIP
    """
    cube = cube_of(sorted(Path(path).glob("*.nc")))
    if not cube:
        raise FileNotFoundError(f"{path}: there are no results of mpmbench in this folder")
    return cube


def cube_of(files: Iterable[Path]) -> Cube:
    """The cube of some result files, see `open_campaign`; empty when none of them can be read."""
    runs = read_runs(files)
    if not runs:
        return Cube()
    settings = [
        {"method_name" if key == "method" else key: value for key, value in flat.items()}
        for flat in (flat_settings(attributes) for attributes, _, _ in runs)
    ]
    axes = find_axes(settings)
    coordinates = {axis: _sorted({setting.get(axis) for setting in settings}) for axis in axes}
    shape = tuple(map(len, coordinates.values()))
    text = {name: np.full(shape, "", dtype=object) for name in ("status", "reason", "file")}
    text["status"][...] = "missing"
    numbers: dict[str, np.ndarray] = {}
    labels: dict[str, dict[str, str]] = {}
    for setting, (attributes, scalars, file) in zip(settings, runs, strict=True):
        at = tuple(values.index(setting.get(axis)) for axis, values in coordinates.items())
        for name, words in text.items():
            words[at] = str(file) if name == "file" else attributes[name]
        for name, (value, label) in scalars.items():
            numbers.setdefault(name, np.full(shape, np.nan))[at] = value
            labels[name] = label
    cube = Cube(coords={axis: _coordinate(values) for axis, values in coordinates.items()})
    for name, values in numbers.items():
        cube[name] = (tuple(axes), values, labels[name])
    for name, words in text.items():
        cube[name] = (tuple(axes), words.astype(str))
    cube.attrs = {
        key: str(list(value)) if isinstance(value, tuple) else in_yaml(value)
        for key, value in settings[0].items()
        if key not in axes and _same(key, settings)
    }
    return cube


def read_runs(files: Iterable[Path]) -> list[tuple[dict[str, Any], dict[str, Any], Path]]:
    """Attributes, scalars and path of every result that is not damaged; warns about the others."""
    runs = []
    for file in files:
        try:
            runs.append((*read_scalars(file), file))
        except Damaged as damaged:
            warnings.warn(f"left out: {damaged}", stacklevel=4)
    told = unverified(file for attributes, _, file in runs if not attributes["digest"])
    if told:
        warnings.warn(told, stacklevel=4)
    return runs


def flat_settings(attributes: dict[str, Any]) -> dict[str, Any]:
    """Settings of a run by their dotted keys, those of a choice's name by the choice."""
    config = with_later(json.loads(attributes["config"]))
    relevant = {key: value for key, value in config.items() if key not in NOT_PART_OF_A_RUN}
    flat = {}
    for key, value in dotted(relevant).items():
        group = key.removesuffix(".name")
        name = group if group in GROUPS else key
        flat[name] = tuple(value) if isinstance(value, list) else value
    return flat


def find_axes(settings: list[dict[str, Any]]) -> list[str]:
    """Settings that vary and, together, tell any two runs apart."""
    keys = list(dict.fromkeys([*AXES, *(key for setting in settings for key in setting)]))
    varying = [key for key in keys if not _same(key, settings)]
    axes = [key for key in varying if key in AXES]
    for key in varying:
        groups: dict[tuple[Any, ...], Any] = {}
        told_apart = all(
            groups.setdefault(tuple(setting.get(axis) for axis in axes), setting.get(key))
            == setting.get(key)
            for setting in settings
        )
        if key not in axes and not told_apart:
            axes.append(key)
    return axes


def _same(key: str, settings: list[dict[str, Any]]) -> bool:
    return all(setting.get(key) == settings[0].get(key) for setting in settings)


def _sorted(values: set[Any]) -> list[Any]:
    """Numbers in order, then words and lists, then nothing."""

    def place(value: Any) -> tuple[Any, ...]:
        is_number = isinstance(value, (int, float))
        return value is None, not is_number, value if is_number else str(value)

    return sorted(values, key=place)


def _coordinate(values: list[Any]) -> list[Any]:
    """Numbers, not-a-number for runs that do not have this setting; or words when there is any, such as auto."""
    if any(isinstance(value, (str, tuple)) for value in values):
        return ["" if value is None else str(value) for value in values]
    return [np.nan if value is None else value for value in values]
