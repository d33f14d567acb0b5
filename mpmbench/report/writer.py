"""The files of a report: pictures and tables in their formats, each written in one move."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import markupsafe
from matplotlib import rc_context
from matplotlib.figure import Figure

from mpmbench.report import style
from mpmbench.report.curves import Curves, curves_of, described
from mpmbench.report.names import safe_name
from mpmbench.report.tables import Table
from mpmbench.results.one_move import in_one_move

FORMATS: dict[str, dict[str, Any]] = {
    "svg": {"metadata": {"Date": None}, "dpi": 130},  # of what is pixels in it
    "pdf": {"metadata": {"CreationDate": None}},
    "png": {"metadata": {"Software": None}},
}
MANIFEST = "files.txt"
PLACES = re.compile(
    r'(?<= )(d|x|y|width|height|transform)="[^"]*"'
)  # attributes that say where something is
DIGITS = re.compile(r"(\.\d{3})\d+")  # of places: a thousandth of a point is enough
FONTS = "'DejaVu Sans', Verdana, sans-serif"  # as wide as the one that figures are laid out with
SCREEN_SCALE = 1.55  # a figure is at most this much larger on the screen than in a journal


NO_CURVES = Curves([], [])


@dataclass(frozen=True)
class Picture:
    """A figure on the page: its file stem, its drawing and what the reader should know about it.

    Attributes
    ----------
    curves : Curves
        Those that the page can switch and read off.
    data : str
        The file with its numbers, if there is one.
    """

    name: str
    title: str
    caption: str
    svg: markupsafe.Markup
    curves: Curves = NO_CURVES
    data: str = ""

    @property
    def left_out(self) -> "Picture":
        """The same without its drawing, which is in its files only."""
        return replace(self, svg=markupsafe.Markup(""), curves=NO_CURVES)

    @property
    def wide(self) -> bool:
        """Whether it takes more than one column of a journal."""
        width = re.search(r"max-width:(\d+)px", self.svg)
        return width is not None and int(width.group(1)) > 1.2 * 72 * SCREEN_SCALE * style.COLUMN


class Writer:
    """Writes the files of a report, each in one move, and removes those of an earlier one.

    Parameters
    ----------
    target : Path
        Folder of the report.
    within : Path, optional
        Folder that nothing may be written outside of, through links neither: by default `target`.
    text : bool
        Whether words in SVG stay text, which can be searched and marked, or become outlines.
    """

    def __init__(self, target: Path, within: Path | None = None, text: bool = False) -> None:
        self.target = target
        self.within = within or target
        self.look: Any = {"svg.fonttype": "none"} if text else {}
        self.written: list[str] = []

    def text(self, name: str, content: str) -> Path:
        """Write one text file."""
        return self.data(name, content.encode())

    def data(self, name: str, content: bytes) -> Path:
        """Write one file of bytes."""
        with self._place(name) as file:
            file.write_bytes(content)
        return self.target / name

    def table(self, table: Table) -> None:
        """Write a table as CSV, Markdown and LaTeX."""
        texts = {"csv": table.csv(), "md": table.markdown(), "tex": table.latex()}
        for suffix, content in texts.items():
            self.text(f"tables/{table.name}.{suffix}", content)

    def picture(
        self, name: str, title: str, caption: str, figure: Figure, data: str = ""
    ) -> Picture:
        """Save a figure as SVG, PDF and PNG, and return it for the page."""
        for suffix, options in FORMATS.items():
            with self._place(f"figures/{name}.{suffix}") as file, rc_context(self.look):
                figure.savefig(file, format=suffix, **options)
            if suffix == "svg":  # laid out once; the other formats need not do it again
                figure.set_layout_engine("none")
        drawing = (self.target / "figures" / f"{name}.svg").read_text(encoding="utf-8")
        said = f"{title}. {described(figure)}".strip()
        return Picture(
            name, title, caption, inline_svg(drawing, name, said), curves_of(figure), data
        )

    def finish(self) -> None:
        """Remove the files of the last report that this one no longer has."""
        manifest = self.target / MANIFEST
        before = manifest.read_text("utf-8", "replace").splitlines() if manifest.exists() else []
        for name in set(before) - set(self.written):
            place = self.target / name
            if self._holds(place) and place.is_file():
                place.unlink()
        self.text(MANIFEST, "\n".join(sorted(self.written)) + "\n")

    def _holds(self, place: Path) -> bool:
        """Whether a file would lie in the folder of the report, all links followed."""
        return place.resolve().is_relative_to(self.within.resolve())

    @contextmanager
    def _place(self, name: str) -> Iterator[Path]:
        if not self._holds(self.target / name):
            raise PermissionError(f"{self.target / name} lies outside of {self.within}")
        with in_one_move(self.target / name) as unfinished:
            yield unfinished
        self.written.append(name)


def inline_svg(drawing: str, name: str, said: str = "") -> markupsafe.Markup:
    """An SVG file of matplotlib as a part of a page: no XML head, fluid width, identifiers of its own.

    Parameters
    ----------
    drawing : str
    name : str
        What its identifiers begin with.
    said : str
        What it shows, for those who do not see it.
    """
    name = safe_name(name)
    drawing = drawing[drawing.index("<svg") :]
    drawing = re.sub(r"<!--.*?-->\s*", "", drawing, flags=re.DOTALL)
    drawing = drawing.replace("'DejaVu Sans'", FONTS)
    drawing = PLACES.sub(lambda found: DIGITS.sub(r"\1", found[0]), drawing)
    drawing = re.sub(r"\n\s*", "\n", drawing).replace("base64,\n", "base64,")
    drawing = re.sub(r"<metadata>.*?</metadata>", "", drawing, flags=re.DOTALL)
    drawing = re.sub(r'\bid="', f'id="{name}-', drawing)
    drawing = re.sub(r'href="#', f'href="#{name}-', drawing)
    drawing = drawing.replace("url(#", f"url(#{name}-")
    head, body = drawing.split(">", 1)
    width = re.search(r'viewBox="0 0 ([\d.]+) ', head)
    widest = f"max-width:{SCREEN_SCALE * float(width.group(1)):.0f}px" if width else ""
    head = re.sub(r' (width|height)="[^"]*"', "", head)
    text = markupsafe.Markup(' role="img" aria-label="{}"').format(said) if said else ""
    return markupsafe.Markup(f'{head}{text} style="width:100%;{widest}">{body}')
