"""Curves that a page can switch off and read off: which lines of a figure they are, and where its axes lie.

A line of a figure becomes such a curve by `named`. In the drawing it is a group whose identifier
ends as `named` says; what the page's script reads off is where its points are in the drawing, turned
into numbers by the limits of the axes.
"""

from dataclasses import dataclass
from typing import Any

from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

POINTS = 72.0  # of an SVG file to the inch
PREFIX = "curve-"


def named(line: Line2D, number: int, panel: int = 0) -> Line2D:
    """Make a line the curve of that number in a panel of a figure."""
    line.set_gid(f"{PREFIX}{number}-{panel}")
    return line


@dataclass(frozen=True)
class Curves:
    """What a page knows of the curves of a figure.

    Attributes
    ----------
    lines : list of dict
        ``number``, ``label`` and ``colour`` of each curve.
    axes : list of dict
        For each panel that has some: its edges in the drawing [points], and of both axes the values at
        the ends, the words, and whether it is logarithmic.
    """

    lines: list[dict[str, Any]]
    axes: list[dict[str, Any]]


def curves_of(figure: Figure) -> Curves:
    """The curves of a figure that is laid out."""
    width, height = POINTS * figure.get_size_inches()
    lines: dict[int, dict[str, Any]] = {}
    axes = []
    for place in figure.axes:
        own = [line for line in place.lines if str(line.get_gid() or "").startswith(PREFIX)]
        if not own:
            continue
        box = place.get_position()
        edges = [box.x0 * width, box.x1 * width, (1.0 - box.y0) * height, (1.0 - box.y1) * height]
        shared = getattr(figure, "_supxlabel", None)
        below = place.get_xlabel() or (shared.get_text() if shared is not None else "")
        axes.append(
            {
                "edges": [round(float(edge), 3) for edge in edges],
                "x": _axis(place.get_xlim(), place.get_xscale(), below),
                "y": _axis(
                    place.get_ylim(), place.get_yscale(), place.get_ylabel() or place.get_title()
                ),
            }
        )
        for line in own:
            number, _ = map(int, str(line.get_gid()).removeprefix(PREFIX).split("-"))
            said = {"label": plain(str(line.get_label())), "colour": to_hex(line.get_color())}
            lines.setdefault(number, {"number": number} | said)
    return Curves([lines[number] for number in sorted(lines)], axes)


def _axis(limits: tuple[float, float], scale: str, words: str) -> dict[str, Any]:
    return {"limits": [float(one) for one in limits], "log": scale == "log", "words": plain(words)}


def plain(text: str) -> str:
    """A label of a figure as text: one line, dollar signs as they are."""
    return " ".join(text.split()).replace(r"\$", "$")


def described(figure: Figure) -> str:
    """What a figure shows, in words: its axes and its curves."""
    found = curves_of(figure)
    if not found.lines:
        return ""
    panels = "; ".join(
        dict.fromkeys(f"{one['y']['words']} against {one['x']['words']}" for one in found.axes)
    )
    names = "; ".join(line["label"] for line in found.lines)
    return f"{panels}. {len(found.lines)} curves: {names}."
