"""Ten minutes beside four busy processes: nobody is taken for hung."""

from __future__ import annotations

import pytest

from tests.frog.conftest import StartFrog
from tests.support.frog import Load, pause

pytestmark = [pytest.mark.evidence, pytest.mark.alone, pytest.mark.timeout(3600)]


def test_no_false_restart_in_ten_minutes_beside_four_busy_processes(start_frog: StartFrog) -> None:
    frog = start_frog("--speed", "real")
    with Load(4):
        pause(600.0)
    assert all(process.restarts == 0 for process in frog.processes().values())
    assert frog.clock().reproducible
    assert not [event for event in frog.events if event.kind.startswith("component.") and "restart" in event.kind]
