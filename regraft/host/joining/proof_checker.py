"""Checks for the first host that joining hosts are those they name. The other side is ``security.host_proof``."""

from __future__ import annotations

import hmac
import ssl
from dataclasses import dataclass, field

from regraft.bus.zenoh_config import Tls
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import system_name
from regraft.bus_schema.messages.protocol.control import ControlCode
from regraft.bus_schema.messages.protocol.joining import HostKey, HostProof, JoinHost, ProveHost, RenewLease
from regraft.host.host_publisher import Refused
from regraft.security.host_proof import ACCEPTED, KEY_LENGTH, seal_of, why
from regraft.security.tls import Exchange, common_name, context

MAX_EXCHANGES = 16
"""Handshakes that are remembered; with one more, the oldest is forgotten."""
MAX_INSTANCES = 8
"""Processes of one host whose keys are kept; a host can displace its own alone."""


@dataclass(slots=True)
class _Handshake:
    """This end of a handshake, and what it has last taken and replied: a question may come twice."""

    end: Exchange
    taken: bytes | None = None
    reply: HostProof = field(default_factory=lambda: HostProof(b""))


@dataclass(slots=True)
class _Proved:
    """A process that has proved which host it is; ``number`` is the highest of its messages so far."""

    key: bytes
    number: int = 0


class ProofChecker:
    """Knows which processes have shown the certificate of their host. Without ``tls`` none is asked for."""

    def __init__(self, tls: Tls | None) -> None:
        """No host has proved anything yet; raises OSError, ssl.SSLError for files of no use."""
        self._context = context(tls, server=True) if tls else None
        self._exchanges: dict[str, _Handshake] = {}
        self._proved: dict[str, dict[str, _Proved]] = {}

    @property
    def wanted(self) -> bool:
        """Whether hosts have to prove who they are."""
        return self._context is not None

    def prove(self, asked: ProveHost) -> HostProof:
        """Continue with a handshake; raises Refused, BadMessage, BadKey."""
        if self._context is None:
            raise Refused("this system takes no certificates: it was started without --tls")
        under_way = self._exchanges.pop(asked.exchange, None) or _Handshake(Exchange(self._context, server=True))
        if asked.flight != under_way.taken:
            under_way.reply = self._go_on(under_way.end, asked.flight)
            under_way.taken = asked.flight
        self._exchanges[asked.exchange] = under_way
        while len(self._exchanges) > MAX_EXCHANGES:
            del self._exchanges[next(iter(self._exchanges))]
        return under_way.reply

    def _go_on(self, end: Exchange, flight: bytes) -> HostProof:
        try:
            end.take(flight)
            said = end.heard() if end.done else b""
        except (OSError, ssl.SSLError) as error:
            raise Refused(f"the certificate shown is not accepted: {why(error)}") from None
        if end.done:
            self._take_key(common_name(end.peer()), codec.decode(said, HostKey))
            end.say(ACCEPTED)
        return HostProof(end.flight())

    def _take_key(self, whose: str, told: HostKey) -> None:
        system_name(told.host)
        if len(told.key) != KEY_LENGTH:
            raise BadMessage(f"key: is {len(told.key)} bytes long, must be {KEY_LENGTH}")
        if whose != told.host:
            problem = f"a certificate of {whose!r} was shown for host {told.host!r}"
            raise Refused(f"{problem}: each host joins with its own, of its name ('regraft certificates' makes it)")
        instances = self._proved.setdefault(told.host, {})
        instances[told.instance] = _Proved(told.key)
        while len(instances) > MAX_INSTANCES:
            del instances[next(iter(instances))]

    def check(self, asked: JoinHost | RenewLease) -> None:
        """Raise Refused unless what is asked comes from a process that has proved to be the host that it names."""
        if self._context is None:
            return
        proved = self._proved.get(asked.host, {}).get(asked.instance)
        if proved is None:
            problem = f"host {asked.host!r} has shown no certificate to this run of the system"
            raise Refused(f"{problem}: a host joins by a tls/ endpoint, with --tls FOLDER")
        if not hmac.compare_digest(seal_of(asked, proved.key), asked.seal):
            raise Refused(f"what is asked in the name of host {asked.host!r} does not come from it")
        if asked.number <= proved.number:
            raise Refused(f"message {asked.number} of host {asked.host!r} has come before", ControlCode.TIMED_OUT)
        proved.number = asked.number
