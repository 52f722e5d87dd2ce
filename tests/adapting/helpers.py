"""Test equipment: trees with adapt decorators, and an adaptation manager that answers when the test says so."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

from behavior_tree import (
    Blackboard,
    ManualClock,
    Node,
    NodeSetup,
    Registry,
    StatefulAction,
    Status,
    Tree,
    load_text,
    status_from_name,
)
from regraft import CallFailed
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.management.manager import ArchitectureRequest
from regraft.bus_schema.messages.planning import Proposal, ProposalRequest
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Outcome, SetParameters, Violation
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.description import Description, ParameterDescription
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.robots.scoped_changes import Names
from regraft.component.future import Future
from regraft.services.bt_executor.adaptation import ADAPT_DECORATORS
from regraft.services.bt_executor.leaves.context import Asked


def small_architecture() -> Architecture:
    """A navigator, a detector, a lamp that is inactive, and a horn that is not configured."""
    parameters = (
        ParameterDescription("max_velocity", 0.26, {"type": "number"}),
        ParameterDescription("mode", "wary", {"type": "string"}),
    )
    navigator = Description("a:Navigator", "", parameters=parameters)
    detector = Description("a:Detector", "", parameters=(ParameterDescription("pictures", 1, {"type": "integer"}),))
    specs = (
        ComponentSpec("navigator", description=navigator),
        ComponentSpec("detector", connections={"image": "camera/image"}, description=detector),
        ComponentSpec("lamp", state=State.INACTIVE, description=Description("a:Lamp", "")),
        ComponentSpec("horn", state=State.UNCONFIGURED, description=Description("a:Horn", "")),
    )
    return Architecture("t", 1, False, {spec.name: spec for spec in specs}, {})


def speed_change(speed: float) -> SetParameters:
    """Return the change that gives the navigator a speed."""
    return SetParameters("navigator", {"max_velocity": speed})


@dataclass
class Pending:
    """A request that nobody has answered yet."""

    service: str
    request: Any
    waiting: Future[Any]
    until: float


@dataclass
class FakeContext:
    """What decorators have of an executor, with a manager that answers at once, or when the test says so.

    ``fates`` says how the next adaptations end, then all are applied. With ``answers`` False everything waits.
    """

    clock: ManualClock = field(default_factory=ManualClock)
    answers: bool = True
    fates: list[Outcome | CallFailed] = field(default_factory=list)
    proposals: list[Proposal] = field(default_factory=list)
    architecture: Architecture = field(default_factory=small_architecture)
    asked: list[Any] = field(default_factory=list)
    pending: list[Pending] = field(default_factory=list)
    book: tuple[Quality, ...] = ()
    wakes: int = 0
    names: Names = field(default_factory=Names)
    services: list[str] = field(default_factory=list)
    published: Architecture | None = None
    revision: int = 0

    def __post_init__(self) -> None:
        self.kit = SimpleNamespace(log=logging.getLogger("adapting"), now=self.clock.now)
        self.qualities = SimpleNamespace(current=lambda: self.book)

    @property
    def adaptations(self) -> list[AdaptationRequest]:
        """The adaptations asked for so far."""
        return [request for request in self.asked if isinstance(request, AdaptationRequest)]

    @property
    def asked_for(self) -> list[dict[str, Any]]:
        """The parameters that the adaptations so far were to set."""
        changes = [change for request in self.adaptations for change in request.changes]
        return [change.parameters for change in changes if isinstance(change, SetParameters)]

    @property
    def proposed(self) -> list[ProposalRequest]:
        """The requests to planners so far."""
        return [request for request in self.asked if isinstance(request, ProposalRequest)]

    def call(self, service: str, request: object, reply: type, *, timeout: float) -> Asked[Any]:
        codec.to_plain(request)
        self.asked.append(request)
        self.services.append(service)
        waiting: Future[Any] = Future()
        self.pending.append(Pending(service, request, waiting, self.clock.now() + timeout))
        if self.answers:
            self.answer()
        return Asked(waiting, None, self._wake)

    def know_revision(self, revision: int) -> None:
        self.revision = revision

    def published_architecture(self) -> Architecture | None:
        return self.published if self.published and self.published.revision >= self.revision else None

    def publish(self) -> None:
        """Publish the architecture as it is now."""
        self.published = self.architecture

    def _wake(self) -> None:
        self.wakes += 1

    def advance(self, seconds: float) -> None:
        """Let time pass; who was not answered by then never is."""
        self.clock.advance(seconds)
        for pending in [each for each in self.pending if each.until <= self.clock.now() + 1e-9]:
            self.pending.remove(pending)
            pending.waiting.fail(CallFailed(pending.service, None, "no answer"))

    def answer(self) -> None:
        """Answer all that is asked."""
        waiting, self.pending = self.pending, []
        for pending in waiting:
            answer = self._answer(pending.request)
            if isinstance(answer, CallFailed):
                pending.waiting.fail(answer)
            else:
                pending.waiting.resolve(answer)

    def _answer(self, request: Any) -> Any:
        if isinstance(request, ArchitectureRequest):
            return self.architecture
        if isinstance(request, AdaptationRequest):
            return self.carried_out(request)
        return self.proposals.pop(0)

    def carried_out(self, request: AdaptationRequest) -> AdaptationReport | CallFailed:
        """Do what the next fate says."""
        fate = self.fates.pop(0) if self.fates else Outcome.APPLIED
        if isinstance(fate, CallFailed):
            return fate
        violations: tuple[Violation, ...] = ()
        before = self.architecture.revision
        if request.revision not in (None, before):
            fate, violations = Outcome.REJECTED, (Violation(None, "", "revision", "is stale"),)
        elif fate is Outcome.REJECTED:
            violations = (Violation(0, "navigator", "parameters", "must not be"),)
        if fate is Outcome.APPLIED:
            self.change(*request.changes)
        error = "it broke" if fate in (Outcome.ROLLED_BACK, Outcome.STUCK) else ""
        return AdaptationReport(
            "1", fate, request, before, self.architecture.revision, 0.0, violations=violations, error=error
        )

    def carried_out_request(self, *changes: Any) -> AdaptationReport:
        """Do what the next fate says with changes that a planner asks for."""
        report = self.carried_out(AdaptationRequest(changes))
        assert isinstance(report, AdaptationReport)
        return report

    def change(self, *changes: Any) -> None:
        """Change the architecture, as the manager would or behind everybody's back."""
        architecture = self.architecture
        for change in changes:
            spec = architecture.components[change.component]
            if isinstance(change, SetParameters):
                parameters = {**spec.parameters, **change.parameters}
                made = ComponentSpec(
                    spec.name, parameters=parameters, connections=spec.connections, description=spec.description
                )
                architecture = architecture.with_component(made)
        self.architecture = Architecture("t", architecture.revision + 1, False, architecture.components, {})


class Scripted(StatefulAction):
    """Does what it is told, tick by tick, and counts its ticks; the last status is repeated."""

    statuses: list[Status]

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self.statuses = [status_from_name("RUNNING")]
        self.at = 0
        self.starts = self.ticks = self.halts = 0

    def on_start(self) -> Status:
        self.starts += 1
        self.at = 0
        return self.on_running()

    def on_running(self) -> Status:
        self.ticks += 1
        status = self.statuses[min(self.at, len(self.statuses) - 1)]
        self.at += 1
        return status

    def on_halted(self) -> None:
        self.halts += 1


@dataclass
class Bench:
    """A tree with one decorator named ``adapt`` above one scripted child."""

    context: FakeContext
    tree: Tree
    child: Scripted
    node: Any

    def tick(self, seconds: float = 0.0) -> str:
        """Let time pass, tick once; returns the status of the decorator as the tree sees it."""
        self.context.advance(seconds)
        status = self.tree.tick_once(20)
        return ("IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED")[status]

    def ticks(self, count: int, seconds: float = 0.1) -> list[str]:
        """Tick several times."""
        return [self.tick(seconds) for _ in range(count)]

    def end(self, most: int = 50) -> list[str]:
        """Tick until the decorator is not running any more; returns what it returned."""
        seen = [self.tick(0.1)]
        while seen[-1] == "RUNNING" and len(seen) < most:
            seen.append(self.tick(0.1))
        return seen

    def set(self, **entries: Any) -> None:
        """Write blackboard entries."""
        for key, value in entries.items():
            self.tree.blackboard.set(key, value)

    def entry(self, key: str) -> Any:
        """Read a blackboard entry, None if there is nothing."""
        found = self.tree.blackboard.find(key)
        return found.value if found else None

    @property
    def idle(self) -> bool:
        """Whether nothing is left under way."""
        return self.tree.next_wake_up() is None and not self.node.under_way.busy and self.node.status == 0


def bench(
    node_type: str,
    ports: str = "",
    child: str = "RUNNING",
    *,
    classes: tuple[type[Node], ...] = (),
    context: FakeContext | None = None,
    **entries: Any,
) -> Bench:
    """Make a tree with one decorator; ``child`` says what its child does, as in ``RUNNING RUNNING SUCCESS``."""
    context = context or FakeContext()
    xml = (
        '<root BTCPP_format="4"><BehaviorTree ID="Main">\n'
        f'<{node_type} name="adapt" {ports}>\n<Scripted name="child"/>\n</{node_type}></BehaviorTree></root>'
    )
    board = Blackboard(clock=context.clock)
    for key, value in entries.items():
        board.set(key, value)
    tree = load_text(xml, registry(context, classes), blackboard=board)
    made = tree.node("child")
    assert isinstance(made, Scripted)
    made.statuses = [status_from_name(name) for name in child.split()]
    return Bench(context, tree, made, tree.node("adapt"))


def registry(context: FakeContext, classes: tuple[type[Node], ...] = ()) -> Registry:
    """Return the node types."""
    known = Registry()
    known.register(Scripted)
    for cls in (*ADAPT_DECORATORS, *classes):
        known.register(cls, context=context)
    return known
