"""The situation in which a planner decides: the entries of the decision's context as they are now."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

from regraft import Input, Kit
from regraft.adaptation_manager.planners.decisions.model import ContextEntry, Decision
from regraft.bus_schema.encoding.reading import read
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.management.system import SystemFaults, SystemMeasurements, SystemQualities
from regraft.bus_schema.model import system_topics

FAULTS: Final = "faults"
"""The input from which the faults of components are read. No entry's input is called so: those have a '_'."""
REQUIREMENTS: Final = "requirements"
"""The input from which requirements are read."""
MEASUREMENTS: Final = "measurements"
"""The input from which measured qualities of components are read."""


def inputs_for(decisions: Iterable[Decision]) -> Iterator[Input[Any]]:
    """Yield the inputs that decisions need: one for each entry of a topic, and those of the system's own topics."""
    system: set[str] = set()
    for decision in decisions:
        if decision.measured_names():
            system.add(MEASUREMENTS)
        for entry in decision.context:
            system |= {system_input(entry)}
            if entry.reading is not None:
                yield Input(
                    None,
                    topic=entry.topic,
                    latest_only=True,
                    required=False,
                    description=f"for {entry.name} of the decision {decision.name}",
                    reads=(entry.reading,),
                    name=port_of(decision, entry),
                    origin="decisions",
                )
    if FAULTS in system:
        yield Input(SystemFaults, topic=system_topics.FAULTS, required=False, name=FAULTS, origin="decisions")
    if REQUIREMENTS in system:
        topic = system_topics.QUALITIES
        yield Input(SystemQualities, topic=topic, required=False, name=REQUIREMENTS, origin="decisions")
    if MEASUREMENTS in system:
        topic = system_topics.MEASUREMENTS
        yield Input(SystemMeasurements, topic=topic, required=False, name=MEASUREMENTS, origin="decisions")


def system_input(entry: ContextEntry) -> str:
    """Return the name of the input that reads the system's own topic for an entry, empty if it has none."""
    return FAULTS if entry.component else REQUIREMENTS if entry.requirement else ""


def port_of(decision: Decision, entry: ContextEntry) -> str:
    """Return the name of the input that an entry is read from."""
    return system_input(entry) or f"{decision.name}_{entry.name}"


def situation(decision: Decision, kit: Kit, told: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries that are known now: those that have come, are not stale, and are numbers or texts.

    ``told`` is the context of a request.
    """
    found = [
        (entry.name, told.get(entry.request) if entry.request else _value(decision, entry, kit))
        for entry in decision.context
    ]
    return {name: value for name, value in found if isinstance(value, bool | int | float | str)}


def _value(decision: Decision, entry: ContextEntry, kit: Kit) -> Any:
    name = port_of(decision, entry)
    if name not in kit.inputs:  # the file has another entry than when the process started
        return None
    port = kit.inputs[name]
    message = port.latest
    age = math.inf if port.stamp is None else kit.now() - port.stamp
    if message is None or (entry.stale_after is not None and age >= entry.stale_after):
        return None
    if entry.component:
        return any(fault.component == entry.component for fault in message.present)
    if entry.requirement:
        return next((each.satisfied for each in message.qualities if each.requirement == entry.requirement), None)
    assert entry.reading is not None
    try:
        return read(message, entry.reading)
    except BadMessage:
        return None
