"""Fields at the end of a run: stress along a line of particles, and maps of particles."""

import dataclasses
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from mpmbench.report import style
from mpmbench.report.fields import robust
from mpmbench.report.figures import name_axes, tiles, wrapped
from mpmbench.report.levels import finest_runs
from mpmbench.report.series import Series, Study

TITLE_WIDTH = 26  # characters
VECTOR_POINTS = 1500  # more points than this are drawn as an image inside the figure
# Scalars of particles that maps can show, by their names in results.
SCALARS = {
    "plastic_strain": "equivalent plastic strain",
    "von_mises": "von Mises stress [Pa]",
    "pressure": "pressure [Pa]",
    "temperature": "temperature [K]",
}
MAPS = {"stress": "stress component 11 [Pa]"} | SCALARS
FIELDS = ("position", "position_initial", "stress", "stress_exact", *SCALARS)


@dataclasses.dataclass(frozen=True)
class Field:
    """The last snapshot of one run.

    Attributes
    ----------
    series : Series
        The curve.
    position, initial : ndarray
        Particle positions now and at the start [m], shape (P, dim).
    stress : ndarray
        Stress component 11 [Pa], shape (P,).
    exact : ndarray or None
        The same of the exact solution.
    scalars : dict of ndarray
        Those of `SCALARS` that the run has, shape (P,).
    """

    series: Series
    position: np.ndarray
    initial: np.ndarray
    stress: np.ndarray
    exact: np.ndarray | None
    scalars: dict[str, np.ndarray] = dataclasses.field(default_factory=dict)


def final_fields(study: Study) -> tuple[float, list[Field]]:
    """Last snapshots of runs as by `finest_runs`, and the value of the axis there.

    Files without snapshots are left out.
    """
    value, runs = finest_runs(study)
    fields = [_field(study, one, file) for one, file in runs]
    return value, [field for field in fields if field is not None]


def _field(study: Study, one: Series, file: str) -> Field | None:
    found = study.campaign.variables(file, FIELDS)
    if "position" not in found or "stress" not in found or not len(found["stress"]):
        return None
    position, stress = _matrix(found["position"][-1]), _component(found["stress"][-1])
    if not np.all(np.isfinite(position)) or len(position) != len(stress):
        return None
    initial = _matrix(found["position_initial"]) if "position_initial" in found else position
    exact = _component(found["stress_exact"][-1]) if "stress_exact" in found else None
    last = {name: found[name][-1] for name in SCALARS if name in found}
    scalars = {name: values for name, values in last.items() if len(values) == len(position)}
    return Field(one, position, initial, stress, exact, scalars)


def _matrix(values: np.ndarray) -> np.ndarray:
    return values[:, None] if values.ndim == 1 else values


def _component(stress: np.ndarray) -> np.ndarray:
    """Component 11 of stresses of shape (P,), (P, dim) or (P, dim, dim)."""
    return stress.reshape(len(stress), -1)[:, 0]


def line_of_particles(initial: np.ndarray) -> np.ndarray:
    """Particles of the row nearest the middle of the body, as numbers sorted along the first axis.

    Parameters
    ----------
    initial : ndarray
        Positions before the motion [m], shape (P, dim). Where particles form no rows, a band of one
        mean spacing.
    """
    inside = np.ones(len(initial), bool)
    for d in range(1, initial.shape[1]):
        coordinate = initial[:, d]
        middle = 0.5 * (coordinate.min() + coordinate.max())
        extent = np.ptp(initial, axis=0)
        sides = extent[extent > 0]
        spacing = float(np.prod(sides) / len(initial)) ** (1.0 / max(1, len(sides)))
        nearest = coordinate[np.argmin(np.abs(coordinate - middle))]
        row = np.abs(coordinate - nearest) < 1e-6 * max(spacing, 1e-300)
        if row.sum() < 0.5 * extent[0] / spacing:
            row = np.abs(coordinate - middle) <= 0.5 * spacing
        inside &= row
    chosen = np.flatnonzero(inside)
    return chosen[np.argsort(initial[chosen, 0], kind="stable")]


def stress_profile(fields: list[Field]) -> Figure | None:
    """Stress along the first axis, one panel per curve; the exact solution in black."""
    if not fields:
        return None
    figure, axes_of = _panels(fields, height=1.25)
    points = sum(len(field.stress) for field in fields)
    for field, axes in axes_of:
        row = line_of_particles(field.initial)
        x = field.position[row, 0]
        if field.exact is not None:
            axes.plot(x, field.exact[row], label="exact", **style.EXACT)
        look = style.dots(field.series.method, 2.2) | {"rasterized": points > VECTOR_POINTS}
        axes.plot(x, field.stress[row], **look)
    name_axes(figure, "position $x_1$ [m]", r"stress $\sigma_{11}$ [Pa]")
    return figure


def particle_map(fields: list[Field], name: str = "stress") -> Figure | None:
    """Particles of the plane (of a slice, in 3D) coloured by a field, one panel per curve that has it.

    `name` is ``stress``, for the component 11, or one of `SCALARS`.
    """
    fields = [one for one in fields if one.position.shape[1] >= 2]
    if name != "stress":
        fields = [
            dataclasses.replace(one, stress=one.scalars[name], exact=None)
            for one in fields
            if name in one.scalars
        ]
        if not any(np.ptp(one.stress) > 0.0 for one in fields):
            return None  # the same everywhere: there is nothing to be seen
    if not fields:
        return None
    figure, axes_of = _panels(fields, height=1.45)
    low, high, crossing_zero = _colour_range(fields)
    drawn: Any = None
    for field, axes in axes_of:
        slab = _slice(field.initial)
        drawn = axes.scatter(
            field.position[slab, 0],
            field.position[slab, 1],
            c=field.stress[slab],
            s=max(0.15, min(6.0, 4000.0 / len(slab))),
            cmap="RdBu_r" if crossing_zero else "viridis",
            vmin=low,
            vmax=high,
            linewidths=0,
            rasterized=True,
        )
        axes.set_aspect("equal")
        axes.grid(False)
    look: dict[str, Any] = {"shrink": 0.8, "aspect": 30, "location": "top", "extend": "both"}
    places = [axes for _, axes in axes_of]
    bar = figure.colorbar(drawn, ax=places, label=MAPS[name], **look)
    bar.locator = MaxNLocator(4)  # room for numbers such as -20000
    bar.formatter = ScalarFormatter()
    bar.formatter.set_powerlimits((-3, 5))
    bar.update_ticks()
    name_axes(figure, "position $x_1$ [m]", "position $x_2$ [m]")
    return figure


def _colour_range(fields: list[Field]) -> tuple[float, float, bool]:
    """Values of the two ends of the colours, the same for all panels, and whether 0 lies within.

    They are those of the exact solution; where that is constant or unknown, those that were computed,
    without the outermost hundredth at either end.
    """
    exact = [field.exact for field in fields if field.exact is not None]
    known = np.concatenate(exact) if len(exact) == len(fields) else np.zeros(1)
    if np.ptp(known):
        low, high = float(known.min()), float(known.max())
    else:
        low, high = robust(np.concatenate([field.stress for field in fields]))
    if not low < 0 < high:
        return low, high, False
    return -max(-low, high), max(-low, high), True


def _slice(initial: np.ndarray) -> np.ndarray:
    """All particles in 2D; in 3D those within half a spacing of the third axis' middle."""
    if initial.shape[1] < 3:
        return np.arange(len(initial))
    z = initial[:, 2]
    spacing = (np.prod(np.ptp(initial, axis=0)) / len(initial)) ** (1.0 / 3.0)
    return np.flatnonzero(np.abs(z - 0.5 * (z.min() + z.max())) <= 0.5 * spacing)


def _panels(fields: list[Field], height: float) -> tuple[Figure, list[tuple[Field, Axes]]]:
    """A figure one column wide, and each field with its panel; they stand two abreast."""
    columns = min(2, len(fields))
    figure, panels = tiles(len(fields), columns, height, width=style.COLUMN, margin=0.45)
    for field, axes in zip(fields, panels, strict=True):
        axes.set_title(wrapped(field.series.name, TITLE_WIDTH), pad=3, size=7)
    return figure, list(zip(fields, panels, strict=True))
