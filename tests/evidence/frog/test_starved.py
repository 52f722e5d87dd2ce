"""Twelve busy loops on a machine of two cores: a slow machine makes a run slow, never wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.adaptation import Outcome, Swap
from tests.evidence.test_swapping import GOOD, PATIENT
from tests.host.adapting.test_swap import HEAD, NOTHING, adapt, faults, hears_on
from tests.support.frog import Load, run_frog
from tests.support.systems import System

pytestmark = [pytest.mark.evidence, pytest.mark.alone, pytest.mark.timeout(14_400)]

BUSY, STARTS, SWAPS, RUNS = 12, 200, 200, 20
RELAY = ("source", "totaller", "sink", "adaptation_manager")


@pytest.fixture
def stack(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a source at 1 kHz, a totaller, a sink that checks every message, and a manager."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    path = tmp_path / "stack.yaml"
    path.write_text(HEAD + PATIENT)
    return path


def _flowing(stack: Path) -> System:
    system = System(stack)
    for name in RELAY:
        system.wait_running(name)
    hears_on(system, 50)
    return system


def _said_lost(stack: Path) -> list[str]:
    """Return what any component has said of lost messages, from its start on."""
    logs = (stack.parent / "home" / "tests" / "logs").glob("*.log")
    return [line for log in logs for line in log.read_text().splitlines() if "message.lost" in line]


def test_two_hundred_starts_lose_nothing_at_1_khz(stack: Path) -> None:
    with Load(BUSY):
        for _ in range(STARTS):
            system = _flowing(stack)
            try:
                assert faults(system) == NOTHING
            finally:
                system.end()
            assert _said_lost(stack) == []


def test_two_hundred_swaps_lose_nothing_at_1_khz(stack: Path) -> None:
    with Load(BUSY):
        system = _flowing(stack)
        try:
            for number in range(SWAPS):
                report = adapt(system, Swap("totaller", GOOD[number % 2]))
                assert report.outcome is Outcome.APPLIED, (report.outcome, report.error, report.steps)
            hears_on(system, 50)
            assert faults(system) == NOTHING
        finally:
            system.end()
        assert _said_lost(stack) == []


def test_twenty_runs_of_frog_have_the_digest_of_a_run_alone(tmp_path: Path) -> None:
    def digest() -> str:
        run = run_frog(tmp_path, 30, "--speed", "max", "--seed", "3", renderer="")
        assert run.code == 0, run.errors
        assert run.summary["dropped"] == []
        return str(run.summary["digest"])

    alone = digest()
    with Load(BUSY):
        for number in range(RUNS):
            assert digest() == alone, number
