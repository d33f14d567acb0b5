"""What is seen of a sweep while it runs: a line per ended run; on a terminal, the others."""

import threading
import time
from typing import Any

from mpmbench.runs.sweep import display
from mpmbench.runs.sweep.ledger import Ledger
from mpmbench.runs.sweep.plan import Plan
from mpmbench.say import BELOW, in_lines, say, visible

LOOK_EVERY = 0.1  # seconds
MOST_SHOWN = 8  # runs under way that are listed one by one


class View:
    """Follows a ledger in a thread of its own, under every launcher alike.

    On a terminal a few lines at the bottom say what is done, runs and failed, and how long the rest
    may take; they have no colours when the environment has ``NO_COLOR``. Elsewhere there are plain
    lines only.
    """

    def __init__(self, ledger: Ledger) -> None:
        self.ledger = ledger
        self.plan = Plan()
        self.settings: dict[str, str] = {}  # that tell runs of the same name apart
        self.shown: dict[str, bool] = {}  # whether each run failed that has ended
        self.since: dict[str, float] = {}  # when each run was first seen under way
        self.began = 0.0
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        self._terminal: Any = None

    def begin(self, plan: Plan) -> None:
        """Say what is planned, and start to follow."""
        say(*in_lines(display.plan_line(plan), BELOW))
        for cell in plan.cells():
            if cell.damage:
                what = f"damaged, to be computed again: {cell.name}: {cell.damage}"
                say(*in_lines(what, BELOW))
        differing = display.comparison(plan)
        if differing and plan.to_run:
            say(*differing.splitlines())
        self.plan, self.settings, self.began = plan, plan.told_apart(), time.monotonic()
        if not plan.to_run:
            return
        if display.on_terminal():
            from rich.console import Console
            from rich.live import Live

            console = Console(highlight=False)
            self._terminal = Live(console=console, refresh_per_second=5, transient=True)
            self._terminal.start()
        self._thread = threading.Thread(target=self._follow, daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Show what is left to be shown, and stop."""
        if self._thread is not None:
            self._ended.set()
            self._thread.join()
            self._thread = None
            self._look()
        if self._terminal is not None:
            self._terminal.stop()
            self._terminal = None

    def _follow(self) -> None:
        while not self._ended.wait(LOOK_EVERY):
            self._look()

    def _look(self) -> None:
        running = self.ledger.running()
        if not self.shown and not running:
            self.began = time.monotonic()  # kernels may be compiled first
        for name in self.ledger.ended(self.shown):
            record = self.ledger.record(name)
            self.shown[name] = record.failed
            counts = len(self.shown), len(self.plan.to_run)
            lines = display.line(record, *counts, self.settings.get(name, "")).splitlines()
            if self._terminal is not None:
                text = "\n".join(map(visible, lines))
                colour = "red" if record.failed else None
                self._terminal.console.print(text, style=colour, markup=False)
            else:
                say(*lines)
        if self._terminal is not None:
            from rich.text import Text

            self._terminal.update(Text(self.status(running)))

    def status(self, running: dict[str, float]) -> str:
        """The lines at the bottom: totals, and the runs under way with how far each is."""
        now = time.monotonic()
        self.since = {name: self.since.get(name, now) for name in running}
        failed = sum(self.shown.values())
        done = f"{len(self.shown)} of {len(self.plan.to_run)} done"
        left = self.time_left(running)
        rest = f"{duration(now - self.began)} so far"
        if left is not None:
            rest = f"about {duration(left)} left"
        lines = [f"{done}, {len(running)} running, {failed} failed, {rest}"]
        for name, fraction in list(running.items())[:MOST_SHOWN]:
            lines.append(f"  {name:<48} {fraction:4.0%}  {duration(now - self.since[name])}")
        if len(running) > MOST_SHOWN:
            lines.append(f"  and {len(running) - MOST_SHOWN} more")
        return "\n".join(lines)

    def time_left(self, running: dict[str, float]) -> float | None:
        """Seconds that the rest may take, by the work that is done; None before there is any."""
        work = {cell.name: cell.work for cell in self.plan.to_run}
        fractions = running | dict.fromkeys(self.shown, 1.0)
        done = sum(work.get(name, 0.0) * fraction for name, fraction in fractions.items())
        if done <= 0.0:
            return None
        return (time.monotonic() - self.began) * (sum(work.values()) - done) / done


def duration(seconds: float) -> str:
    """A time for people: ``8 s``, ``3 min``, ``2 h 5 min``."""
    if seconds < 100:
        return f"{max(0.0, seconds):.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"
