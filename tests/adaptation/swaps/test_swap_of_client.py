"""Swaps of components that have given goals to others, under simulated time."""

from __future__ import annotations

from pathlib import Path

from regraft.bus.memory_bus import MemoryHub
from regraft.bus_schema.model.adaptation import Outcome, Swap
from regraft.bus_schema.model.architecture import Architecture, TopicSpec
from regraft.runtime.requests.request_server import RunningGoal
from tests.adaptation.host_stub import HostStub
from tests.adaptation.parts import Ticker
from tests.adaptation.system import SYSTEM, System, spec_of
from tests.handover.parts import Totaller
from tests.handover.test_given_goals import Sender
from tests.support.waiting import PATIENCE, wait_until


def _goals(system: System) -> list[RunningGoal]:
    """Return the goals that are pursued."""
    return [goal for server in system.running["totaller"].runtime.servers for goal in list(server.goals.values())]


def test_the_goal_of_a_client_that_is_swapped_ends_in_step(tmp_path: Path) -> None:
    specs = [
        spec_of("ticker", Ticker, parameters={"speed": "max"}),
        spec_of("totaller", Totaller),
        spec_of("sender", Sender),
    ]
    topics = {name: TopicSpec(name, "handover_tests/Item") for name in ("items", "config", "totals")}
    topics |= {"count": TopicSpec("count", "regraft/Twist")}
    architecture = Architecture(SYSTEM, 1, True, {spec.name: spec for spec in specs}, topics)
    hub = MemoryHub()
    system = System(hub, architecture, HostStub(hub, architecture), tmp_path / "journal.sqlite")
    system.start_manager()
    try:
        for name in ("totaller", "sender", "ticker"):
            system.start(name)
        wait_until(lambda: _goals(system), "the walk to begin")
        report = system.adapt(Swap("sender"))
        assert report.outcome is Outcome.APPLIED, report
        wait_until(lambda: not _goals(system), "the walk to end")
        told = system.client.clock(PATIENCE)
        assert told is not None
        assert told.reproducible
    finally:
        system.end()
