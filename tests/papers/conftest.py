"""Papers are tested with the synthetic result files of the report's tests."""

from tests.report.conftest import write_run

__all__ = ["write_run"]
