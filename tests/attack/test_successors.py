"""Successors that fail at every stage, in random order, at a thousand messages a second: nobody notices."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft.bus_schema.model.adaptation import Outcome, Swap
from tests.attack.tally import Tally
from tests.evidence.test_swapping import CALLER, OFTEN
from tests.host.adapting.test_swap import HEAD, NOTHING, STACK, adapt, faults, hears_on
from tests.support.systems import System

pytestmark = [pytest.mark.attack, pytest.mark.timeout(900)]

TIMES = 60
GOOD = {"succeeds": "tests.handover.parts:Doubler", "goes back": "tests.handover.parts:Totaller"}
BAD = {
    "ends as it is configured": "tests.host.parts:StillbornTotaller",
    "cannot be configured": "tests.adaptation.swaps.swappable:Broken",
    "cannot take the state": "tests.handover.parts:Unable",
    "is killed with the state": "tests.handover.parts:DiesRestoring",
    "hangs with the state": "tests.handover.parts:HangsRestoring",
    "cannot be activated": "tests.adaptation.swaps.swappable:Lame",
}


@pytest.fixture
def running(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[System]:
    """Return a source at 1 kHz, a totaller that is called 200 times a second, a sink that checks all, a manager."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    (tmp_path / "stack.yaml").write_text(HEAD + STACK + OFTEN + CALLER)
    system = System(tmp_path / "stack.yaml")
    for name in ("source", "totaller", "sink", "caller", "adaptation_manager"):
        system.wait_running(name)
    hears_on(system, 50)
    yield system
    system.end()


def test_a_successor_that_fails_at_any_stage_is_not_missed(
    running: System, chance: random.Random, tally: Tally
) -> None:
    for number in range(TIMES):
        stage, cls = chance.choice([*GOOD.items(), *BAD.items()])
        with tally.one(f"successor {stage}", f"number {number}"):
            report = adapt(running, Swap("totaller", cls))
            wanted = Outcome.APPLIED if stage in GOOD else Outcome.ROLLED_BACK
            assert report.outcome is wanted, report
            assert faults(running) == NOTHING
