"""A command that is interrupted while others clean up after it."""

from contextlib import contextmanager

import pytest

from mpmbench.runs.hydra import compose
from mpmbench.runs.sweep import session
from mpmbench.runs.sweep.ledger import Ledger


@contextmanager
def cleaning_up_fails():
    try:
        yield
    finally:
        raise AttributeError("half built")


def test_an_interruption_whose_clean_up_fails_is_still_one(tmp_path, monkeypatch):
    """OmegaConf, interrupted while it composes, raises an error of its own from what it had not built yet."""

    def interrupted(*_):
        with cleaning_up_fails():
            raise KeyboardInterrupt

    monkeypatch.setattr(compose, "call_hydra", interrupted)
    with pytest.raises(KeyboardInterrupt):
        session.launch([], [], Ledger(tmp_path))

    def broken(*_):
        raise AttributeError("a fault")

    monkeypatch.setattr(compose, "call_hydra", broken)
    with pytest.raises(AttributeError, match="a fault"):
        session.launch([], [], Ledger(tmp_path))
