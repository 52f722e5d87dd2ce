"""Managers killed at random instants and at every step: wholly before, or wholly after."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from regraft.bus_schema.model.adaptation import Outcome, SetParameters
from tests.adaptation.failures.test_restored import as_told, some_change, some_way
from tests.adaptation.system import System as SmallSystem
from tests.attack.tally import Tally
from tests.host.conftest import HEAD
from tests.host.processes.killing import STACK, TOPICS, adapt_through_kills
from tests.support.systems import System

pytestmark = [pytest.mark.attack, pytest.mark.timeout(900)]

AWAKE = (0.0, 0.5)
KILLS = 100
WAYS = 40


@pytest.mark.parametrize("part", range(3))
def test_adaptations_survive_kills_of_their_manager(
    part: int, seed: int, tally: Tally, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    (tmp_path / "stack.yaml").write_text(HEAD.replace("  ticks: {type: host_tests/Tick}\n", TOPICS) + STACK)
    system = System(tmp_path / "stack.yaml")
    try:
        stream = adapt_through_kills(system, KILLS, seed, AWAKE)
    finally:
        system.end()
    tally.many("manager killed at a random instant", KILLS)
    tally.many("adaptations through these kills", len(stream.applied))


@pytest.mark.parametrize("part", range(5))
def test_whatever_is_asked_and_however_it_ends_what_runs_is_what_the_architecture_says(
    part: int, system: SmallSystem, chance: random.Random, tally: Tally, monkeypatch: pytest.MonkeyPatch
) -> None:
    system.adapt(SetParameters("fragile", {"mood": "refuses"}))
    for number in range(WAYS):
        changes = [some_change(chance) for _ in range(chance.randint(1, 3))]
        with tally.one("adaptation ended at a random step, in a random way", f"number {number}"):
            report = some_way(chance)(system, monkeypatch, *changes)
            assert report.outcome is not Outcome.STUCK, (changes, report)
            assert as_told(system), (changes, report)
