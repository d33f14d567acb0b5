"""Fields of particles in a result by name: scalars, components such as ``stress_12``, lengths of vectors, errors.

Whatever a result holds for every particle is found here, that of plug-ins too.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from mpmbench.report.names import drawn

EACH = ("snapshot", "particle")
ROBUST = (1.0, 99.0)  # percentiles at the ends of the colours
FROM_ZERO = 0.2  # a field whose low end is less than this of its high end begins at zero
ROUNDING = 1e-9  # of the largest value: what varies less is constant
KNOWN = {True: ("stress", "displacement"), False: ("displacement",)}  # exactly, in 1D and beyond
TELLING = ("plastic_strain", "von_mises", "stress", "displacement", "velocity")


class NoField(Exception):
    """A result has no such field; the message says which it has."""


@dataclass(frozen=True)
class Field:
    """A number for each particle at each instant.

    Attributes
    ----------
    name, label : str
        The label has the unit.
    values : ndarray
        Shape (T, P).
    exact : ndarray or None
        The exact solution of the same, where the result has it.
    """

    name: str
    label: str
    values: np.ndarray
    exact: np.ndarray | None

    def limits(self) -> tuple[float, float]:
        """Ends of the colours: of all instants, without the outermost hundredth at either end."""
        exact = np.zeros(0) if self.exact is None else self.exact.ravel()
        return robust(np.concatenate([self.values.ravel(), exact]))

    def beyond(self, limits: tuple[float, float]) -> str:
        """At which ends of a colour bar there are values beyond: as matplotlib's `extend`."""
        with np.errstate(invalid="ignore"):
            below, above = (self.values < limits[0]).any(), (self.values > limits[1]).any()
        return ("neither", "min", "max", "both")[int(below) + 2 * int(above)]


def robust(values: np.ndarray) -> tuple[float, float]:
    """Ends of the colours of some values, shape (n,), without the outermost hundredth at either end."""
    found = values[np.isfinite(values)]
    if not len(found):
        return 0.0, 1.0
    low, high = (float(one) for one in np.percentile(found, ROBUST))
    if high - low <= ROUNDING * max(abs(low), abs(high)):  # one value nearly everywhere
        low, high = float(found.min()), float(found.max())
    size = max(abs(low), abs(high))
    if high - low <= ROUNDING * size:  # it is the same everywhere
        return (low - 0.5 * size, high + 0.5 * size) if size > 0.0 else (0.0, 1.0)
    if 0.0 < low < FROM_ZERO * high:
        low = 0.0
    return low, high


def arrays_of(dataset: xr.Dataset) -> Iterator[tuple[str, xr.DataArray]]:
    """What a result holds for each particle at each instant, without exact solutions and positions.

    What is known of particles once, as shape functions, is the same at all instants.
    """
    for key, variable in sorted(dataset.data_vars.items(), key=lambda item: str(item[0])):
        name = str(key)
        is_place = name in ("position", "position_initial") or name.endswith("_exact")
        if is_place or variable.dtype.kind not in "iuf":
            continue
        if variable.dims[:2] == EACH:
            yield name, variable
        elif variable.dims[:1] == EACH[1:]:
            yield name, variable.expand_dims(snapshot=dataset.sizes["snapshot"])


def names_of(dataset: xr.Dataset) -> list[str]:
    """Names of all fields: of scalars and vectors themselves, of components, and of errors."""
    names = []
    for name, variable in arrays_of(dataset):
        shape = variable.shape[2:]
        errors = [f"{name}_error"] if f"{name}_exact" in dataset else []
        names += [name, *errors]
        if np.prod(shape, dtype=int) > 1:
            names += [f"{name}_{part}" for part in parts_of(shape)]
    return names


def parts_of(shape: tuple[int, ...]) -> list[str]:
    """Components of an array, numbered from 1 as in ``12``."""
    return ["".join(str(i + 1) for i in index) for index in np.ndindex(*shape)]


def telling(dataset: xr.Dataset) -> str:
    """The field that says most: the first of a short list that is not the same everywhere all the time.

    One that has an exact solution comes first, after plastic strain, and what a problem has of its
    own last.
    """
    known = names_of(dataset)
    of_line = dataset.sizes.get("dim") == 1
    with_exact = [name for name in KNOWN[of_line] if f"{name}_exact" in dataset]
    for name in (TELLING[0], *with_exact, *TELLING[1:], *known):
        if name in known and np.ptp(np.nan_to_num(field_of(dataset, name).values)) > 0.0:
            return name
    if not known:
        raise NoField("there are no particles in it, since the run did not come to its end")
    return next((name for name in TELLING if name in known), known[0])


def field_of(dataset: xr.Dataset, name: str | None = None) -> Field:
    """A field by its name, by default the most telling one.

    ``stress_12`` is a component, ``velocity`` the length of a vector, or its only component in 1D,
    ``stress`` in 2D and 3D the root of the sum of squares, and ``velocity_error`` the size of the
    difference to the exact solution.

    Raises
    ------
    NoField
        When the result has none of this name.
    """
    name = telling(dataset) if name is None else name
    for base, variable in arrays_of(dataset):
        unit, said = (str(variable.attrs.get(key, "")) for key in ("units", "long_name"))
        exact = dataset.get(f"{base}_exact")
        told = said or base.replace("_", " ")
        values = np.asarray(variable.values, dtype=float)
        beside = None if exact is None else np.asarray(exact.values, dtype=float)
        if name == base:
            how = "" if values.ndim == 2 or values[0, 0].size == 1 else ", size"
            return Field(name, labelled(f"{told}{how}", unit), size(values), both(size, beside))
        if name == f"{base}_error" and beside is not None:
            return Field(
                name, labelled(f"error of {told}", unit), size(values - beside, True), None
            )
        part = name.removeprefix(f"{base}_")
        if name != part and values.ndim > 2 and part in parts_of(values.shape[2:]):
            label = labelled(f"{told}, component {part}", unit)
            k = parts_of(values.shape[2:]).index(part)
            found = None if beside is None else beside.reshape(*beside.shape[:2], -1)[:, :, k]
            return Field(name, label, values.reshape(*values.shape[:2], -1)[:, :, k], found)
    raise NoField(f"there is no field {name}; there are {', '.join(names_of(dataset)) or 'none'}")


def both(take: Any, values: np.ndarray | None) -> np.ndarray | None:
    """What `take` makes of an array, if there is one."""
    return None if values is None else take(values)  # type: ignore[no-any-return]


def size(values: np.ndarray, absolute: bool = False) -> np.ndarray:
    """Numbers as they are, vectors and tensors by the root of their sum of squares, shape (T, P)."""
    flat = values.reshape(*values.shape[:2], -1)
    if flat.shape[2] == 1:
        return np.abs(flat[:, :, 0]) if absolute else flat[:, :, 0]
    return np.sqrt(np.sum(flat**2, axis=2))


def labelled(text: str, unit: str) -> str:
    """Words and unit for an axis."""
    powers = {"m s-1": "m/s", "1": "-", "": "-"}
    return drawn(f"{text} [{powers.get(unit, unit)}]")


def exact_position(dataset: xr.Dataset) -> np.ndarray | None:
    """Where the particles should be, shape (T, P, dim), if the result knows."""
    if "displacement_exact" not in dataset or "position_initial" not in dataset:
        return None
    return np.asarray(dataset["position_initial"].values + dataset["displacement_exact"].values)
