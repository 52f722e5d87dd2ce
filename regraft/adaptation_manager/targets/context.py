"""The context of steps: the queries, the architectures before and after, the bounds of every wait."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from regraft.adaptation_manager.targets.component_client import BESIDE, ComponentClient
from regraft.adaptation_manager.targets.host_client import Hosts
from regraft.bus_schema.messages.protocol.host import ProcessStatus
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome, Unreached
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec

if TYPE_CHECKING:
    from regraft import Kit


@dataclass(frozen=True, slots=True)
class Bounds:
    """Wall-clock seconds that an answer, a binding of connections, undoing a step, starting a process may take."""

    answer: float = 2.0
    bind: float = 1.0
    undo: float = 5.0
    start: float = 20.0


@dataclass(slots=True)
class ExecutionContext:
    """One adaptation's work place; components get ``revision``, ``touch`` notes them in the slot.

    ``state_lost`` are the components that continue without what they knew last: the previous run was lost.
    ``tolerated`` are those that failed where they were to do less, and are left as they are; ``left_down`` those that
    did so in an undo. ``out_of_reach`` are those on hosts that were not there then: they are as before once it is back.
    ``unfinished`` is set if something is left that could not be ended: it does nothing, and is ended once its host
    answers.
    """

    kit: Kit
    controls: ComponentClient
    hosts: Hosts
    bounds: Bounds
    touch: Callable[[str], None]
    before: Architecture
    after: Architecture
    revision: int
    state_lost: set[str] = field(default_factory=set)
    tolerated: set[str] = field(default_factory=set)
    left_down: set[str] = field(default_factory=set)
    out_of_reach: dict[str, Unreached] = field(default_factory=dict)
    unfinished: bool = False

    def start_within(self, spec: ComponentSpec) -> float:
        """Return the seconds that a component's process may take to come up and get ready."""
        return self.bounds.start + self.after.handler_timeout(spec)

    @property
    def loss(self) -> str:
        """Report whose state was lost, empty if nobody's."""
        names = ", ".join(sorted(self.state_lost))
        return f"{names}: the run of before was lost, and with it its state" if names else ""

    @property
    def outcome(self) -> Outcome:
        """Return how an ended adaptation was described."""
        return Outcome.APPLIED_STATE_LOST if self.state_lost else Outcome.APPLIED

    def note_reach(self, component: str) -> None:
        """Note a component as out of reach if its host is not there."""
        spec = self.before.components.get(component) or self.after.components.get(component)
        if spec is not None and not self.hosts.is_there(spec.host):
            code, why = self.hosts.how_not_there(spec.host), f"its {self.hosts.why_not_there(spec.host)}"
            self.out_of_reach[component] = Unreached(component, code, spec.host, why)

    def unreached(self, report: AdaptationReport) -> tuple[Unreached, ...]:
        """Return what a report has as not reached, with what an undo did not reach."""
        found = {each.component: each for each in report.unreached} | self.out_of_reach
        return tuple(found[name] for name in sorted(found))

    async def refresh(self) -> None:
        """Ask the hosts which processes run now; the last report of a silent host holds. Raises ControlFailed."""
        known = self.controls.processes
        told = await self.hosts.processes(self.before.revision)
        silent = {name: process for name, process in known.items() if self._host(name, process) in self.hosts.silent}
        self.controls.processes = silent | told

    def _host(self, component: str, process: ProcessStatus) -> str:
        name = component.removesuffix(BESIDE)
        spec = self.after.components.get(name) or self.before.components.get(name)
        return self.hosts.where(process) or (spec.host if spec else "")

    async def pause(self, seconds: float) -> None:
        """Let wall-clock time pass; in an exclusive slot there is no other."""
        await self.kit.compute(time.sleep, seconds)

    def writers(self, topic: str) -> list[str]:
        """Return the running components that may write ``topic``, before or after."""
        ends = {*self.before.writers(topic), *self.after.writers(topic)}
        return self._running({component for component, _ in ends})

    def readers(self, topic: str) -> list[str]:
        """Return the running components that may read ``topic``, before or after."""
        ends = {*self.before.readers(topic), *self.after.readers(topic)}
        return self._running({component for component, _ in ends})

    def _running(self, names: set[str]) -> list[str]:
        return sorted(name for name in names if self.controls.living(name))

    def direction(self, component: str, port: str) -> str:
        """Return whether a port is an ``input`` or an ``output``; empty if there is no such port."""
        spec = self.after.components.get(component) or self.before.components[component]
        description = spec.description
        described = description.port(port) if description else None
        return described.direction if described else ""
