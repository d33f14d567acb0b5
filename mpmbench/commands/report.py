"""The command ``report``: figures and tables of a folder of results."""

from pathlib import Path

from mpmbench.commands.places import results_in
from mpmbench.runs.sweep import reporting
from mpmbench.settings.schema import BadInput


def main(arguments: list[str]) -> int:
    """``report RESULTS``."""
    if len(arguments) != 1:
        raise BadInput(
            "report: the folder of results is needed, for example `report results/quickstart`"
        )
    folder = Path(arguments[0])
    results_in("report", folder)
    return 0 if reporting.build(folder.absolute()) else 1
