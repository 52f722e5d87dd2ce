"""Fifty kills of the adaptation manager, at random instants of a stream of adaptations of all kinds."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.conftest import HEAD
from tests.host.processes.killing import STACK, TOPICS, adapt_through_kills
from tests.support.systems import System

pytestmark = [pytest.mark.evidence, pytest.mark.alone, pytest.mark.timeout(1800)]


@pytest.mark.parametrize("seed", [7, 8])
def test_adaptations_survive_fifty_kills_of_the_manager(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    stack = tmp_path / "stack.yaml"
    stack.write_text(HEAD.replace("  ticks: {type: host_tests/Tick}\n", TOPICS) + STACK)
    system = System(stack)
    try:
        stream = adapt_through_kills(system, kills=50, seed=seed)
    finally:
        system.end()
    print(f"seed {seed}: {len(stream.applied)} adaptations applied, {stream.interrupted} interrupted and undone")
    assert stream.interrupted > 0
