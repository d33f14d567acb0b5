"""Set up before anything imports numba: kernels compiled by the tests and by the program share one cache."""

import atexit
import os
import shutil
import tempfile

from mpmbench.runs.process.environment import prepare

prepare(os.environ)
# Where this is set, each of the processes that tests start, some hundred, compiles all sources again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# Turns are taken among the runs of the tests, not with campaigns that happen to run on this
# machine.
os.environ["XDG_RUNTIME_DIR"] = tempfile.mkdtemp(prefix="mpmbench-tests-")
atexit.register(shutil.rmtree, os.environ["XDG_RUNTIME_DIR"], ignore_errors=True)


def pytest_terminal_summary(terminalreporter):
    """Print what the tests of hostile input have counted (`tests/hostile`)."""
    reports = [one for found in terminalreporter.stats.values() for one in found]
    called = [one for one in reports if getattr(one, "when", "") == "call"]
    rows = [row for one in called for name, row in one.user_properties if name == "counts"]
    if rows:
        terminalreporter.section("counts")
        terminalreporter.write_line(f"{'asked':>7} {'found':>7}")
        for what, asked, found in rows:
            mark = "" if asked == found else "  <-- differs"
            terminalreporter.write_line(f"{asked:7} {found:7}  {what}{mark}")
