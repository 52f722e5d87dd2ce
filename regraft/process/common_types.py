"""The message types that the process of every component uses."""

from __future__ import annotations

from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.messages.health import ComponentStatus, Event
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.protocol.clock import Ack, ClockTime, Join, MarkerAck, SlotRequest, Step
from regraft.bus_schema.messages.protocol.control import (
    ComponentView,
    ParameterValues,
    Resend,
    Resent,
    Rewire,
    SetTransition,
    Snapshot,
)
from regraft.bus_schema.messages.protocol.handover import HandedOver, Handover, HandoverOffer
from regraft.bus_schema.messages.protocol.host import DescribedComponent, HostStatus, HostView
from regraft.bus_schema.messages.protocol.requests import Reply, Request
from regraft.bus_schema.model.architecture import Architecture
from regraft.runtime.core.assignment import Assignment

TIMED = (Ack, ClockTime, Join, MarkerAck, SlotRequest, Step, Resend, Resent)
COMPONENTS = (Assignment, ComponentStatus, ComponentView, Event, MeasuredQualities, Rewire, Snapshot, Reply, Request)
ADAPTED = (ParameterValues, SetTransition, Handover, HandoverOffer, HandedOver)
"""Each component would compile these as it is adapted: a successor, while its incumbent waits for it."""
HOSTS = (Architecture, DescribedComponent, HostStatus, HostView)
COMMON_TYPES = (*TIMED, *COMPONENTS, *ADAPTED, *HOSTS)


def compile_common_types() -> None:
    """Compile the conversions of these types once, for all processes that are forked from this one."""
    for cls in COMMON_TYPES:
        type_of(cls).compile()
