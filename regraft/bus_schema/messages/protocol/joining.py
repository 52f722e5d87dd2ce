"""How a further host joins a system, and stays in it by renewing its lease; asked of the first host."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from regraft.bus_schema.annotations import Count, PlainValue, Seconds, Text
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.hosts.offers import NO_OFFER, HostOffer

PROTOCOL = 7
"""The version that hosts of one system must have in common: raised with every change that older ones would misread."""


@message("regraft/ProveHost")
@dataclass(frozen=True, slots=True)
class ProveHost:
    """Bytes of a TLS handshake by which a host proves its name; ``exchange`` is unique to the handshake."""

    exchange: Annotated[str, Text(64)]
    flight: bytes


@message("regraft/HostProof")
@dataclass(frozen=True, slots=True)
class HostProof:
    """The first host's bytes of that handshake."""

    flight: bytes


@message("regraft/HostKey")
@dataclass(frozen=True, slots=True)
class HostKey:
    """A host's part of that handshake: the key with which this process of it will seal its messages."""

    host: Annotated[str, Text(64)]
    instance: Annotated[str, Text(64)]
    key: bytes


@message("regraft/JoinHost")
@dataclass(frozen=True, slots=True)
class JoinHost:
    """A host wants to be part of the system. ``instance`` is unique to its process, ``offer`` adds to the stack's.

    Where hosts prove who they are, ``seal`` is an HMAC-SHA256 of the other fields, and ``number`` rises.
    """

    host: Annotated[str, Text(64)]
    instance: Annotated[str, Text(64)]
    protocol: Count = PROTOCOL
    pid: Count = 0
    number: Count = 0
    seal: bytes = b""
    offer: HostOffer = NO_OFFER


@message("regraft/PastRun")
@dataclass(frozen=True, slots=True)
class PastRun:
    """The record of a component's runs so far; ``checkpoint`` is the payload of the last `regraft/Snapshot`."""

    component: str
    incarnation: Count
    checkpoint: bytes = b""


@message("regraft/JoinedSystem")
@dataclass(frozen=True, slots=True)
class JoinedSystem:
    """The knowledge that a host needs to take part. The folders are those of the first host.

    ``source`` is the component that makes simulated time continue, empty under the real clock. ``references`` has the
    values that components to come may refer to, by robot. ``lease`` is how long a
    sign of life of the joined host holds. ``by_certificate``: hosts have to prove who they are. ``packages`` has the
    folders of the packages with installed stacks and robots. ``changed`` are components of which the host may have
    missed new specs: what runs of them begins again. ``folders`` are those of the stack's files and robots, where
    modules are looked for.
    """

    run: str
    revision: Count
    term: Count
    architecture: Architecture
    seed: Count
    source: str
    folder: str
    stack_folder: str
    lease: Seconds
    past: tuple[PastRun, ...] = ()
    by_certificate: bool = False
    references: dict[str, dict[str, PlainValue]] = field(default_factory=dict)
    packages: dict[str, str] = field(default_factory=dict)
    changed: tuple[str, ...] = ()
    folders: tuple[str, ...] = ()


@message("regraft/RenewLease")
@dataclass(frozen=True, slots=True)
class RenewLease:
    """A sign of life of a host that has joined; ``leaving`` is its last one. Sealed as `regraft/JoinHost` is."""

    host: str
    instance: str
    leaving: bool = False
    number: Count = 0
    seal: bytes = b""


@message("regraft/Lease")
@dataclass(frozen=True, slots=True)
class Lease:
    """Whether the host is part of the system; if not, it must join again. ``ending``: the system ends."""

    held: bool
    ending: bool = False
