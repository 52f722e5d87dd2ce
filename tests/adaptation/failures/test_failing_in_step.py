"""A component that fails by itself under simulated time does so at the same place in every run, and comes back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from regraft import Component, Input, Output
from regraft.bus.memory_bus import MemoryHub
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, ChangeState, Outcome
from regraft.bus_schema.model.architecture import Architecture, TopicSpec
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.host_stub import HostStub
from tests.adaptation.parts import ADAPT, Ticker
from tests.adaptation.system import SYSTEM, System, spec_of
from tests.support.waiting import PATIENCE, wait_until

LAST = 17


class Wearing(Component):
    """Passes numbers on, and fails at one of them, after it has passed it on."""

    loud = Input(Twist, topic="echo")
    worn = Output(Twist)

    @loud.handler
    def hear(self, message: Twist) -> None:
        self.worn.publish(message)
        if message.linear.x == LAST:
            self.kit.fail("it is worn out")


class Witness(Component):
    """Keeps what comes, and when."""

    worn = Input(Twist)

    def on_configure(self) -> None:
        self.seen: list[tuple[float, int]] = []

    @worn.handler
    def hear(self, message: Twist) -> None:
        self.seen.append((self.kit.now(), int(message.linear.x)))


class Mender(Component):
    """Brings the worn part back at a certain time."""

    def on_activate(self) -> None:
        self.reports: list[AdaptationReport] = []
        self.kit.spawn(self.mend(), "mending")

    async def mend(self) -> None:
        await self.kit.sleep(2.0)
        changes = tuple(ChangeState("wearing", way) for way in (Transition.CONFIGURE, Transition.ACTIVATE))
        request = AdaptationRequest(changes, actor="mender")
        self.reports.append(await self.kit.call(ADAPT, request, AdaptationReport, timeout=PATIENCE))


def _run(folder: Path) -> tuple[list[tuple[float, int]], list[tuple[Any, ...]], list[tuple[float, str, Any]]]:
    folder.mkdir()
    specs = [
        spec_of("ticker", Ticker, parameters={"speed": "max"}),
        spec_of("wearing", Wearing),
        spec_of("witness", Witness),
        spec_of("mender", Mender),
    ]
    topics = {name: TopicSpec(name, "regraft/Twist") for name in ("count", "echo", "worn")}
    architecture = Architecture(SYSTEM, 1, True, {spec.name: spec for spec in specs}, topics)
    hub = MemoryHub()
    system = System(hub, architecture, HostStub(hub, architecture), folder / "journal.sqlite")
    try:
        system.start_manager()
        for name in ("wearing", "witness", "mender", "ticker"):
            system.start(name)
        mender, witness = system.running["mender"].component, system.running["witness"].component
        wait_until(lambda: getattr(mender, "reports", ()))
        (report,) = mender.reports
        assert report.outcome is Outcome.APPLIED, report
        assert system.view("wearing").state is State.ACTIVE
        wait_until(lambda: len(witness.seen) > LAST + 20)
        kinds = ("component.failed", "component.recovered")
        wait_until(lambda: len([event for event in system.events if event.kind in kinds]) == 2)
        told = [(event.stamp, event.kind, event.details["code"]) for event in system.events if event.kind in kinds]
        return witness.seen[: LAST + 20], [(report.tick, report.started)], told
    finally:
        system.end()


def test_a_component_fails_at_the_same_place_in_every_run_and_comes_back_when_it_is_asked_to(tmp_path: Path) -> None:
    seen, ends, told = _run(tmp_path / "one")
    numbers = [number for _, number in seen]
    assert numbers[:LAST][-1] <= LAST < numbers[numbers.index(LAST) + 1] - 1, "it was silent for a while"
    assert [(kind, code) for _, kind, code in told] == [
        ("component.failed", "failed"),
        ("component.recovered", "configured"),
    ]
    assert _run(tmp_path / "two") == (seen, ends, told)
