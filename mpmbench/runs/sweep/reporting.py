"""The command ``report``, and the report at the end of a sweep."""

import sys
from pathlib import Path

from mpmbench.runs.sweep.display import shorten
from mpmbench.settings.schema import PACKAGE, BadInput


def is_current(page: Path, folder: Path) -> bool:
    """Whether a page is younger than all results and than the code that makes pages."""
    sources = [
        file
        for room in ("report", "analysis")
        for file in (PACKAGE / room).iterdir()
        if file.is_file()
    ]
    return page.exists() and all(
        page.stat().st_mtime > file.stat().st_mtime for file in [*folder.glob("*.nc"), *sources]
    )


def build(folder: Path, only_when_older: bool = False) -> bool:
    """Write the report of a folder of results and say where it is; a report that fails loses no run."""
    page = folder / "report" / "index.html"
    if only_when_older and is_current(page, folder):
        print(f"report: {shorten(str(page))}")
        return True
    try:
        from mpmbench import report

        place = report.build(folder)
    except Exception as error:
        text = " ".join(f"{type(error).__name__}: {error}".split())
        print(
            f"mpmbench: the report failed ({text}); the results are in {shorten(str(folder))}, "
            f"and `python -m mpmbench report {shorten(str(folder))}` tries again",
            file=sys.stderr,
        )
        return False
    print(f"report: {shorten(str(place))}")
    return True


def main(arguments: list[str]) -> int:
    """``report RESULTS``."""
    if len(arguments) != 1:
        raise BadInput(
            "report: the folder of results is needed, for example `report results/quickstart`"
        )
    folder = Path(arguments[0])
    if not folder.is_dir():
        raise BadInput(f"report {folder}: there is no such folder")
    if not any(folder.glob("*.nc")):
        raise BadInput(f"report {folder}: there are no result files in it")
    return 0 if build(folder.absolute()) else 1
