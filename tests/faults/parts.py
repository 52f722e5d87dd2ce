"""A line of components of which some fail, one that decides by their faults, and one that sums all up."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from regraft import CallFailed, Component, Input, Output, Parameter, every, service
from regraft.bus_schema.annotations import Count
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.evaluation import RunSummary, RunSummaryRequest
from regraft.bus_schema.messages.management.system import SystemFault, SystemFaultKind, SystemFaults, SystemStates
from regraft.bus_schema.model.adaptation import ADAPT, AdaptationReport, AdaptationRequest, ChangeState, SetParameters
from regraft.bus_schema.model.lifecycle import Transition
from regraft.lockstep import fault_schedule
from regraft.lockstep.source import TimeSource


@message("faults/Sample")
@dataclass(frozen=True, slots=True)
class Sample:
    """The ``n``-th value, of ``source``."""

    stamp: float
    source: str
    n: Count
    value: float


class World(TimeSource):
    """Counts ticks; the commands of others move it."""

    commands = Input(Sample, required=False)
    position = Output(Sample)

    def __init__(self) -> None:
        self.x = 0.0

    @commands.handler
    def move(self, command: Sample) -> None:
        self.x += command.value

    def advance(self, tick: int, seconds: float) -> None:
        self.position.publish(Sample(self.kit.now(), self.kit.name, tick, self.x))


class ImpatientWorld(World):
    """Gives the host little time to end what fails."""

    def __init__(self) -> None:
        super().__init__()
        fault_schedule.ENDED_TIMEOUT = 1.5


class Driver(Component):
    """Commands the world; what it has counted is restored from its checkpoint."""

    position = Input(Sample, latest_only=True)
    commands = Output(Sample)
    gain = Parameter(1.0, "how hard it moves the world", minimum=0.0, maximum=10.0)
    checkpoint_every = 0.1
    state_version = 1

    def __init__(self) -> None:
        self.n = 0

    @every(hz=10)
    def drive(self) -> None:
        seen = self.position.latest
        if seen is not None:
            self.n += 1
            value = self.gain * (1.0 + 0.01 * (seen.n % 7))
            self.commands.publish(Sample(self.kit.now(), self.kit.name, self.n, value))

    def snapshot(self) -> int:
        return self.n

    def restore(self, state: int) -> None:
        self.n = state


class Decider(Component):
    """Replaces a driver that has a fault by the spare one; when it is back, the spare one rests."""

    faults = Input(SystemFaults, topic="system/faults", required=False)
    decided = Output(Sample)

    def __init__(self) -> None:
        self.told: list[SystemFault] = []
        self.n = 0

    @faults.handler
    async def decide(self, faults: SystemFaults) -> None:
        for fault in faults.news:
            if fault.component == "driver" and fault.kind is not SystemFaultKind.RAISED:
                await self._adapt(fault)

    async def _adapt(self, fault: SystemFault) -> None:
        over = fault.kind is SystemFaultKind.RECOVERED
        wanted = Transition.DEACTIVATE if over else Transition.ACTIVATE
        gain = SetParameters("spare", {"gain": 0.5 + 0.1 * self.n})
        request = AdaptationRequest((gain, ChangeState("spare", wanted)), fault.text, self.kit.name)
        try:
            report = await self.kit.call(ADAPT, request, AdaptationReport, timeout=20.0)
            value = float(report.revision_after)
        except CallFailed:
            value = -1.0
        self.n += 1
        self.decided.publish(Sample(self.kit.now(), fault.kind.value, self.n, value))


class Summary(Component):
    """Sums up all that it reads."""

    position = Input(Sample, keep=10_000)
    commands = Input(Sample, keep=10_000, required=False)
    decided = Input(Sample, keep=10_000, required=False)
    faults = Input(SystemFaults, topic="system/faults", keep=1000, required=False)
    states = Input(SystemStates, topic="system/states", keep=1000, required=False)

    def __init__(self) -> None:
        self.chain = hashlib.sha256()
        self.counts: dict[str, int] = {}
        self.ticks = 0

    @every(seconds=0.25)
    def absorb(self) -> None:
        for port in (self.position, self.commands, self.decided):
            for sample in port.take():
                self._note(codec.encode(sample), sample.source)
        for states in self.states.take():
            self._note(codec.encode(states), "states")
        for faults in self.faults.take():
            self._note(codec.encode(faults), "faults")
            for fault in faults.news:
                self._note(b"", f"{fault.component}.{fault.kind.value}")

    def _note(self, payload: bytes, what: str) -> None:
        self.chain.update(payload + what.encode())
        self.counts[what] = self.counts.get(what, 0) + 1

    @service("run_summary")
    def run_summary(self, request: RunSummaryRequest) -> RunSummary:
        self.absorb()
        counts = dict(sorted(self.counts.items()))
        return RunSummary(self.kit.now(), self.chain.hexdigest(), 0, 0, 0.0, counts, {}, {}, {})


class Beacon(Component):
    """Publishes positions where there is no world."""

    commands = Input(Sample, required=False)
    position = Output(Sample)

    def __init__(self) -> None:
        self.n = 0

    @every(hz=20)
    def shine(self) -> None:
        self.n += 1
        self.position.publish(Sample(self.kit.now(), self.kit.name, self.n, 0.0))
