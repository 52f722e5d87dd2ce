"""The bandits under simulated time, beside the real adaptation manager: the same in every run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from regraft import Component
from regraft.adaptation_manager.planners.bandits.bandit_planner import BanditPlanner
from regraft.bus.memory_bus import MemoryHub
from regraft.bus_schema.messages.planning import Proposal, ProposalRequest
from regraft.bus_schema.model.architecture import Architecture, TopicSpec
from regraft.runtime.core.assignment import Assignment
from tests.adaptation.host_stub import HostStub
from tests.adaptation.parts import Collector, Keeper, Ticker
from tests.adaptation.system import SYSTEM, System, in_thread, spec_of
from tests.support.waiting import wait_until

ROUNDS = 8
OPTIONS = [
    {"component": "keeper", "port": "quiet", "topics": ["count", "echo"]},
    {"component": "collector", "port": "loud", "topics": ["echo", "count"]},
]


class Asker(Component):
    """Asks for proposals, and remembers them."""

    def on_activate(self) -> None:
        """Begin to ask."""
        self.proposals: list[Proposal] = []
        self.kit.spawn(self.ask(), "asking")

    async def ask(self) -> None:
        """Ask again and again, with the credit for the last choice."""
        credit: dict[str, Any] = {}
        for turn in range(ROUNDS):
            await self.kit.sleep(0.3)
            inputs = {"strategy": "thompson", "options": OPTIONS, "settle": 0.1, **credit}
            request = ProposalRequest("listen", actor="asker", inputs=inputs)
            proposal = await self.kit.call("planners/bandits/propose", request, Proposal, timeout=5.0)
            self.proposals.append(proposal)
            await self.kit.sleep(0.5)
            begin = proposal.choice.get("measure_from", 0.0)
            earned = {"ticket": proposal.ticket, "utility": turn % 3 / 2, "from": begin, "to": self.kit.now()}
            credit = {"credit": earned} if proposal.ticket else {}


def run(folder: Path) -> list[Proposal]:
    """Run until the asker is done, and return what was proposed."""
    folder.mkdir()
    own: dict[str, type[Component]] = {"bandits": BanditPlanner, "asker": Asker}
    specs = [spec_of("ticker", Ticker, parameters={"speed": "max"}), spec_of("keeper", Keeper)]
    specs += [spec_of("collector", Collector), *(spec_of(name, cls) for name, cls in own.items())]
    topics = {name: TopicSpec(name, "regraft/Twist") for name in ("count", "echo")}
    architecture = Architecture(SYSTEM, 1, True, {spec.name: spec for spec in specs}, topics)
    hub = MemoryHub()
    system = System(hub, architecture, HostStub(hub, architecture), folder / "journal.sqlite")
    system.start_manager()
    try:
        system.start("collector")
        system.start("keeper")
        for name, cls in own.items():
            others = tuple(other for other in architecture.components if other != name)
            assignment = Assignment(SYSTEM, name, specs[-1].cls, simulated=True, seed=4, members=others, revision=1)
            system.running[name] = in_thread(hub, cls, assignment)
            system.host.started(name, 1)
        system.start("ticker")
        asker = system.running["asker"].component
        wait_until(lambda: len(getattr(asker, "proposals", ())) == ROUNDS)
        return list(asker.proposals)
    finally:
        system.end()


def seen(proposal: Proposal) -> Any:
    """Return a proposal without what is measured by the wall clock."""
    report = proposal.report
    return proposal.choice, proposal.changes, proposal.ticket, report and (report.outcome, report.tick, report.started)


def test_proposals_in_step_are_applied_in_no_time_and_are_the_same_in_every_run(tmp_path: Path) -> None:
    first = run(tmp_path / "one")
    assert all(proposal.ticket for proposal in first)
    assert any(proposal.report for proposal in first)
    assert all(proposal.choice["credit"]["credited"] for proposal in first[1:])
    assert len({proposal.choice["option"]["keeper.quiet"] for proposal in first}) == 2
    assert [seen(proposal) for proposal in run(tmp_path / "two")] == [seen(proposal) for proposal in first]
