"""Reports: figures, tables and one offline HTML page from the result files of a campaign. Never runs anything."""

from mpmbench.report.page import build

__all__ = ["build"]
