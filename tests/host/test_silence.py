"""What counts as silence of a loop."""

from __future__ import annotations

import os

import pytest

from regraft.host import silence
from regraft.host.silence import HUNG_AFTER, Silence

STEP = 0.05


def _hung_after(taken_a_second: float, monkeypatch: pytest.MonkeyPatch) -> float:
    """Return the seconds after which a silent loop is found while processors are taken from the machine."""
    now, watched = 100.0, Silence()
    monkeypatch.setattr(silence, "stolen", lambda: (now - 100.0) * taken_a_second)
    monkeypatch.setattr(silence, "processor_wait", lambda pid: 0.0)
    watched.watch("loop/1", os.getpid(), 0.3, now)
    while not watched.hung(now, None):
        now += STEP
    return now - 100.0


def test_time_that_was_taken_from_the_machine_is_nobodys_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    assert HUNG_AFTER <= _hung_after(0.0, monkeypatch) <= HUNG_AFTER + 2 * STEP
    assert _hung_after(0.8, monkeypatch) > 2 * HUNG_AFTER


def test_a_hung_loop_is_found_on_a_machine_that_gets_no_time_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _hung_after(1.5, monkeypatch) < silence.MOST_FORGIVEN + HUNG_AFTER + 1.0
