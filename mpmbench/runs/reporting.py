"""The command ``report``, and the report at the end of a sweep."""

import sys
from pathlib import Path

from mpmbench.runs.display import shorten
from mpmbench.runs.schema import BadInput


def build(folder: Path) -> bool:
    """Write the report of a folder of results and say where it is; a report that fails loses no run."""
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
        raise BadInput("report: the folder of results is needed, for example `report results/quickstart`")
    folder = Path(arguments[0])
    if not folder.is_dir():
        raise BadInput(f"report {folder}: there is no such folder")
    if not any(folder.glob("*.nc")):
        raise BadInput(f"report {folder}: there are no result files in it")
    return 0 if build(folder.absolute()) else 1
