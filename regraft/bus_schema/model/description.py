"""A component's description of itself: tools, checks and docs build on nothing else."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, ClassPath, Count, PlainValue, Ratio, Seconds
from regraft.bus_schema.encoding.reading import Reading
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.errors import BadKey, BadMessage
from regraft.bus_schema.keys import resource_name
from regraft.bus_schema.model.qualities.qualities import QualityDescription

ANY_TYPE = "*"
"""The type of an input that takes every message of its topic, of any type."""
RESERVED_AMOUNTS = ("cpu", "memory", "devices")
"""Resources have these names for other things."""
PATH = "path"
"""The unit of a text that names a file."""


Amounts = dict[str, Annotated[float, Bounds(0.0)]]
"""How much of each amount, by name."""


@message("regraft/PortDescription")
@dataclass(frozen=True, slots=True)
class PortDescription:
    """A port: its direction (``input`` or ``output``), its message type, and the topic it has by default.

    ``required`` inputs must be fed by somebody, the topics of ``required`` outputs be in the stack's table;
    ``latest_only`` inputs see only the newest message. An input of type ``*`` takes any message that ``reads`` can
    be read from. ``origin`` is the part of a parameter's value that asks for the port, such as ``mapping.0``; empty
    for the ports that every component of the class has.
    """

    name: str
    direction: str
    type: str
    version: Count
    topic: str
    required: bool = True
    latest_only: bool = False
    description: str = ""
    reads: tuple[Reading, ...] = ()
    origin: str = ""


@message("regraft/ParameterDescription")
@dataclass(frozen=True, slots=True)
class ParameterDescription:
    """A parameter: its default, its JSON Schema (type, bounds, choices), its unit, and whether it is only read.

    One that ``exists`` is a path to a file that has to be there before the component starts.
    """

    name: str
    default: PlainValue
    schema: dict[str, PlainValue]
    unit: str = ""
    read_only: bool = False
    description: str = ""
    exists: bool = False

    @property
    def names_files(self) -> bool:
        """Whether the value is a path, or lists records that have one: each host has folders of its own."""
        return self.unit == PATH or _has_path(self.schema)


@message("regraft/ServiceDescription")
@dataclass(frozen=True, slots=True)
class ServiceDescription:
    """A service (``feedback`` None) or an action that a component offers, by the types of its parts.

    ``goals`` is how many goals an action pursues at once. With 1 a newer goal ends the older one; with more, a goal
    beyond them is refused. It is 0 for a service.
    """

    name: str
    kind: str
    request: str
    reply: str
    feedback: str | None = None
    description: str = ""
    goals: Count = 0


@message("regraft/Resources")
@dataclass(frozen=True, slots=True)
class Resources:
    """A component's demand on its host: share of one core, memory in MiB, and devices that only one may hold.

    ``amounts`` are further amounts by name, such as ``{"power": 3.5, "accelerator_area": 0.4}``. Those of all
    components on a host add up. The name's documentation states its unit, which is that of the hosts' offers.
    """

    cpu: Ratio = 0.0
    memory: float = 0.0
    devices: tuple[str, ...] = ()
    amounts: Amounts = field(default_factory=dict)


def check_amounts(amounts: Mapping[str, float]) -> None:
    """Make sure that named amounts are amounts; raises BadMessage."""
    for name, value in amounts.items():
        try:
            resource_name(name, "amount")
        except BadKey as error:
            raise BadMessage(str(error), ("amounts", name)) from None
        if name in RESERVED_AMOUNTS:
            raise BadMessage("is a field of its own: give it there", ("amounts", name))
        if not 0.0 <= value < math.inf:
            raise BadMessage(f"is {value:g}, must be finite and at least 0", ("amounts", name))


def check_devices(devices: Sequence[str]) -> None:
    """Make sure that devices have names; raises BadMessage."""
    for index, name in enumerate(devices):
        try:
            resource_name(name, "device")
        except BadKey as error:
            raise BadMessage(str(error), ("devices", str(index))) from None


@message("regraft/Description")
@dataclass(frozen=True, slots=True)
class Description:
    """A component: its class's description of itself, given the read-only parameters.

    ``handler_timeout`` is how long one handler may keep the loop before it counts as hung. ``lockstep`` is whether it
    is a member of simulated time. ``removal_forbidden`` is why a running system cannot be without it, empty if it can.
    ``stateful`` is whether it gives a state, of version ``state_version``; ``restores`` are the versions of a state
    that it restores. ``is_time_source`` is true of the source of simulated time. One that is ``exclusive`` holds, while
    it is configured, what no other process can hold at the same time. Those ``qualities`` that it measures are
    published every ``evaluate_every`` seconds; None: never. One that ``estimates_from_inputs`` does so from the
    qualities of what feeds it.
    """

    cls: ClassPath
    description: str
    ports: tuple[PortDescription, ...] = ()
    parameters: tuple[ParameterDescription, ...] = ()
    services: tuple[ServiceDescription, ...] = ()
    state_version: Count = 0
    handler_timeout: Seconds = 0.0
    resources: Resources = field(default_factory=Resources)
    lockstep: bool = True
    removal_forbidden: str = ""
    stateful: bool = False
    restores: tuple[Count, ...] = ()
    is_time_source: bool = False
    exclusive: bool = False
    qualities: tuple[QualityDescription, ...] = ()
    evaluate_every: Seconds | None = None
    estimates_from_inputs: bool = False

    def port(self, name: str) -> PortDescription | None:
        """Return the port of that name."""
        return next((port for port in self.ports if port.name == name), None)

    def parameter(self, name: str) -> ParameterDescription | None:
        """Return the parameter of that name."""
        return next((parameter for parameter in self.parameters if parameter.name == name), None)

    def quality(self, name: str) -> QualityDescription | None:
        """Return the quality of that name."""
        return next((quality for quality in self.qualities if quality.name == name), None)


def types_in(description: Description) -> tuple[str, ...]:
    """Return the names of the message types that a component's ports, services and actions use, each once."""
    ports = [port.type for port in description.ports if port.type != ANY_TYPE]
    parts = [part for offered in description.services for part in (offered.request, offered.reply, offered.feedback)]
    return tuple(sorted({name for name in (*ports, *parts) if name}))


def _has_path(schema: PlainValue) -> bool:
    inner = (schema.get("items"), *schema.get("properties", {}).values())
    return schema.get("x-unit") == PATH or any(_has_path(part) for part in inner if isinstance(part, dict))
