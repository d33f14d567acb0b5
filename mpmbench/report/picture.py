"""A run as a picture: its particles at an instant, coloured by a field, beside the exact solution; and as a film.

In 1D the field is drawn over the position, in 2D particles are round dots of their volume, in 3D
they are seen from a side.
"""

import io
import shutil
import subprocess
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from PIL import Image

from mpmbench.report import solids, style
from mpmbench.report.fields import Field, exact_position, field_of
from mpmbench.report.names import drawn

COLOURS = 128  # in the palette of an animated GIF
ALMOST_WHITE = 240  # of 255: colours of the palette that become white, which stays white
REST = 1500  # [ms] that its last picture stays
DPI = 150
TILE, MOST_BESIDE = 480, 4  # of a contact sheet: width [pixels], and how many stand side by side


@dataclass(frozen=True)
class View:
    """What else is seen, and from where.

    Attributes
    ----------
    nodes : ndarray or None
        Nodes that are drawn beneath the particles, shape (N, dim).
    exact : bool
        Whether the exact solution stands beside, where it is known.
    limits : tuple of float or None
        Values at the ends of the colours.
    up : int
        Axis that points upwards in 3D.
    azimuth, elevation : float
        Of the eye in 3D [degrees].
    """

    nodes: np.ndarray | None = None
    exact: bool = True
    limits: tuple[float, float] | None = None
    up: int = 2
    azimuth: float = 45.0
    elevation: float = 20.0


class Drawing(Figure):
    """A figure that shows itself in a notebook, also where pyplot does not draw into it."""

    def _repr_png_(self) -> bytes:
        return rendered(self)


def picture(
    dataset: xr.Dataset, name: str | None = None, snapshot: int = -1, view: View | None = None
) -> Figure:
    """The particles of a result at one of its instants, coloured by a field.

    Parameters
    ----------
    dataset : Dataset
        A result.
    name : str, optional
        Of a field, as `fields.field_of` knows it.
    snapshot : int
        Number of the instant, the last by default.
    view : View, optional

    Raises
    ------
    NoField
        When the result has no such field, or no particles.
    """
    with style.applied():
        figure, paint = scene(dataset, field_of(dataset, name), view or View())
        paint(snapshot)
    return figure


Paint = Callable[[int], None]


def scene(dataset: xr.Dataset, field: Field, view: View) -> tuple[Figure, Paint]:
    """An empty figure of the right shape, and a function that paints an instant on it."""
    position = np.asarray(dataset["position"].values, dtype=float)
    places = exact_position(dataset) if view.exact and field.exact is not None else None
    dim = position.shape[2]
    if dim == 1:
        return along_a_line(dataset, field, view, position, places)
    panels: list[tuple[str, np.ndarray, np.ndarray]] = [("", position, field.values)]
    if view.exact and field.exact is not None:
        at = position if places is None else places
        panels = [("computed", position, field.values), ("exact", at, field.exact)]
    edges = edges_of(dataset, position)
    limits = view.limits or field.limits()
    window = frame([flat(at, view) for _, at, _ in panels], edges)
    width, height = window[1] - window[0]
    each = style.COLUMN * (1.3 if len(panels) == 1 else 1.0)
    tall = np.clip((each - 0.6) * height / width, 0.6, 1.6 * each) + 0.8
    bar_below = width > height  # a long body has its bar below
    figure = Drawing(
        figsize=(each * len(panels) + (0.0 if bar_below else 0.9), tall + 0.5 * bar_below)
    )
    figure.set_layout_engine("constrained")
    axes = figure.subplots(1, len(panels), squeeze=False)[0]
    colours = ScalarMappable(matplotlib.colors.Normalize(*limits), matplotlib.colormaps["viridis"])
    bar = figure.colorbar(
        colours,
        ax=axes.tolist(),
        location="bottom" if bar_below else "right",
        extend=field.beyond(limits),
        label=field.label,
        shrink=0.9,
    )
    bar.ax.locator_params(nbins=5)
    times = dataset["snapshot_time"].values

    def paint(k: int) -> None:
        figure.suptitle(title(dataset, float(times[k])), fontsize=8)
        for one, (head, at, values) in zip(axes, panels, strict=True):
            one.clear()
            dots(one, at[k], values[k], edges[k], limits, view)
            one.set(xlim=window[:, 0], ylim=window[:, 1], aspect="equal", title=head)

    return figure, paint


def edges_of(dataset: xr.Dataset, position: np.ndarray) -> np.ndarray:
    """Edges [m] of cubes with the particles' volumes, shape (T, P).

    Where a result has no volumes, of older versions, they share the box that they start in.
    """
    if "volume" in dataset:
        volume = np.abs(np.asarray(dataset["volume"].values, dtype=float))
    else:
        volume = np.full(
            position.shape[:2], np.prod(np.ptp(position[0], axis=0)) / len(position[0])
        )
    return np.asarray(volume ** (1.0 / position.shape[2]))


def dots(
    axes: Any,
    x: np.ndarray,
    values: np.ndarray,
    edges: np.ndarray,
    limits: tuple[float, float],
    view: View,
) -> None:
    """Paint the particles of one instant, shape (P, 2) or (P, 3); those that are nowhere are left out."""
    known = np.isfinite(x).all(axis=1) & np.isfinite(values)
    x, values, edges = x[known], values[known], edges[known]
    viridis = matplotlib.colormaps["viridis"]
    if view.nodes is not None:
        seen = flat(view.nodes[None], view)[0]
        axes.plot(*seen.T, linestyle="none", marker="+", color="#888888", ms=3, mew=0.4, zorder=0.5)
    if x.shape[1] == 3:
        if len(x):
            angles = (view.up, view.azimuth, view.elevation)
            solids.draw(axes, x, values, edges, viridis, limits, *angles)
        return
    widths = solids.OVERLAP * edges
    collection = EllipseCollection(
        widths,
        widths,
        np.zeros(len(x)),
        units="xy",
        offsets=x,
        offset_transform=axes.transData,
        cmap=viridis,
        clim=limits,
        linewidths=0.0,
    )
    collection.set_array(values)
    axes.add_collection(collection)
    axes.grid(False)
    axes.locator_params(nbins=5)
    axes.set(xlabel="position $x_1$ [m]", ylabel="position $x_2$ [m]")


def along_a_line(
    dataset: xr.Dataset, field: Field, view: View, position: np.ndarray, exact: np.ndarray | None
) -> tuple[Figure, Paint]:
    """In 1D: the field over the position, the exact solution in black."""
    figure = Drawing(figsize=(1.3 * style.COLUMN, 0.85 * style.COLUMN))
    figure.set_layout_engine("constrained")
    axes = figure.subplots()
    beside = field.exact if view.exact else None
    at = position if exact is None else exact
    everything = [field.values] if beside is None else [field.values, beside]
    finite = np.concatenate([one[np.isfinite(one)] for one in everything])
    whole = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    low, high = view.limits or whole
    room = 0.05 * (high - low) or 0.05 * max(abs(low), abs(high)) or 1.0
    ends = position[np.isfinite(position)]
    span = (float(ends.min()), float(ends.max())) if len(ends) else (0.0, 1.0)
    side = 0.02 * (span[1] - span[0]) or 0.5
    times, method = dataset["snapshot_time"].values, str(dataset.attrs.get("method", ""))

    def paint(k: int) -> None:
        axes.clear()
        figure.suptitle(title(dataset, float(times[k])), fontsize=8)
        if beside is not None:
            order = np.argsort(at[k, :, 0])
            axes.plot(at[k, order, 0], beside[k, order], label="exact", **style.EXACT)
        axes.plot(position[k, :, 0], field.values[k], label="particles", **style.dots(method, 4.0))
        if view.nodes is not None:
            axes.plot(view.nodes[:, 0], np.full(len(view.nodes), low - room), "|", color="#888888")
        axes.set(xlim=(span[0] - side, span[1] + side), ylim=(low - room, high + room))
        axes.set(xlabel="position $x_1$ [m]", ylabel=field.label)
        if beside is not None:
            axes.legend(loc="best")

    return figure, paint


def flat(x: np.ndarray, view: View) -> np.ndarray:
    """Positions of shape (T, P, dim) in the plane of the picture, shape (T, P, 2)."""
    if x.shape[2] == 2:
        return x
    seen = solids.seen_from(x.reshape(-1, 3), view.up, view.azimuth, view.elevation)
    return seen[:, :2].reshape(*x.shape[:2], 2)


def frame(places: Iterable[np.ndarray], edges: np.ndarray) -> np.ndarray:
    """Lower left and upper right corner of a window that holds all particles at all instants."""
    points = np.concatenate([one.reshape(-1, 2) for one in places])
    points = points[np.isfinite(points).all(axis=1)]
    room = float(np.nanmax(np.where(np.isfinite(edges), edges, 0.0), initial=0.0)) or 0.5
    if not len(points):
        return np.array([[0.0, 0.0], [1.0, 1.0]])
    low, high = points.min(axis=0) - room, points.max(axis=0) + room
    thin = np.maximum(0.05 * (high - low).max() - (high - low), 0.0)
    return np.array([low - 0.5 * thin, high + 0.5 * thin])


def title(dataset: xr.Dataset, time: float) -> str:
    """What was run, and the time."""
    known = dataset.attrs
    words = [str(known[key]) for key in ("problem", "method", "basis") if key in known]
    return drawn(", ".join([*words, f"t = {time:.4g} s"]))


def rendered(figure: Figure) -> bytes:
    """A figure as PNG."""
    file = io.BytesIO()
    with style.applied():
        figure.savefig(file, format="png", dpi=DPI, metadata={"Software": None})
    return file.getvalue()


def sheet(pictures: list[bytes]) -> bytes:
    """Pictures, as PNG, beside and below each other in one."""
    images = [Image.open(io.BytesIO(one)).convert("RGB") for one in pictures]
    for image in images:
        image.thumbnail((TILE, TILE))
    columns = min(MOST_BESIDE, len(images))
    rows = [images[k : k + columns] for k in range(0, len(images), columns)]
    heights = [max(image.height for image in row) for row in rows]
    whole = Image.new("RGB", (columns * TILE, sum(heights)), "white")
    for k, row in enumerate(rows):
        for j, image in enumerate(row):
            beside = (TILE - image.width) // 2
            whole.paste(image, (j * TILE + beside, sum(heights[:k])))
    file = io.BytesIO()
    whole.save(file, "PNG", optimize=True)
    return file.getvalue()


def film(dataset: xr.Dataset, name: str | None = None, view: View | None = None) -> list[Any]:
    """A picture, as one of Pillow, for each instant of a result, all of one size and one colour scale."""
    found = []
    with style.applied():
        figure, paint = scene(dataset, field_of(dataset, name), view or View())
        canvas = FigureCanvasAgg(figure)
        figure.set_dpi(DPI)
        for k in range(dataset.sizes["snapshot"]):
            paint(k)
            canvas.draw()
            if k == 0:
                figure.set_layout_engine("none")  # nothing moves but the particles
            found.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    return found


def gif(pictures: list[Any], seconds: float) -> bytes:
    """An animated GIF that lasts so long, and then rests."""
    palette = pictures[-1].quantize(COLOURS)
    colours = np.reshape(palette.getpalette(), (-1, 3))
    colours[(colours > ALMOST_WHITE).all(axis=1)] = (
        255  # the nearest colour is only about the nearest
    )
    palette.putpalette(colours.ravel().tolist())
    frames = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures]
    pace = max(20, round(1000.0 * seconds / max(len(frames) - 1, 1)))  # [ms]
    file = io.BytesIO()
    frames[0].save(
        file, "GIF", save_all=True, append_images=frames[1:], loop=0, optimize=True,
        duration=[pace] * (len(frames) - 1) + [max(pace, REST)],
    )  # fmt: skip
    return file.getvalue()


def encoder() -> str | None:
    """Where the program ffmpeg is, if it is there."""
    return shutil.which("ffmpeg")


def mp4(pictures: list[Any], seconds: float, target: Path) -> None:
    """Write a film as MP4 (H.264) by ffmpeg.

    Raises
    ------
    OSError
        When ffmpeg cannot do it; the message is the last line of what it says.
    """
    width, height = pictures[0].size
    rate = max(len(pictures) - 1, 1) / seconds
    even = "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white"  # H.264 needs even sizes
    words = [
        encoder() or "ffmpeg", "-loglevel", "error", "-y",
        "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{rate:.6g}", "-i", "-",
        "-vf", even, "-c:v", "libx264", "-pix_fmt", "yuv420p", "-f", "mp4", str(target),
    ]  # fmt: skip
    content = b"".join(one.tobytes() for one in pictures)
    done = subprocess.run(words, input=content, capture_output=True, check=False)
    if done.returncode != 0:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise OSError(f"ffmpeg: {said[-1] if said else f'exit code {done.returncode}'}")
