"""Papers are tested with the synthetic result files of the report's tests."""

from tests.report.conftest import only_svg, write_run

__all__ = ["only_svg", "write_run"]
