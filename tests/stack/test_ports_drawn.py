"""Systems that start at the same time do not draw the same port for their hubs."""

from __future__ import annotations

import subprocess
import sys

import pytest

from regraft.system import launch
from regraft.system.launch import NoPort, free_endpoint
from tests.support.machine.ports import free_port
from tests.support.waiting import PATIENCE

DRAWS = "from regraft.system import launch; launch.PORTS = range({first}, {first} + 1); launch.free_endpoint()"


def test_a_port_that_was_drawn_is_not_drawn_again_before_it_is_listened_at(monkeypatch: pytest.MonkeyPatch) -> None:
    first = free_port()
    monkeypatch.setattr(launch, "PORTS", range(first, first + 1))
    assert free_endpoint() == f"tcp/127.0.0.1:{first}"
    with pytest.raises(NoPort):
        free_endpoint()
    other = subprocess.run(
        [sys.executable, "-c", DRAWS.format(first=first)], capture_output=True, text=True, timeout=PATIENCE
    )
    assert "NoPort" in other.stderr
