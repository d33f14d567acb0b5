"""Runs of one problem sorted into curves: the key they sweep, and what tells curves apart."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from mpmbench.analysis.convergence import estimate_order
from mpmbench.analysis.estimate import OrderEstimate
from mpmbench.report.style import BASIS_MARKERS, METHOD_COLOURS
from mpmbench.results.differences import Difference, differences
from mpmbench.results.quantities import ZERO_FIELD
from mpmbench.results.records import Campaign

PREFERRED_AXES = ("resolution", "time_step", "particles_per_cell")
UNITS = {
    "time_step": "s",
    "end_time": "s",
    "velocity_amplitude": "m/s",
    "displacement_amplitude": "m",
    "young_modulus": "Pa",
    "density": "kg/m³",
}
MOST_IN_NAMES = (
    4  # differences of curves; where there are more, the sentence above the figures tells them
)
KNOWN = (METHOD_COLOURS, BASIS_MARKERS)
METHOD_NAMES = {
    "mpm": "MPM",
    "otm": "OTM",
    "implicit_mpm": "implicit MPM",
    "gmm": "GMM",
    "efg": "EFG",
    "fem": "FEM",
    "linear_fem": "linear FEM",
    "sph": "SPH",
    "tlmpm": "TLMPM",
    "ulmpm": "ULMPM",
    "moving_mesh_mpm": "moving-mesh MPM",
}
BASIS_NAMES = {
    "bspline": "B-spline",
    "maxent": "max-ent",
    "lme": "LME",
    "mls": "MLS",
    "rkpm": "RKPM",
}


@dataclass(frozen=True)
class Axis:
    """The key along which runs are swept.

    Attributes
    ----------
    key : str
        ``resolution``, ``time_step`` or any other numeric key.
    label, unit : str
        For the axis of a figure, and for a verdict ("over 8..32 cells").
    power : int or None
        The size that goes to zero is ``value**power``; None when an order makes no sense along this
        key.
    """

    key: str
    label: str
    unit: str
    power: int | None

    def finest(self, values: Iterable[float]) -> float:
        """The smallest value where the size is the value itself, as of a time step; else the largest."""
        return min(values) if self.power == 1 else max(values)


@dataclass(frozen=True, eq=False)
class Series:
    """One curve: one method, basis and variant; its runs sorted from coarse to fine.

    Attributes
    ----------
    method, basis : str
        Registered names.
    variant : tuple of (key, value)
        Further keys that tell this curve from others.
    rank : int
        Number of the variant among all of the study: the same line style for the same variant
        everywhere.
    label : str
        How a legend calls it.
    runs : DataFrame
        Rows of `Campaign.runs`, any status, with the column ``axis_value``.
    choices : tuple of str
        What else differs between the curves of its study, unless that is much: ``lumped mass``.
    """

    method: str
    basis: str
    variant: tuple[tuple[str, Any], ...]
    rank: int
    label: str
    runs: pd.DataFrame
    choices: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The label with the choices, for a legend or a table."""
        return f"{self.label} ({', '.join(self.choices)})" if self.choices else self.label

    @property
    def ok(self) -> pd.DataFrame:
        """The finished runs: the only ones that enter curves, fits and timings."""
        return self.runs[self.runs.status == "ok"]

    def finite(self, *quantities: str) -> pd.DataFrame:
        """Finished runs in which all these quantities are positive numbers."""
        runs = self.ok
        for name in quantities:
            values = runs[name] if name in runs else pd.Series(np.nan, runs.index)
            runs = runs[np.isfinite(values) & (values > 0)]
        return runs


@dataclass(frozen=True)
class Study:
    """All runs of one problem along one axis."""

    problem: str
    campaign: Campaign
    runs: pd.DataFrame
    axis: Axis
    series: list[Series]
    differences: list[Difference] = field(default_factory=list)

    @property
    def longest(self) -> int:
        """Most values along the axis that one curve has."""
        return max(one.runs.axis_value.nunique() for one in self.series)

    def varying(self) -> list[str]:
        """Further keys that have several values with one method and basis, those of the material last."""
        settings = self.campaign.settings.loc[self.runs.index]
        usual = ("resolution", "time_step")
        return [key for key in _varying_keys(self.runs, settings) if key not in usual]

    def values(self) -> list[float]:
        """All values along the axis, coarse to fine."""
        values = sorted(
            {float(v) for one in self.series for v in one.runs.axis_value if np.isfinite(v)}
        )
        return values[::-1] if self.axis.power == 1 else values


def studies(campaign: Campaign) -> list[Study]:
    """One study for each problem, along its main axis."""
    return [found[0] for found in _by_problem(campaign)]


def further_studies(campaign: Campaign) -> list[Study]:
    """Studies along the other numeric keys that some curve sweeps with at least three values."""
    return [study for found in _by_problem(campaign) for study in found[1:]]


def _by_problem(campaign: Campaign) -> Iterator[list[Study]]:
    """The studies of each problem, the one along its main axis first."""
    for problem in sorted(set(campaign.runs.problem)) if len(campaign.runs) else ():
        runs = campaign.runs[campaign.runs.problem == problem]
        settings = campaign.settings.loc[runs.index].copy()
        for key in PREFERRED_AXES:  # what was used, not what was asked for (`auto`)
            if key in settings and runs[key].notna().all():
                settings[key] = runs[key]
        varying = _varying_keys(runs, settings)
        numeric = [key for key in varying if _is_numeric(settings[key])]
        others = [key for key in numeric if key not in PREFERRED_AXES]
        candidates = [key for key in PREFERRED_AXES if key in numeric]
        candidates += sorted(others, key=lambda key: (-settings[key].nunique(), key))
        if not candidates:
            settings["resolution"] = runs.resolution
            candidates = ["resolution"]
        main, *more = (
            _study(campaign, problem, runs, settings, varying, key) for key in candidates
        )
        yield [main, *(study for study in more if study.longest >= 3)]


def _is_numeric(column: pd.Series) -> bool:
    """Whether a setting is a number in some run, and a switch in none."""
    some = pd.to_numeric(column, errors="coerce").notna().any()
    return bool(some) and not any(isinstance(value, bool) for value in column)


def _varying_keys(runs: pd.DataFrame, settings: pd.DataFrame) -> list[str]:
    """Keys with more than one value among the runs of some method and basis."""
    pairs = runs.method + "\n" + runs.basis
    keys = [
        str(key) for key in settings if settings[key].map(repr).groupby(pairs).nunique().max() > 1
    ]
    return sorted(keys, key=lambda key: (key.split(".")[0] == "material", key))


def _study(
    campaign: Campaign,
    problem: str,
    runs: pd.DataFrame,
    settings: pd.DataFrame,
    varying: list[str],
    along: str,
) -> Study:
    """Split the runs into curves along one key.

    A key names a curve only where it tells runs apart that agree in everything before: a time step
    that goes with the resolution, or the parameters that go with a material, do not split curves.
    """
    runs = runs.assign(axis_value=pd.to_numeric(settings[along], errors="coerce"))
    parts = runs[["method", "basis"]].assign(axis=runs.axis_value.map(repr))
    kept: list[str] = []
    others = [key for key in varying if key != along]
    for key in sorted(others, key=lambda key: key in PREFERRED_AXES):
        finer = parts.assign(**{key: settings[key].map(repr)})
        if len(finer.drop_duplicates()) > len(parts.drop_duplicates()):
            parts, kept = finer, [*kept, key]

    curves: list[tuple[str, str, tuple[tuple[str, Any], ...], list[str]]] = []
    for method, basis in sorted(set(zip(runs.method, runs.basis, strict=True)), key=_house_order):
        pair = runs[(runs.method == method) & (runs.basis == basis)]
        local = [key for key in kept if settings.loc[pair.index, key].map(repr).nunique() > 1]
        variants: dict[tuple[tuple[str, Any], ...], list[str]] = {}
        for file in pair.index:
            variant = tuple((key, settings.at[file, key]) for key in local)
            variants.setdefault(variant, []).append(str(file))
        curves += [(method, basis, one, variants[one]) for one in sorted(variants, key=_sortable)]

    names = dict.fromkeys(variant_name(curve[2]) for curve in curves if curve[2])
    ranks = {name: k for k, name in enumerate(names)}
    axis = _axis(along)
    series = []
    for method, basis, variant, files in curves:
        members = runs.loc[files].sort_values(
            "axis_value", ascending=axis.power != 1, kind="stable"
        )
        name = variant_name(variant)
        label = ", ".join(filter(None, [series_name(method, basis), name]))
        series.append(Series(method, basis, variant, ranks.get(name, 0), label, members))
    chosen = settings.astype(object).where(settings.notna(), None).to_dict("index")
    differing = differences(
        (run.method, run.basis, chosen[file]) for file, run in runs[["method", "basis"]].iterrows()
    )
    differing = [one for one in differing if one.key != along]
    told = [one.key for one in differing] if len(differing) <= MOST_IN_NAMES else []
    named = [*told, *kept]
    series = [replace(one, choices=_choices(one, settings, named)) for one in series]
    return Study(problem, campaign, runs, axis, series, differing)


def _choices(one: Series, settings: pd.DataFrame, named: list[str]) -> tuple[str, ...]:
    """Values of the keys that tell curves apart, where its label does not have them."""
    own = settings.loc[one.runs.index, [key for key in named if key not in dict(one.variant)]]
    values = {key: own[key].dropna() for key in own}
    single = {key: some.iloc[0] for key, some in values.items() if some.map(repr).nunique() == 1}
    return tuple(choice_name(key, value) for key, value in single.items())


def _sortable(variant: tuple[tuple[str, Any], ...]) -> tuple[Any, ...]:
    return tuple(
        (not isinstance(v, (int, float)), v if isinstance(v, (int, float)) else 0.0, str(v))
        for _, v in variant
    )


def _house_order(pair: tuple[str, str]) -> tuple[Any, ...]:
    """MPM and linear first, then the others of the house, then plug-ins by name."""
    places = [
        list(known).index(name) if name in known else len(known)
        for name, known in zip(pair, KNOWN, strict=True)
    ]
    return (*places, *pair)


def _axis(key: str) -> Axis:
    if key == "resolution":
        return Axis(key, "cells along the reference length", "cells", -1)
    name = key.split(".")[-1].replace("_", " ")
    unit = UNITS.get(key.split(".")[-1], "")
    label = f"{name} [{unit}]" if unit else name
    return Axis(key, label, unit or name, 1 if key == "time_step" else None)


def series_name(method: str, basis: str) -> str:
    """``OTM, max-ent`` for ``otm`` and ``maxent``; a plug-in's own name otherwise."""
    return f"{METHOD_NAMES.get(method, method.replace('_', ' '))}, {BASIS_NAMES.get(basis, basis.replace('_', ' '))}"


def variant_name(variant: tuple[tuple[str, Any], ...]) -> str:
    """All settings of a variant, as a legend calls them."""
    return ", ".join(setting_name(key, value) for key, value in variant)


def choice_name(key: str, value: Any) -> str:
    """``lumped mass`` of a word, ``degree 3`` of a number."""
    if isinstance(value, str):
        return f"{value} {key.split('.')[-1]}".replace("_", " ")
    return setting_name(key, value)


def setting_name(key: str, value: Any) -> str:
    """``degree 3``, ``time step 1e-05 s``, ``mass consistent``."""
    last, text = key.split(".")[-1], setting_text(value)
    unit = f" {UNITS[last]}" if last in UNITS and text != "default" else ""
    return f"{last.replace('_', ' ')} {text}{unit}"


def setting_text(value: Any) -> str:
    """The value of a setting as it is shown."""
    if value is None or (isinstance(value, float) and np.isnan(value)):
        return "default"
    if isinstance(value, bool):
        return "on" if value else "off"
    return f"{value:g}" if isinstance(value, (int, float)) else str(value).replace("_", " ")


def setting_label(key: str) -> str:
    """``end time [s]`` of a key, as the head of a column."""
    last = key.split(".")[-1]
    words = last.replace("_", " ")
    return f"{words} [{UNITS[last]}]" if last in UNITS else words


def floor_of(series: Series) -> float | None:
    """The predicted temporal floor when all finished runs agree on one."""
    if "predicted_temporal_floor" not in series.ok:
        return None
    values = series.ok.predicted_temporal_floor.dropna()
    agree = len(values) and np.allclose(values, values.iloc[0], rtol=1e-6, atol=0.0)
    return float(values.iloc[0]) if agree else None


def orders_of(study: Study, quantity: str) -> dict[str, OrderEstimate]:
    """The order of each curve that has one, by its label."""
    some = {one.label: one for one in study.series if len(one.finite(quantity))}
    found = {label: order_of(study, one, quantity) for label, one in some.items()}
    return {label: order for label, order in found.items() if order is not None}


def order_of(study: Study, series: Series, quantity: str) -> OrderEstimate | None:
    """The order of one curve; None along a key that has no order. Failed runs never enter."""
    if study.axis.power is None:
        return None
    errors = series.finite(quantity).groupby("axis_value")[quantity].median()
    values = errors.index.to_numpy(float)
    limited = quantity == "error_displacement_rms" and study.axis.power == -1
    return estimate_order(
        values**study.axis.power,
        errors.to_numpy(float),
        labels=[f"{value:g}" for value in values],
        label_unit=study.axis.unit,
        error_unit=study.campaign.units.get(quantity, ""),
        predicted_floor=floor_of(series) if limited else None,
        scale=field_scale(study.campaign, series.finite(quantity), quantity),
    )


def field_scale(campaign: Campaign, runs: pd.DataFrame, quantity: str) -> float | None:
    """Size of the field that an error belongs to, as far as its result files tell.

    It is the error over the relative error, and where the exact stress is zero the largest modulus
    of the material: a strain of one.
    """
    relative = runs.get(f"{quantity.removesuffix('_rms')}_relative")
    if relative is not None and (some := (relative > 0) & (relative < ZERO_FIELD)).any():
        return float((runs[quantity] / relative)[some].median())
    if quantity.startswith("error_stress"):
        settings = campaign.settings.loc[runs.index]
        moduli = [key for key in settings if key.endswith("_modulus")]
        largest = pd.to_numeric(settings[moduli].stack(), errors="coerce").max()
        return float(largest) if np.isfinite(largest) else None
    return None
