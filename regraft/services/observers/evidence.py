"""Evidence of failures: from the lifecycle and the process of a component, and from the health of its sensors."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from regraft.bus_schema.messages.health import SensorHealth
from regraft.bus_schema.messages.management.system import SystemFaultKind, SystemFaults, SystemStates
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import State
from regraft.services.observers.condition import UNKNOWN, Evidence

FAILED_STATES = (State.ERROR_PROCESSING, State.FINALIZED)


def of_life(component: str, states: SystemStates | None, faults: SystemFaults | None, *, must_run: bool) -> Evidence:
    """Return what the lifecycle and the process of a component show.

    A failure by itself, a crash, a hang and quarantine count until they are over; an exception in a handler does not
    count. A component without a run has failed if it ``must_run`` by now. One that is inactive has not failed.
    """
    if states is None or faults is None:
        return UNKNOWN
    for fault in faults.present:
        if fault.component == component and fault.kind is not SystemFaultKind.RAISED:
            why = f"{fault.kind.value}: {fault.text}" if fault.text else fault.kind.value
            return Evidence(True, why, by_itself=fault.kind is SystemFaultKind.FAILED, stamp=fault.stamp)
    known = next((each for each in states.components if each.component == component), None)
    if known is None or known.state is None:
        why = "it has no run" if known is not None else "it is not in the system"
        return Evidence(True, why) if must_run else UNKNOWN
    if known.failure or known.state in FAILED_STATES:
        why = known.failure or f"it is in the state {known.state.value}"
        return Evidence(True, why, by_itself=bool(known.failure))
    return Evidence(False)


def of_sensors(
    topics: Collection[str], health: SensorHealth | None, now: float, stale_after: float, ignored: Collection[str]
) -> Evidence:
    """Return what the latest health of sensors shows of those at ``topics``; old news show nothing."""
    if health is None or now - health.stamp > stale_after:
        return UNKNOWN
    for fault in health.faults:
        if fault.topic in topics and fault.fault not in ignored:
            return Evidence(True, f"{fault.topic} {fault.fault}: {fault.text}")
    return Evidence(False) if any(topic in health.watched for topic in topics) else UNKNOWN


def topics_of(
    components: Iterable[str], architecture: Architecture | None, given: Mapping[str, str]
) -> dict[str, set[str]]:
    """Return the topics whose sensors each component answers for.

    A topic that is ``given`` is that component's. Others are those of their writers.
    """
    found: dict[str, set[str]] = {component: set() for component in components}
    for topic, component in given.items():
        if component in found:
            found[component].add(topic)
    if architecture is None:
        return found
    for topic in architecture.topics.keys() - given.keys():
        for writer, _ in architecture.writers(topic):
            if writer in found:
                found[writer].add(topic)
    return found
