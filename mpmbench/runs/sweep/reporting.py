"""The report at the end of a sweep."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from mpmbench.runs.sweep.display import shorten
from mpmbench.say import say
from mpmbench.settings.files import PACKAGE


def is_wanted(config: dict[str, Any], sweep: bool) -> bool:
    """Whether the report of a campaign is to be written: by default after a sweep."""
    return sweep if config["report"] == "auto" else bool(config["report"])


def is_younger(page: Path, files: Iterable[Path]) -> bool:
    """Whether a page has been written after all of these files."""
    return all(page.stat().st_mtime > file.stat().st_mtime for file in files)


def build(folder: Path, only_when_older: bool = False) -> bool:
    """Write the report of a folder and say where it is; one that fails loses no run."""
    page = folder / "report" / "index.html"
    rooms = [PACKAGE / room for room in ("report", "analysis")]
    sources = [file for room in rooms for file in room.iterdir() if file.is_file()]
    if only_when_older and page.exists() and is_younger(page, [*folder.glob("*.nc"), *sources]):
        say(f"report: {shorten(str(page))}")
        return True
    try:
        from mpmbench import report

        place = report.build(folder)
    except Exception as error:
        text = " ".join(f"{type(error).__name__}: {error}".split())
        results = shorten(str(folder))
        say(
            f"mpmbench: the report failed ({text}); the results are in {results}, "
            f"and `python -m mpmbench report {results}` tries again",
            error=True,
        )
        return False
    say(f"report: {shorten(str(place))}")
    return True
