"""The situation in which a planner decides: the entries of the decision's context as they are now."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Final

from regraft import Input, Kit
from regraft.adaptation_manager.planners.decisions.model import ContextEntry, Decision
from regraft.bus_schema.encoding.reading import read
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.mission import MissionStatus

MISSION: Final = "mission"
"""The input from which requirements are read."""

HasFailed = Callable[[str], bool | None]
"""Whether a component has failed; None if that is not known."""


def inputs_for(decisions: Iterable[Decision]) -> Iterator[Input[Any]]:
    """Yield the inputs that decisions need: one for each entry that is read from a topic, and the mission's status."""
    required = False
    for decision in decisions:
        for entry in decision.context:
            required = required or bool(entry.requirement)
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
    if required:
        yield Input(MissionStatus, latest_only=True, required=False, name=MISSION, origin="decisions")


def port_of(decision: Decision, entry: ContextEntry) -> str:
    """Return the name of the input that an entry is read from."""
    return f"{decision.name}_{entry.name}"


def situation(decision: Decision, kit: Kit, has_failed: HasFailed, told: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries that are known now: those that have come, are not stale, and are numbers or texts.

    ``told`` is the context of a request.
    """
    found = [
        (entry.name, told.get(entry.request) if entry.request else _value(decision, entry, kit, has_failed))
        for entry in decision.context
    ]
    return {name: value for name, value in found if isinstance(value, bool | int | float | str)}


def _value(decision: Decision, entry: ContextEntry, kit: Kit, has_failed: HasFailed) -> Any:
    if entry.component:
        return has_failed(entry.component)
    name = MISSION if entry.requirement else port_of(decision, entry)
    if name not in kit.inputs:  # the file has another entry than when the process started
        return None
    port = kit.inputs[name]
    message = port.latest
    age = math.inf if port.stamp is None else kit.now() - port.stamp
    if message is None or (entry.stale_after is not None and age >= entry.stale_after):
        return None
    if entry.requirement:
        known = [each for each in message.qualities if each.requirement == entry.requirement]
        return known[0].satisfied if known else None
    assert entry.reading is not None
    try:
        return read(message, entry.reading)
    except BadMessage:
        return None
