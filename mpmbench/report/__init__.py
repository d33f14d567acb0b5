"""Reports: figures, tables and one offline page from result files. They never run anything."""

from mpmbench.report.page import build

__all__ = ["build"]
