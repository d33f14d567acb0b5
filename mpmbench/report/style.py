"""The look of every figure: a colour per method, a marker per basis, black for what is exact."""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, cast

import matplotlib

COLUMN = 3.4  # width of a journal's column [in]
EXACT: dict[str, Any] = {"color": "black", "linewidth": 1.0, "zorder": 1.5}
LINE_STYLES = ("-", "--", ":", "-.")

# Okabe and Ito's palette for the methods of the house; Tol's muted colours for plug-ins. Both are
# told apart by readers with any common colour vision deficiency; black stays free for exact
# solutions.
METHOD_COLOURS = {
    "mpm": "#0072B2",
    "otm": "#D55E00",
    "unified": "#009E73",
    "gmm": "#CC79A7",
    "implicit_mpm": "#56B4E9",
    "fem": "#E69F00",
}
PLUGIN_COLOURS = (
    "#882255",
    "#332288",
    "#999933",
    "#AA4499",
    "#661100",
    "#44AA99",
    "#6699CC",
    "#888888",
)
BASIS_MARKERS = {"linear": "o", "bspline": "s", "maxent": "^", "lme": "D", "mls": "v"}
PLUGIN_MARKERS = ("P", "X", "p", "h", ">", "<", "*", "d")

SETTINGS: dict[str, Any] = {
    "figure.dpi": 100,
    "savefig.dpi": 200,
    "figure.facecolor": "white",
    "font.family": "DejaVu Sans",
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.linewidth": 0.4,
    "grid.color": "#dddddd",
    "lines.linewidth": 1.1,
    "lines.markersize": 4.5,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "mathtext.fontset": "dejavusans",
    "svg.hashsalt": "mpmbench",  # the same results give the same bytes
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
    "path.simplify": False,
}


@contextmanager
def applied() -> Iterator[None]:
    """The settings as a context; needed while drawing and while saving.

    What they leave open is matplotlib's own default, whatever a ``matplotlibrc`` in the current
    folder or elsewhere says.
    """
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(cast(Any, SETTINGS))
        yield


def colour(method: str) -> str:
    """Colour of a method; that of a plug-in follows from its name alone."""
    return METHOD_COLOURS.get(method) or PLUGIN_COLOURS[_stable(method) % len(PLUGIN_COLOURS)]


def marker(basis: str) -> str:
    """Marker of a basis; that of a plug-in follows from its name alone."""
    return BASIS_MARKERS.get(basis) or PLUGIN_MARKERS[_stable(basis) % len(PLUGIN_MARKERS)]


def line(method: str, basis: str, rank: int = 0) -> dict[str, Any]:
    """Keywords of `Axes.plot` for one curve; variants differ in line style, then in filling."""
    own = colour(method)
    filling = rank // len(LINE_STYLES) % 3
    return {
        "color": own,
        "marker": marker(basis),
        "linestyle": LINE_STYLES[rank % len(LINE_STYLES)],
        "markerfacecolor": (own, "white", "#bbbbbb")[filling],
        "markeredgecolor": own,
        "markeredgewidth": 0.8,
    }


def beneath(look: dict[str, Any], depth: int) -> dict[str, Any]:
    """Changes for a curve that others coincide with: wider and paler for each that lies upon it."""
    if depth == 0:
        return {}
    return {
        "linewidth": 1.1 + 3.0 * depth,
        "markersize": 4.5 + 4.0 * depth,
        "alpha": 0.45,
        "markerfacecolor": "none",
        "markeredgewidth": 1.6,
        "zorder": 1.9 - 0.1 * depth,
    }


def dots(method: str, size: float) -> dict[str, Any]:
    """Keywords of `Axes.plot` for particles in the colour of their method."""
    return {"linestyle": "none", "marker": ".", "color": colour(method), "ms": size, "mew": 0}


def _stable(name: str) -> int:
    """A number that depends on the name only (Python's own hash changes from run to run)."""
    return hashlib.sha256(name.encode()).digest()[0]
