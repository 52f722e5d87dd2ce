"""Systems whose processes are killed at random instants, those that start them too: nothing stays."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from regraft import run_directory
from tests.attack.tally import Tally
from tests.hostile.conftest import HEAD, SINK, SOURCE
from tests.support.machine.processes import children_of, kill, wait_gone
from tests.support.systems import System
from tests.support.waiting import wait_until

pytestmark = [pytest.mark.attack, pytest.mark.timeout(600)]

TIMES = 20


def test_whoever_is_killed_nothing_stays_and_the_next_system_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, chance: random.Random, tally: Tally
) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    (tmp_path / "stack.yaml").write_text(HEAD + SOURCE + SINK)
    for number in range(TIMES):
        with tally.one("all that started a system killed", f"number {number}"):
            system = System(tmp_path / "stack.yaml")
            system.wait_running(chance.choice(("source", "sink")))
            family = [system.process.pid, *children_of(system.process.pid)]
            victims = chance.sample(family, chance.randint(1, len(family)))
            for pid in dict.fromkeys((*victims, system.process.pid)):
                kill(pid)
            system.process.wait()
            wait_gone(family)
            wait_until(lambda: not run_directory.running(), "what was just being started to end, too")
            system.client.close()
