"""All that a system publishes of itself, put together from its parts' reports."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from regraft.bus_schema.messages.health import Diagnostic
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.management.system import (
    ComponentState,
    HostCondition,
    SystemDiagnostics,
    SystemFault,
    SystemFaultKind,
    SystemFaults,
    SystemHosts,
    SystemMeasurements,
    SystemNews,
    SystemQualities,
    SystemStates,
)
from regraft.bus_schema.messages.protocol.host import OtherHost
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.system_topics import DIAGNOSTICS, FAULTS, HOSTS, MEASUREMENTS, QUALITIES, STATES

ENDS = (SystemFaultKind.DIED, SystemFaultKind.HUNG, SystemFaultKind.QUARANTINED)
"""The faults after which a component has no run."""
MAX_KEPT = 10_000


class SystemView:
    """The present state of a system.

    Attributes:
        changed: the topics with something new to publish.
    """

    def __init__(self) -> None:
        self.changed: set[str] = set()
        self.states: dict[str, ComponentState] = {}
        self.faults: dict[str, SystemFault] = {}
        self._fault_news: list[SystemFault] = []
        self._diagnostics: dict[tuple[str, str], Diagnostic] = {}
        self._diagnostic_news: list[Diagnostic] = []
        self._qualities: dict[str, Quality] = {}
        self._measured: dict[str, MeasuredQualities] = {}
        self._hosts: tuple[HostCondition, ...] = ()
        self._made: dict[str, Callable[[float], object]] = {
            STATES: self._states_message,
            FAULTS: self._faults_message,
            DIAGNOSTICS: self._diagnostics_message,
            QUALITIES: self._qualities_message,
            MEASUREMENTS: self._measurements_message,
            HOSTS: lambda stamp: SystemHosts(stamp, self._hosts),
        }

    # --- what is heard ---

    def take(self, news: SystemNews, stamp: float) -> None:
        """Take a component's report on itself."""
        for fault in news.faults:
            self.take_fault(fault)
        if news.state is not None:
            self.take_state(news.state, stamp)
        for diagnostic in news.diagnostics:
            self.take_diagnostic(diagnostic)
        for quality in news.qualities:
            self.take_quality(quality)
        if news.measured is not None:
            self.take_measured(news.measured)

    def take_state(self, state: ComponentState, stamp: float) -> None:
        """Take the state of a component; another run that has not failed is the end of the former one's fault."""
        before = self.states.get(state.component)
        if state == before:
            return
        self.states[state.component] = state
        self.changed.add(STATES)
        measured = self._measured.get(state.component)
        if measured is not None and (state.state is not State.ACTIVE or state.incarnation > measured.incarnation):
            self._forget_measured(state.component)
        fault = self.faults.get(state.component)
        if fault is not None and state.incarnation > fault.incarnation and not state.failure:
            text = f"{state.component} has been started again"
            recovered = SystemFaultKind.RECOVERED
            self.take_fault(SystemFault(stamp, state.component, state.incarnation, recovered, text, "another_run"))

    def take_fault(self, fault: SystemFault) -> None:
        """Take a fault of a component, or its end."""
        self._fault_news.append(fault)
        self.changed.add(FAULTS)
        if fault.kind is SystemFaultKind.RECOVERED:
            self.faults.pop(fault.component, None)
        elif fault.kind is not SystemFaultKind.RAISED:
            self.faults[fault.component] = fault
        state = self.states.get(fault.component)
        if fault.kind in ENDS and state is not None and state.state is not None:
            self.states[fault.component] = replace(state, state=None, failure="")
            self.changed.add(STATES)
        if fault.kind in ENDS:
            self._forget_measured(fault.component)

    def remove(self, component: str) -> None:
        """Forget a component that is removed."""
        if self.states.pop(component, None) is not None:
            self.changed.add(STATES)
        if self.faults.pop(component, None) is not None:
            self.changed.add(FAULTS)
        self._forget_measured(component)

    def take_diagnostic(self, diagnostic: Diagnostic) -> None:
        """Take a diagnostic."""
        key = (diagnostic.source, diagnostic.subject)
        if key in self._diagnostics or len(self._diagnostics) < MAX_KEPT:
            self._diagnostics[key] = diagnostic
            self._diagnostic_news.append(diagnostic)
            self.changed.add(DIAGNOSTICS)

    def take_quality(self, quality: Quality) -> None:
        """Take how a requirement is met."""
        if quality.requirement in self._qualities or len(self._qualities) < MAX_KEPT:
            self._qualities[quality.requirement] = quality
            self.changed.add(QUALITIES)

    def take_measured(self, measured: MeasuredQualities) -> None:
        """Take what a component has measured of itself, unless it is known to do nothing, or to be another run."""
        state = self.states.get(measured.component)
        run = (measured.incarnation, True)
        if state is not None and (state.incarnation, state.state is not State.ACTIVE) >= run:
            return
        self._measured[measured.component] = measured
        self.changed.add(MEASUREMENTS)

    def _forget_measured(self, component: str) -> None:
        if self._measured.pop(component, None) is not None:
            self.changed.add(MEASUREMENTS)

    def take_hosts(self, hosts: Iterable[OtherHost]) -> None:
        """Take how the hosts are."""
        now = tuple(HostCondition(host.host, host.state) for host in hosts)
        if now != self._hosts:
            self._hosts = now
            self.changed.add(HOSTS)

    # --- what is published ---

    def message(self, topic: str, stamp: float) -> object:
        """Return the message of a topic; what is new in it counts as published then."""
        self.changed.discard(topic)
        return self._made[topic](stamp)

    def pass_over(self, topic: str) -> None:
        """Take for published what is new on a topic without readers."""
        self.changed.discard(topic)
        if topic == FAULTS:
            self._fault_news.clear()
        elif topic == DIAGNOSTICS:
            self._diagnostic_news.clear()

    def _states_message(self, stamp: float) -> SystemStates:
        return SystemStates(stamp, tuple(state for _, state in sorted(self.states.items())))

    def _faults_message(self, stamp: float) -> SystemFaults:
        news, self._fault_news = tuple(self._fault_news), []
        return SystemFaults(stamp, tuple(fault for _, fault in sorted(self.faults.items())), news)

    def _diagnostics_message(self, stamp: float) -> SystemDiagnostics:
        news, self._diagnostic_news = tuple(self._diagnostic_news), []
        return SystemDiagnostics(stamp, tuple(each for _, each in sorted(self._diagnostics.items())), news)

    def _qualities_message(self, stamp: float) -> SystemQualities:
        return SystemQualities(stamp, tuple(quality for _, quality in sorted(self._qualities.items())))

    def _measurements_message(self, stamp: float) -> SystemMeasurements:
        return SystemMeasurements(stamp, tuple(measured for _, measured in sorted(self._measured.items())))
