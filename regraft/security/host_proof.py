"""How a host proves to the first one that it is the host whose name it joins under.

The link's TLS proves only that some certificate of the authority is at its other end. So both hosts do a TLS handshake
with each other through the bus, and compare the names in the certificates. Within it the joining host gives the first a
key of its own. With the key it seals its later queries.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
import ssl
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from regraft.bus.zenoh_config import Tls
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.joining import HostKey, HostProof, JoinHost, ProveHost, RenewLease
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.security.credentials import reason_of
from regraft.security.tls import Exchange, common_name, context

ACCEPTED = b"accepted"
KEY_LENGTH = 32

Sealed = TypeVar("Sealed", JoinHost, RenewLease)


class NotProved(Exception):
    """An end has not proved who it is; the text states why."""


class Seal:
    """Seals the messages of one process of a host; one without a key leaves them as they are."""

    def __init__(self, key: bytes = b"") -> None:
        self._key = key
        self._number = 0

    def on(self, asked: Sealed) -> Sealed:
        """Return a message with a seal that no other message has."""
        if not self._key:
            return asked
        self._number += 1
        numbered = replace(asked, number=self._number)
        return replace(numbered, seal=seal_of(numbered, self._key))


def seal_of(asked: JoinHost | RenewLease, key: bytes) -> bytes:
    """Return the seal of a message."""
    verb, detail = ("join", asked.pid) if isinstance(asked, JoinHost) else ("renew", int(asked.leaving))
    lines: tuple[object, ...] = (verb, asked.host, asked.instance, asked.number, detail)
    if isinstance(asked, JoinHost) and asked.offer:
        lines = (*lines, asked.offer.text())
    return hmac.digest(key, "\n".join(map(str, lines)).encode(), hashlib.sha256)


def prove(tls: Tls, host: str, instance: str, ask: Callable[[ProveHost], HostProof]) -> Seal:
    """Prove that this process is a host; ``ask`` hands bytes to the first host and returns what it answers.

    Raises:
        NotProved: the first host proves nothing, or is not the one of that name.
    """
    exchange, key = secrets.token_hex(16), secrets.token_bytes(KEY_LENGTH)
    try:
        end = Exchange(context(tls, server=False), server=False)
        end.take(b"")
        while not end.done:
            end.take(ask(ProveHost(exchange, end.flight())).flight)
        whose = common_name(end.peer())
        if whose != LOCAL:
            problem = f"the first host shows the certificate of {whose!r}: it must be that of {LOCAL!r}"
            raise NotProved(problem)
        end.say(codec.encode(HostKey(host, instance, key)))
        end.take(ask(ProveHost(exchange, end.flight())).flight)
        if end.heard() != ACCEPTED:
            raise NotProved("no reply of the first host whether it accepts our certificate")
    except (OSError, ssl.SSLError) as error:
        raise NotProved(f"the first host does not prove itself: {why(error)}") from None
    return Seal(key)


def why(error: Exception) -> str:
    """Return in words why a handshake has failed."""
    return error.verify_message if isinstance(error, ssl.SSLCertVerificationError) else reason_of(error)
