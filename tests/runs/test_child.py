"""What parent and child say to each other, without a process."""

from types import SimpleNamespace

import pytest

from mpmbench.runs.process import isolation, worker

LIMITS = {"setup": 600.0, "time": 600.0, "memory": 400.0}


def test_the_memory_of_a_silent_child_is_watched_all_the_time(monkeypatch):
    waits = []
    connection = SimpleNamespace(send=lambda request, within: None, receive=waits.append)
    child = isolation.Child(None, connection, 0)
    monkeypatch.setattr(isolation.Child, "memory", lambda child: 399.0 + len(waits))
    monkeypatch.setattr(isolation.Child, "end", lambda child: 0)
    with pytest.raises(isolation.Ended, match=r"limits\.memory = 400 MiB"):
        child.ask("solve", limits=LIMITS)
    assert waits == [isolation.WATCH_EVERY] * 2


def test_progress_is_told_at_once_and_then_now_and_then():
    told = []
    progress = worker.progress_to(SimpleNamespace(send=told.append))
    progress(0.0, 0.0)
    progress(0.1, 2.0)
    assert told == [("progress", 0.0, 0.0)]
