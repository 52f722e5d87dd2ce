"""Test equipment: a small robot, a manager that does as it is told, and a bench for the bandits."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from regraft import Component, Input, Output, Parameter, RefusalCode, RequestRefused, service
from regraft.adaptation_manager.planners.bandits.bandit_planner import BanditPlanner
from regraft.bus_schema.annotations import Connections
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.management.manager import (
    ArchitectureRequest,
    ArchitectureTag,
    ArchitectureTagRequest,
)
from regraft.bus_schema.messages.planning import Proposal, ProposalRequest
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    ChangeState,
    Connect,
    Outcome,
    SetParameters,
    Violation,
)
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, TopicSpec
from regraft.bus_schema.model.lifecycle import State, Transition, after
from regraft.component.component import class_path, describe
from regraft.testing import Rig


class Navigator(Component):
    """Drives the robot."""

    velocity = Output(Twist)
    max_velocity = Parameter(0.26, minimum=0.0, maximum=0.26, unit="m/s")
    planner = Parameter("fast", choices=("fast", "careful"))
    frame = Parameter("map", read_only=True)


class Drive(Component):
    """Turns the wheels."""

    velocity = Input(Twist)


class SmallManager(Component):
    """Speaks for the adaptation manager: changes its architecture at once, unless ``fates`` has another outcome."""

    def on_configure(self) -> None:
        self.architecture = robot()
        self.fates: list[Outcome | str] = []
        self.requests: list[AdaptationRequest] = []
        self.takes = 0.0
        self.shown = 0

    @service("adaptation_manager/architecture_tag")
    def tag(self, request: ArchitectureTagRequest) -> ArchitectureTag:
        if self.fates[:1] == ["blind"]:
            raise RequestRefused("the journal cannot be read", RefusalCode.UNAVAILABLE)
        return ArchitectureTag(str(self.architecture.revision))

    @service("adaptation_manager/architecture")
    def show(self, request: ArchitectureRequest) -> Architecture:
        self.shown += 1
        return self.architecture

    @service("adaptation_manager/adapt")
    async def adapt(self, request: AdaptationRequest) -> AdaptationReport:
        self.requests.append(request)
        await self.kit.sleep(self.takes)
        fate = self.fates.pop(0) if self.fates else Outcome.APPLIED
        if fate == "refused":
            raise RequestRefused("the queue is full", RefusalCode.QUEUE_FULL)
        if fate == "silent":
            await self.kit.sleep(1000.0)
        if fate == "overtaken":
            self.set("drive", state=State.INACTIVE)
        now = self.architecture.revision
        report = AdaptationReport("1", Outcome.APPLIED, request, now, now, self.kit.now())
        if request.revision not in (None, now):
            stale = Violation(None, "", "revision", f"revision {request.revision} is stale")
            return replace(report, outcome=Outcome.REJECTED, violations=(stale,))
        if isinstance(fate, Outcome) and fate is not Outcome.APPLIED:
            return replace(report, outcome=fate)
        for change in request.changes:
            self._make(change)
        self.architecture = replace(self.architecture, revision=now + 1)
        return replace(report, revision_after=now + 1)

    def set(self, component: str, **more: Any) -> None:
        """Let somebody else change a component."""
        spec = replace(self.architecture.components[component], **more)
        changed = self.architecture.with_component(spec)
        self.architecture = replace(changed, revision=changed.revision + 1)

    def _make(self, change: Any) -> None:
        spec = self.architecture.components[change.component]
        if isinstance(change, SetParameters):
            spec = replace(spec, parameters={**spec.parameters, **change.parameters})
        elif isinstance(change, Connect):
            spec = replace(spec, connections={**spec.connections, change.port: change.topic})
        elif isinstance(change, ChangeState):
            state = after(spec.state, change.transition)
            assert state is not None, f"{change} from {spec.state}"
            spec = replace(spec, state=state)
        self.architecture = self.architecture.with_component(spec)


def spec(cls: type[Component], name: str) -> ComponentSpec:
    """Return what an architecture says of a component of a class."""
    connections: Connections = {port.name: port.topic for port in describe(cls).ports}
    return ComponentSpec(name, class_path(cls), connections=connections, description=describe(cls))


def robot() -> Architecture:
    """Return the architecture of the small robot."""
    components = {"navigator": spec(Navigator, "navigator"), "drive": spec(Drive, "drive")}
    topics = {name: TopicSpec(name, "regraft/Twist") for name in ("velocity", "slow/velocity")}
    return Architecture("rig", 1, False, components, topics)


SPEEDS: dict[str, Any] = {"component": "navigator", "parameter": "max_velocity", "values": [0.1, 0.18, 0.26]}
WAYS: dict[str, Any] = {"component": "navigator", "parameter": "planner", "values": ["fast", "careful"]}
TOPICS: dict[str, Any] = {"component": "drive", "port": "velocity", "topics": ["velocity", "slow/velocity"]}
STATES: dict[str, Any] = {"component": "drive", "transitions": ["activate", "cleanup"]}


class Bench:
    """A bandit planner and its manager, and how one asks."""

    def __init__(self, rig: Rig, planner: BanditPlanner, manager: SmallManager) -> None:
        self.rig = rig
        self.planner = planner
        self.manager = manager

    def propose(
        self,
        strategy: str = "ucb1",
        options: Any = (SPEEDS,),
        *,
        task: str = "drive",
        apply: bool = True,
        context: Any = None,
        who: str = "",
        reason: str = "",
        **inputs: Any,
    ) -> Proposal:
        """Ask for a proposal."""
        given = {"strategy": strategy, "options": list(options) if isinstance(options, tuple) else options, **inputs}
        request = ProposalRequest(task, reason, who, apply, given, context or {})
        return self.rig.call("planners/bandits/propose", request, Proposal, timeout=60.0)

    def earn(self, proposal: Proposal, utility: float, lasting: float = 1.0) -> dict[str, Any]:
        """Let time pass under a choice, and return the credit for it."""
        begin = proposal.choice["measure_from"]
        self.rig.advance(begin + lasting - self.rig.clock.now() / 1e9)
        return {"ticket": proposal.ticket, "utility": utility, "from": begin, "to": begin + lasting}


@contextmanager
def bench(run_seed: int = 0, state: Any = None, **parameters: Any) -> Iterator[Bench]:
    """Start a planner, with a state if one is given, beside a manager."""
    with Rig(seed=run_seed) as rig:
        manager = rig.add(SmallManager, "adaptation_manager")
        if state is None:
            planner = rig.add(BanditPlanner, "bandits", parameters)
        else:
            planner = rig.add(BanditPlanner, "bandits", parameters, state=State.INACTIVE)
            planner.restore(state)
            rig.transition("bandits", Transition.ACTIVATE)
        yield Bench(rig, planner, manager)
