"""Test equipment: a small robot, and scripted stand-ins for the services that the gateway asks."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any

from regraft import Component, Input, Output, Parameter, Quality, RefusalCode, RequestRefused, service
from regraft.bus.interface import Bus
from regraft.bus_schema.annotations import Connections
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.management.manager import (
    ArchitectureRequest,
    CancelAdaptation,
    ConfirmAdaptation,
    JournalPage,
    JournalRequest,
    UndoAdaptation,
)
from regraft.bus_schema.messages.mission import Command, MissionCommand, MissionRequest, MissionState, MissionStatus
from regraft.bus_schema.messages.protocol.control import ControlCode, ControlError
from regraft.bus_schema.messages.protocol.host import (
    HostStatus,
    HostView,
    LogLines,
    LogRequest,
    ProcessState,
    ProcessStatus,
)
from regraft.bus_schema.messages.protocol.usage import HostUsage, RunUsage
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    ChangeState,
    Move,
    Outcome,
    SetParameters,
    StepReport,
    StepState,
    Swap,
    Violation,
)
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, TopicSpec
from regraft.bus_schema.model.lifecycle import after
from regraft.component.component import class_path, describe
from tests.support.waiting import PATIENCE


class Navigator(Component):
    """Drives the robot."""

    velocity = Output(Twist)
    max_velocity = Parameter(0.26, minimum=0.0, maximum=0.26, unit="m/s")

    speed = Quality("of driving on", unit="m/s", better="higher", minimum=0.0)

    @classmethod
    def estimate(cls, parameters: dict[str, Any], context: dict[str, Any]) -> dict[str, float]:
        return {"speed": parameters["max_velocity"]}

    def evaluate(self) -> dict[str, float]:
        return {"speed": self.max_velocity / 2.0}


class Drive(Component):
    """Turns the wheels."""

    velocity = Input(Twist)


def spec(cls: type[Component], name: str, **more: Any) -> ComponentSpec:
    """Return what an architecture says of a component of a class."""
    parameters = {p.name: p.default for p in describe(cls).parameters}
    connections: Connections = {p.name: p.topic for p in describe(cls).ports}
    return ComponentSpec(
        name, class_path(cls), parameters=parameters, connections=connections, description=describe(cls), **more
    )


def robot() -> Architecture:
    """Return the architecture of the small robot."""
    components = {"navigator": spec(Navigator, "navigator"), "drive": spec(Drive, "drive")}
    return Architecture("site", 1, False, components, {"velocity": TopicSpec("velocity", "regraft/Twist", rate=20.0)})


class ScriptedManager(Component):
    """Speaks for the adaptation manager: keeps an architecture and a journal, and moves no component."""

    def __init__(self) -> None:
        self.revisions = {1: robot()}
        self.journal_lines: list[AdaptationReport] = []
        self.waiting: tuple[AdaptationReport, ...] = ()
        self.requests: list[AdaptationRequest] = []
        self.fate: Outcome | None = None
        self.refusal: RequestRefused | None = None
        self.silent = False
        self.unreadable = False
        self.kept_waiting = threading.Event()

    @property
    def current(self) -> Architecture:
        """The architecture of the latest revision."""
        return self.revisions[max(self.revisions)]

    @service("adaptation_manager/adapt")
    async def adapt(self, request: AdaptationRequest) -> AdaptationReport:
        """Adapt."""
        self.requests.append(request)
        while self.silent:
            await self.kit.sleep(0.01)
        if self.refusal:
            raise self.refusal
        known = [line for line in self.journal_lines if request.key and line.request.key == request.key]
        if known and known[0].request != request:
            why = f"{request.key!r} belongs to adaptation {known[0].id}"
            raise RequestRefused(why, RefusalCode.KEY_REUSED, field="key")
        return known[0] if known else self._carry_out(request)

    def _carry_out(self, request: AdaptationRequest) -> AdaptationReport:
        now = self.current
        violations = tuple(self._violations(request))
        step = StepReport(1, "navigator", "set parameters", StepState.PLANNED)
        report = AdaptationReport(
            str(len(self.journal_lines) + 1), Outcome.PENDING, request, now.revision, now.revision, 0.0, steps=(step,)
        )
        if violations:
            report = replace(report, outcome=Outcome.REJECTED, violations=violations, steps=())
        elif request.dry_run:
            return replace(report, architecture=self._result(request))
        elif self.fate is Outcome.CONFIRMING:
            report = replace(report, outcome=self.fate)
        elif self.fate in (Outcome.ROLLED_BACK, Outcome.CANCELLED, Outcome.STUCK):
            report = replace(report, outcome=self.fate, error="step 1 failed: navigator did not answer")
        elif request.wait:
            self.revisions[now.revision + 1] = replace(self._result(request), revision=now.revision + 1)
            report = replace(report, outcome=Outcome.APPLIED, revision_after=now.revision + 1)
        self.journal_lines.append(report)
        return report

    def _violations(self, request: AdaptationRequest) -> list[Violation]:
        found = []
        if request.revision not in (None, self.current.revision):
            found.append(
                Violation(None, "", "revision", f"is {request.revision}, the current is {max(self.revisions)}")
            )
        for index, change in enumerate(request.changes):
            component = self.current.components.get(change.component)
            if component is None:
                found.append(Violation(index, change.component, "component", "there is no such component"))
            elif isinstance(change, SetParameters):
                unknown = sorted(change.parameters.keys() - component.parameters.keys())
                found += [Violation(index, change.component, f"parameters.{n}", "no such parameter") for n in unknown]
        return found

    def _result(self, request: AdaptationRequest) -> Architecture:
        result = self.current
        for change in request.changes:
            component = result.components[change.component]
            if isinstance(change, SetParameters):
                result = result.with_component(
                    replace(component, parameters={**component.parameters, **change.parameters})
                )
            elif isinstance(change, ChangeState):
                state = after(component.state, change.transition) or component.state
                result = result.with_component(replace(component, state=state))
            elif isinstance(change, Swap):
                result = result.with_component(replace(component, cls=change.cls or component.cls))
            elif isinstance(change, Move):
                result = result.with_component(replace(component, host=change.host))
        return result

    def _line(self, adaptation: str) -> AdaptationReport:
        return next(line for line in self.journal_lines if line.id == adaptation)

    @service("adaptation_manager/undo")
    def undo(self, request: UndoAdaptation) -> AdaptationReport:
        """Undo."""
        line = self._line(request.id)
        if line.outcome is not Outcome.APPLIED:
            raise RequestRefused(f"adaptation {line.id} was not applied: {line.outcome.value}", RefusalCode.CONFLICT)
        inverse = AdaptationRequest(
            line.request.changes,
            request.reason,
            request.actor,
            request.revision,
            request.key,
            request.dry_run,
            request.wait,
            line.id,
        )
        return self._carry_out(inverse)

    @service("adaptation_manager/cancel")
    def cancel(self, request: CancelAdaptation) -> AdaptationReport:
        """Cancel."""
        line = self._line(request.id)
        if line.outcome not in (Outcome.PENDING, Outcome.CONFIRMING):
            raise RequestRefused(f"adaptation {line.id} has ended: {line.outcome.value}", RefusalCode.CONFLICT)
        self.journal_lines[self.journal_lines.index(line)] = replace(line, outcome=Outcome.CANCELLED)
        return self._line(request.id)

    @service("adaptation_manager/confirm")
    def confirm(self, request: ConfirmAdaptation) -> AdaptationReport:
        """Confirm."""
        line = self._line(request.id)
        if line.outcome is not Outcome.CONFIRMING:
            raise RequestRefused(f"adaptation {line.id} is not being confirmed", RefusalCode.CONFLICT)
        self.journal_lines[self.journal_lines.index(line)] = replace(line, outcome=Outcome.APPLIED)
        return self._line(request.id)

    @service("adaptation_manager/journal")
    async def journal(self, request: JournalRequest) -> JournalPage:
        """Show the journal."""
        if self.unreadable:
            raise RequestRefused("the journal cannot be read", RefusalCode.UNAVAILABLE)
        if self.silent:
            await self.kit.sleep(3600.0)
        if request.before and not (request.before.isascii() and request.before.isdecimal()):
            raise RequestRefused(f"there is no adaptation {request.before!r}", RefusalCode.NOT_FOUND, field="before")
        lines = self.journal_lines[::-1]
        if request.id:
            return JournalPage(tuple(line for line in lines if line.id == request.id))
        older = [line for line in lines if not request.before or int(line.id) < int(request.before)]
        waiting = () if request.before else self.waiting
        return JournalPage(tuple(older[: request.limit]), len(older) > request.limit, waiting=waiting)

    @service("adaptation_manager/architecture")
    async def architecture(self, request: ArchitectureRequest) -> Architecture:
        """Show the architecture."""
        if self.silent:
            self.kept_waiting.set()
            await self.kit.sleep(3600.0)
        revision = max(self.revisions) if request.revision is None else request.revision
        if revision not in self.revisions:
            raise RequestRefused(f"there is no revision {revision}", RefusalCode.NOT_FOUND, field="revision")
        return self.revisions[revision]


class ScriptedExecutor(Component):
    """Speaks for the executor of missions: knows which command fits which state, and has no tree."""

    def __init__(self) -> None:
        self.state = MissionState.EMPTY
        self.tree = ""

    @service("mission/status")
    def status(self, request: MissionRequest) -> MissionStatus:
        """Show the mission."""
        return MissionStatus(1.0, self.state, self.tree, 0)

    @service("mission/command")
    def command(self, request: MissionCommand) -> MissionStatus:
        """Obey."""
        if request.command is Command.LOAD:
            if "<root" not in request.tree:
                raise RequestRefused("the tree is not BehaviorTree.CPP XML", RefusalCode.INVALID)
            self.state, self.tree = MissionState.LOADED, request.tree
        elif request.command is Command.START and self.state is MissionState.LOADED:
            self.state = MissionState.RUNNING
        else:
            why = f"{request.command.value} is not possible while {self.state.value}"
            raise RequestRefused(why, RefusalCode.CONFLICT)
        return MissionStatus(1.0, self.state, self.tree, 0)


class HostStub:
    """Speaks for a host: tells of the navigator's process, has its log, and knows the ``architecture``."""

    def __init__(self, bus: Bus, keys: Keys) -> None:
        self._bus = bus
        self._ended = threading.Event()
        self.architecture = robot()
        self.silent = False
        self._status_key = keys.host("local", "status")
        self._token = bus.announce(keys.host("local", "alive"))
        self._queries = [
            bus.serve(keys.host("local", verb), answer)
            for verb, answer in (("logs", self._answer), ("view", self._show), ("usage", self._use))
        ]
        self._thread = threading.Thread(target=self._tell, daemon=True)
        self._thread.start()

    def _tell(self) -> None:
        publisher = self._bus.publisher(self._status_key, type_of(HostStatus).encoding, reliable=True)
        process = ProcessStatus("navigator", 1, ProcessState.RUNNING, 4711)
        sequence = 0
        while not self._ended.wait(0.02):
            sequence += 1
            status = HostStatus("local", 1.0, 42, (process,))
            publisher.put(codec.encode(status), Envelope("host", 1, 1, sequence, 0).to_bytes())

    def _show(self, item: Any) -> None:
        query = self._bus.open_query(item)
        assert query is not None
        if self.silent:
            return
        query.reply(codec.encode(HostView("local", "run", 0, self.architecture, ())))

    def _use(self, item: Any) -> None:
        query = self._bus.open_query(item)
        assert query is not None
        query.reply(codec.encode(HostUsage("local", 2, 100.0, 50.0, {"navigator": RunUsage(0.25, 9.5)})))

    def _answer(self, item: Any) -> None:
        query = self._bus.open_query(item)
        assert query is not None
        wanted = codec.decode(query.payload, LogRequest)
        if wanted.component != "navigator":
            error = ControlError(ControlCode.REFUSED, (f"{wanted.component} does not run here",))
            query.reply(codec.encode(error), error=True)
            return
        lines = tuple(f"line {n}" for n in range(1000))[-wanted.lines :]
        query.reply(codec.encode(LogLines("navigator", lines)))

    def close(self) -> None:
        """Leave."""
        self._ended.set()
        self._thread.join(PATIENCE)
        for queries in self._queries:
            queries.close()
        self._token.close()
