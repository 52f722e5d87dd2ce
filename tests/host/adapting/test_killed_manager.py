"""A manager that is killed while it adapts real processes loses nothing, doubles nothing, leaves nothing half-done."""

from __future__ import annotations

import pytest

from tests.host.conftest import HEAD, Start
from tests.host.processes.killing import STACK, TOPICS, adapt_through_kills

pytestmark = pytest.mark.slow


def test_adaptations_survive_five_kills_of_the_manager(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.host.conftest.HEAD", HEAD.replace("  ticks: {type: host_tests/Tick}\n", TOPICS))
    stream = adapt_through_kills(start(STACK), kills=5, seed=1)
    assert len(stream.applied) > 2
