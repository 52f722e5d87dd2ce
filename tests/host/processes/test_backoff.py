"""How long a host waits before it starts a component again."""

from __future__ import annotations

import pytest

from regraft.bus_schema.model.architecture import RestartPolicy
from regraft.host.runs.restart_backoff import RestartHistory


@pytest.mark.parametrize(
    ("backoff", "waits"),
    [(0.0, [0.0, 0.0, 0.0]), (1.0, [1.0, 2.0, 4.0, 8.0, 10.0]), (30.0, [30.0, 30.0]), (60.0, [60.0, 60.0])],
)
def test_a_wait_doubles_to_ten_seconds_or_stays_at_its_policys(backoff: float, waits: list[float]) -> None:
    history = RestartHistory(RestartPolicy(limit=10, window=86400.0, backoff=backoff))
    assert [history.next_start(0.0) for _ in waits] == waits
