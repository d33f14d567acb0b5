"""A result in a notebook: it shows its picture and its numbers, and stays a dataset."""

import base64
import html

import xarray as xr
from matplotlib.figure import Figure

from mpmbench.report.fields import NoField
from mpmbench.report.picture import View, picture, rendered

SHOWN = ("error_displacement_rms", "error_stress_rms", "energy_drift", "solver_time", "steps")


class Result(xr.Dataset):
    """What a run has given: an `xarray.Dataset` that shows its particles in a notebook."""

    __slots__ = ()

    @classmethod
    def of(cls, dataset: xr.Dataset) -> "Result":
        """The same dataset, as one that shows itself."""
        return cls(dataset.data_vars, dataset.coords, dataset.attrs)

    def show(
        self, field: str | None = None, snapshot: int = -1, exact: bool = True, **view: object
    ) -> Figure:
        """Draw the particles at an instant, coloured by a field.

        Parameters
        ----------
        field : str, optional
            ``von_mises``, ``stress_12``, ``velocity_error``, ...; by default one that varies.
        snapshot : int
            Number of the instant, the last by default.
        exact : bool
            Whether the exact solution stands beside, where it is known.
        **view
            As of `mpmbench.report.picture.View`, for example ``elevation=40.0``.

        Raises
        ------
        NoField
            When there is no such field; the message names those that there are.
        """
        return picture(self, field, snapshot, View(exact=exact, **view))  # type: ignore[arg-type]

    def _repr_html_(self) -> str:
        """The picture, how the run ended, a few numbers, and below them the dataset as xarray shows it."""
        below = str(super()._repr_html_())
        if "status" not in self.attrs:  # a part of a result that knows nothing of the run
            return below
        try:
            image = base64.b64encode(rendered(self.show())).decode()
            words = html.escape(f"Particles of {self.attrs.get('problem', 'a run')} at the end")
            drawn = (
                f'<img alt="{words}" style="max-width:100%" src="data:image/png;base64,{image}">'
            )
        except NoField:
            drawn = ""
        return f"{drawn}{numbers(self)}{below}"


def numbers(dataset: xr.Dataset) -> str:
    """A table of how a run ended and of its most asked numbers."""
    ended = str(dataset.attrs["status"])
    reason = str(dataset.attrs.get("reason", ""))
    rows = [("status", f"{ended}: {reason}" if reason else ended)]
    for name in SHOWN:
        if name in dataset and dataset[name].ndim == 0:
            unit = dataset[name].attrs.get("units", "1")
            rows.append((name, f"{float(dataset[name]):.4g}{'' if unit == '1' else f' {unit}'}"))
    cells = (
        f'<tr><th scope="row" style="text-align:left">{html.escape(name)}</th>'
        f'<td style="text-align:left">{html.escape(value)}</td></tr>'
        for name, value in rows
    )
    return f"<table>{''.join(cells)}</table>"
